// Child processes with limits: supervision, interruption, injected faults and output.
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

#include "harness/base/record.h"

namespace loopbench::harness {

// Supervision of a child process by its parent.
//
// Wall time is unsuitable as a limit: sixty-four pieces on two processors take thirty-two times as
// long, and suspend time must not count. A child is therefore limited by two clocks that do not
// depend on other work:
//   - its CPU time, which the kernel counts;
//   - its time asleep by itself. Computing work has no reason to sleep: it reads nothing, waits for
//     no process except programs such as a compiler (RunProgram), which do not count, and its
//     answer is read at once.
// Asleep is the kernel's state S. Time in other states without computing is ignored, because the
// machine causes it: ready without a processor (R), stopped or traced (T, t), waiting for a disk or
// swapped memory (D). Since the parent may be stopped too, a check adds at most the nominal time
// between two checks.

/// Time between two checks of a child [s].
inline constexpr double kLook_s = 0.25;

class ChildWatch {
 public:
  /// `pid` must be a child that has not been waited for.
  explicit ChildWatch(pid_t pid) : pid_(pid) {}

  /// Checks the child, unless the last check was less than kLook_s ago. `unread`: its answer is
  /// waiting to be read, which does not count as sleep.
  void Look(bool unread);

  /// Returns the CPU time used so far by all threads [s].
  double cpu_s() const;
  /// Returns the continuous time asleep since it last computed, as seen by the checks [s].
  double idle_s() const { return idle_s_; }

 private:
  using Clock = std::chrono::steady_clock;

  pid_t pid_;
  Clock::time_point looked_ = Clock::now();
  double cpu_before_ = 0.0;  ///< at the last check
  double idle_s_ = 0.0;
};

// Ctrl-C (SIGINT), SIGTERM and SIGHUP while child processes work: handled without immediate exit.

/// Error of RunInProcesses() when a signal requests the end of this process.
class Interrupted : public std::runtime_error {
 public:
  explicit Interrupted(int signal);
  int exit_code() const { return 128 + signal_; }  ///< shell convention: 130 for Ctrl-C

 private:
  int signal_;
};

/// Guard that stores the first of these signals, on which RunInProcesses() throws; a second one
/// ends this process at once. Signals ignored before (nohup) stay ignored. At most one instance.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// Throws Interrupted if there was a signal.
  static void Check();
  /// For a child process: the parent decides, since a terminal sends Ctrl-C to both.
  static void LeaveToParent();

 private:
  std::array<struct sigaction, 3> before_;
};

// Injected faults for tests of misbehaving cases.
//
// The environment variable LOOPBENCH_FAULT = "<fault>:<key>=<value>[,<value>]" makes every accuracy
// case that meets the condition crash, hang, exhaust memory, throw, or return invalid text. It is
// read only in the child process of the case.

/// Executes the fault of LOOPBENCH_FAULT for the case with these keys; may not return. Returns the
/// invalid text to send instead of the record, if any.
std::optional<std::string> PlantedFault(const Record& keys);

// Work in child processes: however a piece of work ends, the parent gets a result and continues.
//
// Each piece runs in a fork of this program under its own limits, and returns text through a pipe.
// A crash, a time or memory overrun, and silence are named endings. Time is CPU time: other work on
// the processor and pauses of the machine have no effect (processes.h).
// The caller must have a single thread: a fork copies only the calling thread.

enum class ProcessEnding {
  kAnswered,    ///< returned a text
  kThrew,       ///< an exception left the work; `text` is its message
  kCrashed,     ///< ended by a signal of its own, or left through exit()
  kKilled,      ///< ended twice by a signal that others send, such as SIGKILL
  kOverTime,    ///< killed after its CPU time or a long sleep
  kOverMemory,  ///< requested more memory than allowed
};

struct ProcessLimits {
  double cpu_s = 0.0;      ///< maximum CPU time [s]; 0: no limit
  double memory_mb = 0.0;  ///< address space beyond the parent's [MiB]; 0: no limit
  /// Maximum continuous time asleep [s]: computing work does not sleep at all.
  double idle_s = 5.0;
};

struct ProcessResult {
  ProcessEnding ending = ProcessEnding::kAnswered;
  std::string text;  ///< the answer, or the reason of the failure
  double wall_s = 0.0, cpu_s = 0.0;
};

/// Callbacks in the parent while pieces work.
struct ProcessNews {
  std::function<void(std::size_t)> started = {};
  std::function<void()> waited = {};  ///< at least four times a second
};

/// Runs work(i) for each i returned by `next`, at most `jobs` at once, started in order. `next`
/// returns nothing while there is nothing to start, and is called again after each ending. All is
/// done if it returns nothing and no piece is running. `done` is called in the parent as pieces
/// end, one at a time. No piece outlives this process. Throws std::runtime_error if a process
/// cannot be started, any exception of `done`, the SystemFault (text.h) of a piece, and
/// Interrupted (processes.h) after `done` for all ended pieces. Running pieces are then killed.
///
/// Sanitizers reserve the whole address space, so memory limits are not set with them.
void RunInProcesses(const std::function<std::optional<std::size_t>()>& next, int jobs,
                    const std::function<std::string(std::size_t)>& work,
                    const std::function<ProcessLimits(std::size_t)>& limits,
                    const std::function<void(std::size_t, const ProcessResult&)>& done,
                    const ProcessNews& news = {});

/// Runs work(0) .. work(count - 1) in the same way.
void RunInProcesses(std::size_t count, int jobs,
                    const std::function<std::string(std::size_t)>& work,
                    const std::function<ProcessLimits(std::size_t)>& limits,
                    const std::function<void(std::size_t, const ProcessResult&)>& done,
                    const ProcessNews& news = {});

/// Runs `work` alone in the same way.
ProcessResult RunInProcess(const ProcessLimits& limits, const std::function<std::string()>& work);

/// Returns the table outcome of a piece without an answer: "crashed", "process-time-limit" or
/// "memory-limit".
std::string_view OutcomeOf(ProcessEnding ending);

/// Returns true if memory limits are set in this build.
bool LimitsMemory();

// Work of a command in a child process; the parent prints its output, however it ends.

/// Runs `work` in a child process under `limits`, then prints its standard output; after a limit or
/// crash, only complete lines. Returns its exit code. After a limit or crash returns 2 and prints
/// `name` and the reason on standard error. Exceptions are rethrown as std::runtime_error with
/// their message.
int PrintFromChild(const std::string& name, const ProcessLimits& limits,
                   const std::function<int()>& work);

/// Runs `work` as above, but stores its output in `text`.
int TextFromChild(const std::string& name, const ProcessLimits& limits,
                  const std::function<int()>& work, std::string* text);

// Short tasks share processes, because starting a process costs more than many a case.
//
// The number of tasks per process follows from their measured times: enough for a tenth of a
// second, or as many as share their work. Isolation is kept: results of a failed process (crash,
// exception, limits) are discarded. Its tasks run again, each in its own process, which determines
// the ending of the task.

struct SharedNews {
  /// Returns the number of tasks from one on that share their work, and therefore a process.
  std::function<std::size_t(std::size_t)> together = [](std::size_t) { return std::size_t{1}; };
  std::function<void(std::size_t)> started = {};  ///< at the first start of a task
  std::function<void()> waited = {};
};

/// A finished task.
struct TaskResult {
  std::size_t task = 0;
  ProcessResult result;
};

/// Runs tasks 0 .. count - 1 as RunInProcesses(), with consecutive ones sharing a process: `work`
/// returns their texts in order. A process has the lowest limits of its tasks, once for each that
/// shares its work. `done` receives all tasks of a process at once, in order, each with
/// an equal share of its time.
/// @returns  number of processes
std::size_t RunInSharedProcesses(
    std::size_t count, int jobs,
    const std::function<std::vector<std::string>(const std::vector<std::size_t>&)>& work,
    const std::function<ProcessLimits(std::size_t)>& limits,
    const std::function<void(const std::vector<TaskResult>&)>& done, const SharedNews& news = {});

}  // namespace loopbench::harness
