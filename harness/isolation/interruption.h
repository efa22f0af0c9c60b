// Ctrl-C (SIGINT), SIGTERM and SIGHUP while processes work for this one: they end nothing by
// themselves.
#pragma once

#include <array>
#include <csignal>
#include <stdexcept>

namespace loopbench::harness {

/// Thrown by RunInProcesses() when the user or the system wants this process to end.
class Interrupted : public std::runtime_error {
 public:
  explicit Interrupted(int signal);
  int exit_code() const { return 128 + signal_; }  ///< as a shell has it: 130 for Ctrl-C

 private:
  int signal_;
};

/// While it lives the first of these signals is remembered, and RunInProcesses() throws; a second
/// one ends this process at once. A signal that was ignored before (nohup) still is. One at a time.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// Throws Interrupted if there was a signal.
  static void Check();
  /// In a child process: its parent decides, and a terminal sends Ctrl-C to both.
  static void LeaveToParent();

 private:
  std::array<struct sigaction, 3> before_;
};

}  // namespace loopbench::harness
