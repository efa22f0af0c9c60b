// A progress line with the time still to go, on standard error when that is a terminal.
#pragma once

#include <chrono>
#include <mutex>
#include <string>

namespace loopbench::harness {

/// Counts finished pieces of work. Silent when standard error is not a terminal.
class Progress {
 public:
  Progress(std::string what, std::size_t total);
  ~Progress();  ///< clears the line

  /// One more piece is done; `label` is shown. May be called from several threads.
  void Step(const std::string& label);

 private:
  std::string what_;
  std::size_t total_, done_ = 0;
  bool terminal_;
  std::chrono::steady_clock::time_point begin_;
  std::mutex mutex_;
};

}  // namespace loopbench::harness
