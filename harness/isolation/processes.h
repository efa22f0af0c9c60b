// Work in child processes: whatever a piece of work does, the parent gets an answer and goes on.
//
// Each piece runs in a fork of this program, under limits of its own, and answers with text through
// a pipe. A crash, an overrun of time or memory, or silence is an ending with a name. Time is CPU
// time: neither other work on the processor nor a pause of the machine decides anything
// (child_watch.h).
// The caller must have a single thread: a fork copies only the thread that calls it.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace loopbench::harness {

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
/// process cannot be started, any exception of `done`, and Interrupted (interruption.h) when all
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

}  // namespace loopbench::harness
