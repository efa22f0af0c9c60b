// Short tasks that share processes: starting one costs more than many a case takes.
//
// How many tasks go into one process is measured as they run: about as many as keep it busy for a
// tenth of a second. Isolation is kept where it matters: a process that does not answer (crash,
// exception, limits) counts for nothing, and its tasks are run again, each in a process of its own,
// whose ending is then the task's.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "harness/isolation/processes.h"

namespace loopbench::harness {

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
