// Child processes with limits: their watch, interruption, faults and prints.
#pragma once

#include <sys/types.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

// What a child process does with its time, seen from its parent.
//
// Wall time says nothing about a piece of work: sixty-four pieces on two processors take
// thirty-two times as long, and a machine that sleeps for a night takes a night. So a child is
// judged by two clocks that other work does not move:
//   - its CPU time, which the kernel counts;
//   - how long it has been asleep of its own accord. Work that computes has no reason to sleep: it
//     reads nothing, waits for nobody, and its answer is taken from it as it comes.
// Asleep is what the kernel calls so (state S). A child that is ready to run but gets no processor
// (R), is stopped or traced (T, t) or waits for a disk or for swapped memory (D) is held up by the
// machine; that time counts neither for nor against it. Since the parent may be stopped too, one
// look adds no more than the time that should lie between two looks, however long it was.

/// Time between two looks at a child [s].
inline constexpr double kLook_s = 0.25;

class ChildWatch {
 public:
  /// `pid` is a child that has not been waited for.
  explicit ChildWatch(pid_t pid) : pid_(pid) {}

  /// Looks at the child, unless the last look is less than kLook_s ago. `unread`: its answer waits
  /// to be read, which is not its fault.
  void Look(bool unread);

  /// CPU time used so far, all threads [s].
  double cpu_s() const;
  /// Time asleep on end, as far as looks have found, since it last computed [s].
  double idle_s() const { return idle_s_; }

 private:
  using Clock = std::chrono::steady_clock;

  pid_t pid_;
  Clock::time_point looked_ = Clock::now();
  double cpu_before_ = 0.0;  ///< at the last look
  double idle_s_ = 0.0;
};

// Ctrl-C (SIGINT), SIGTERM and SIGHUP while processes work for this one: they end nothing by
// themselves.

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

// Planted faults, so that the tests can see what a misbehaving case does to a run.
//
// The environment variable LOOPBENCH_FAULT = "<fault>:<key>=<value>[,<value>]" makes every accuracy
// case that meets the condition crash, hang, exhaust memory, throw, or answer garbage. It is read
// in the child process of the case, and has no other effect.

/// Does what LOOPBENCH_FAULT says about the case with these keys: may not return. The answer to
/// send in place of the record's when the fault is garbage, else nothing.
std::optional<std::string> PlantedFault(const Record& keys);

// Work in child processes: whatever a piece of work does, the parent gets an answer and goes on.
//
// Each piece runs in a fork of this program, under limits of its own, and answers with text through
// a pipe. A crash, an overrun of time or memory, or silence is an ending with a name. Time is CPU
// time: neither other work on the processor nor a pause of the machine decides anything
// (processes.h).
// The caller must have a single thread: a fork copies only the thread that calls it.

enum class ProcessEnding {
  kAnswered,    ///< returned a text
  kThrew,       ///< an exception left the work; the message is its text
  kCrashed,     ///< ended by a signal, or left through exit()
  kOverTime,    ///< killed: it used up its CPU time, or slept for long
  kOverMemory,  ///< asked for more memory than allowed
};

struct ProcessLimits {
  double cpu_s = 0.0;      ///< killed after so much CPU time [s]; 0: no limit
  double memory_mb = 0.0;  ///< address space beyond what the parent has [MiB]; 0: no limit
  /// Killed after so much time asleep on end [s]: work that computes does not sleep at all.
  double idle_s = 5.0;
};

struct ProcessResult {
  ProcessEnding ending = ProcessEnding::kAnswered;
  std::string text;  ///< the answer, or what is known about the failure
  double wall_s = 0.0, cpu_s = 0.0;
};

/// What the parent may want to know while pieces work.
struct ProcessNews {
  std::function<void(std::size_t)> started = {};
  std::function<void()> waited = {};  ///< four times a second at least
};

/// Runs work(i) for each i that `next` gives, at most `jobs` at once, started in order. `next`
/// gives nothing while there is nothing to start, and is called again whenever a piece has ended.
/// If it gives nothing and no piece is under way, all is done. `done` is called here in the parent
/// as pieces end, one at a time. No piece outlives this process. Throws std::runtime_error when a
/// process cannot be started, any exception of `done`, and Interrupted (processes.h) when all
/// pieces that have ended are done. It rethrows a SystemFault (files.h) of a piece. Pieces still
/// under way are killed then.
///
/// Sanitizers reserve the whole address space, so memory limits are not set under them.
void RunInProcesses(const std::function<std::optional<std::size_t>()>& next, int jobs,
                    const std::function<std::string(std::size_t)>& work,
                    const std::function<ProcessLimits(std::size_t)>& limits,
                    const std::function<void(std::size_t, const ProcessResult&)>& done,
                    const ProcessNews& news = {});

/// The same with work(0) .. work(count - 1).
void RunInProcesses(std::size_t count, int jobs,
                    const std::function<std::string(std::size_t)>& work,
                    const std::function<ProcessLimits(std::size_t)>& limits,
                    const std::function<void(std::size_t, const ProcessResult&)>& done,
                    const ProcessNews& news = {});

/// The outcome in tables of a piece that ended without an answer: "crashed", "process-time-limit"
/// or "memory-limit".
std::string_view OutcomeOf(ProcessEnding ending);

/// Whether memory limits are set in this build.
bool LimitsMemory();

// A command's work in a child process: what it prints comes out here, whatever becomes of it.

/// Runs `work` in a child process under `limits`. What it prints on standard output is printed here
/// when it has ended, complete lines also of work that was cut off. Returns its exit code; of work
/// that was cut off 2, after a line on standard error with `name` and the reason. What it throws is
/// thrown here, as std::runtime_error with its message.
int PrintFromChild(const std::string& name, const ProcessLimits& limits,
                   const std::function<int()>& work);

/// The same with what it prints in `text`.
int TextFromChild(const std::string& name, const ProcessLimits& limits,
                  const std::function<int()>& work, std::string* text);

// Short tasks that share processes: starting one costs more than many a case takes.
//
// How many tasks go into one process is measured as they run: about as many as keep it busy for a
// tenth of a second. Isolation is kept where it matters: a process that does not answer (crash,
// exception, limits) counts for nothing, and its tasks are run again, each in a process of its own,
// whose ending is then the task's.

struct SharedNews {
  std::function<void(std::size_t)> started = {};  ///< when a task is started first
  std::function<void()> waited = {};
};

/// A task that has ended.
struct TaskResult {
  std::size_t task = 0;
  ProcessResult result;
};

/// Runs work(0) .. work(count - 1) as RunInProcesses() does, tasks that follow each other together
/// in a process. A process has the least of its tasks' limits. `done` gets the tasks of a process
/// at once, in order.
/// @returns  how many processes there were
std::size_t RunInSharedProcesses(std::size_t count, int jobs,
                                 const std::function<std::string(std::size_t)>& work,
                                 const std::function<ProcessLimits(std::size_t)>& limits,
                                 const std::function<void(const std::vector<TaskResult>&)>& done,
                                 const SharedNews& news = {});

}  // namespace loopbench::harness
