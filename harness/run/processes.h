// Child processes with limits: supervision, interruption, injected faults and output.
#pragma once

#include <array>
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

// Ctrl-C (SIGINT), SIGTERM and SIGHUP while child processes work: handled without immediate exit.

/// Error of RunInProcesses() when a signal requests the end of this process.
class Interrupted : public std::runtime_error {
 public:
  explicit Interrupted(int signal) : std::runtime_error("interrupted"), signal_(signal) {}
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

 private:
  std::array<struct sigaction, 3> before_;
};

/// For tests of misbehaving cases: executes the fault of the environment variable LOOPBENCH_FAULT =
/// "<fault>:<key>=<value>[,<value>]" in the child process of an accuracy case with these keys. The
/// faults are crash, hang, memory, throw and garbage. Returns the invalid text to send instead of
/// the record, if any.
std::optional<std::string> PlantedFault(const Record& keys);

// Work in child processes: however a piece of work ends, the parent gets a result and continues.
//
// Each piece runs in a fork of this program under its own limits, and returns text through a pipe.
// A crash, a time or memory overrun, and silence are named endings. Two clocks limit a child: its
// CPU time, and its time asleep (kernel state S) while it runs no other program. Neither depends on
// other work or on pauses of the machine. Computing work has no reason to sleep.
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
  double idle_s = 5.0;     ///< maximum continuous time asleep [s]
};

struct ProcessResult {
  ProcessEnding ending = ProcessEnding::kAnswered;
  std::string text;  ///< the answer, or the reason of the failure
  double wall_s = 0.0, cpu_s = 0.0;
};

/// Callbacks in the parent while pieces work.
struct ProcessNews {
  std::function<void(std::size_t)> started = {};  ///< at the first start of a piece
  std::function<void()> waited = {};              ///< at least four times a second
};

/// Runs work(0) .. work(count - 1), at most `jobs` at once, started in order. `done` is called in
/// the parent as pieces end, one at a time. No piece outlives this process. Throws
/// std::runtime_error if a process cannot be started, any exception of `done`, the SystemFault
/// (text.h) of a piece, and Interrupted after `done` for all ended pieces. Running pieces are then
/// killed.
///
/// Sanitizers reserve the whole address space, so memory limits are not set with them.
void RunInProcesses(std::size_t count, int jobs,
                    const std::function<std::string(std::size_t)>& work,
                    const std::function<ProcessLimits(std::size_t)>& limits,
                    const std::function<void(std::size_t, const ProcessResult&)>& done,
                    const ProcessNews& news = {});

/// Runs `work` alone in the same way.
ProcessResult RunInProcess(const ProcessLimits& limits, const std::function<std::string()>& work);

/// Returns the outcome without an answer: "crashed", "process-time-limit" or "memory-limit".
std::string_view OutcomeOf(ProcessEnding ending);

/// Returns true if memory limits are set in this build.
bool LimitsMemory();

/// Runs `work` in a child process under `limits`, then prints its standard output; after a limit or
/// crash, only complete lines. Returns its exit code. After a limit or crash returns 2 and prints
/// `name` and the reason on standard error. Exceptions are rethrown as std::runtime_error with
/// their message.
int PrintFromChild(const std::string& name, const ProcessLimits& limits,
                   const std::function<int()>& work);

/// Runs `work` as above, but stores its output in `text`.
int TextFromChild(const std::string& name, const ProcessLimits& limits,
                  const std::function<int()>& work, std::string* text);

/// A finished task.
struct TaskResult {
  std::size_t task = 0;
  ProcessResult result;
};

/// Processes of tasks.
struct Sharing {
  bool is_allowed = true;  ///< false: each task has its own process
  /// Returns the number of tasks from one on that share their work, and therefore a process.
  std::function<std::size_t(std::size_t)> together = [](std::size_t) { return std::size_t{1}; };
};

/// Runs tasks 0 .. count - 1 as RunInProcesses(), with consecutive short ones sharing a process,
/// because starting one costs more than many a case. `work` returns their texts in order. Measured
/// times decide the number of tasks: enough for a tenth of a second, or as many as share their
/// work. A process has the lowest limits of its tasks, once for each that shares its work. `done`
/// receives all tasks of a process at once, in order, each with an equal share of its time. Results
/// of a failed process are discarded: its tasks run again, each in its own process.
/// @returns  number of processes
std::size_t RunInSharedProcesses(
    std::size_t count, int jobs,
    const std::function<std::vector<std::string>(const std::vector<std::size_t>&)>& work,
    const std::function<ProcessLimits(std::size_t)>& limits,
    const std::function<void(const std::vector<TaskResult>&)>& done, const Sharing& sharing = {},
    const ProcessNews& news = {});

}  // namespace loopbench::harness
