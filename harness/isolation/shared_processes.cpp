#include "harness/isolation/shared_processes.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <deque>

#include "harness/integrator/cpu_time.h"

namespace loopbench::harness {
namespace {

constexpr double kBusy_s = 0.1;     ///< of a process: starting it (some 5 ms) is then little
constexpr std::size_t kMost = 500;  ///< tasks in one process: what a crash costs again
constexpr std::size_t kGrowth = 4;  ///< from one process to the next, while times are a guess
constexpr std::size_t kLongestHead = 100;  ///< of an answer: three numbers

double WallSecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// "LENGTH CPU_S WALL_S\n" and the answer, for each task.
std::string AnswersOf(const std::vector<std::size_t>& tasks,
                      const std::function<std::string(std::size_t)>& work) {
  std::string answers;
  for (const std::size_t task : tasks) {
    const auto begin = std::chrono::steady_clock::now();
    const double cpu_s = ThreadCpuSeconds();
    const std::string answer = work(task);
    answers += fmt::format("{} {} {}\n", answer.size(), ThreadCpuSeconds() - cpu_s,
                           WallSecondsSince(begin));
    answers += answer;
  }
  return answers;
}

/// Empty unless there is an answer to every task.
std::vector<TaskResult> ReadAnswers(const std::vector<std::size_t>& tasks,
                                    const std::string& text) {
  std::vector<TaskResult> results;
  std::size_t at = 0;
  for (const std::size_t task : tasks) {
    TaskResult one = {.task = task, .result = {}};
    std::size_t length = 0;
    int head = 0;
    const std::string begin = at < text.size() ? text.substr(at, kLongestHead) : "";
    if (std::sscanf(begin.c_str(), "%zu %lf %lf%n", &length, &one.result.cpu_s, &one.result.wall_s,
                    &head) != 3) {
      return {};
    }
    at += static_cast<std::size_t>(head) + 1;
    if (at > text.size() || length > text.size() - at) return {};
    one.result.text = text.substr(at, length);
    at += length;
    results.push_back(std::move(one));
  }
  return at == text.size() ? results : std::vector<TaskResult>();
}

/// Which tasks go into the next process.
class Batches {
 public:
  Batches(std::size_t count, int jobs) : count_(count), jobs_(static_cast<std::size_t>(jobs)) {}

  /// Nothing when all are under way or done.
  std::vector<std::size_t> Next() {
    if (!alone_.empty()) {
      const std::size_t task = alone_.front();
      alone_.pop_front();
      return {task};
    }
    // so that the last processes end together
    const std::size_t fair = std::max<std::size_t>(1, (count_ - next_) / (2 * jobs_));
    const std::size_t size = std::min({size_, fair, count_ - next_});
    std::vector<std::size_t> tasks(size);
    for (std::size_t& task : tasks) task = next_++;
    return tasks;
  }

  void Answered(std::size_t tasks, double cpu_s) {
    const double each_s = std::max(cpu_s / static_cast<double>(tasks), 1e-6);
    const auto fitting = static_cast<std::size_t>(kBusy_s / each_s);
    size_ = std::clamp<std::size_t>(fitting, 1, std::min(kMost, kGrowth * size_));
  }

  void RunAlone(const std::vector<std::size_t>& tasks) {
    alone_.insert(alone_.end(), tasks.begin(), tasks.end());
    size_ = 1;
  }

 private:
  std::size_t count_, jobs_, next_ = 0, size_ = 1;
  std::deque<std::size_t> alone_;  ///< whose process did not answer
};

}  // namespace

std::size_t RunInSharedProcesses(std::size_t count, int jobs,
                                 const std::function<std::string(std::size_t)>& work,
                                 const std::function<ProcessLimits(std::size_t)>& limits,
                                 const std::function<void(const std::vector<TaskResult>&)>& done,
                                 const SharedNews& news) {
  Batches batches(count, jobs);
  std::deque<std::vector<std::size_t>> processes;  // by number; those that ended are empty
  std::size_t begun = 0;  // tasks are started in order, but for a second time
  const auto next = [&]() -> std::optional<std::size_t> {
    std::vector<std::size_t> tasks = batches.Next();
    if (tasks.empty()) return std::nullopt;
    processes.push_back(std::move(tasks));
    return processes.size() - 1;
  };
  const auto limits_of = [&](std::size_t process) {
    ProcessLimits least = limits(processes[process].front());
    for (const std::size_t task : processes[process]) {
      const ProcessLimits own = limits(task);
      const auto lower = [](double a, double b) {
        return a > 0.0 && b > 0.0 ? std::min(a, b) : a + b;
      };
      least = {lower(least.cpu_s, own.cpu_s), lower(least.memory_mb, own.memory_mb),
               std::min(least.idle_s, own.idle_s)};
    }
    return least;
  };
  const auto ended = [&](std::size_t process, const ProcessResult& result) {
    const std::vector<std::size_t> tasks = std::move(processes[process]);
    processes[process].clear();
    if (tasks.size() == 1 && result.ending != ProcessEnding::kAnswered) {
      done({{tasks.front(), result}});
      return;
    }
    std::vector<TaskResult> results;
    if (result.ending == ProcessEnding::kAnswered) results = ReadAnswers(tasks, result.text);
    if (results.empty() && tasks.size() > 1) {
      batches.RunAlone(tasks);
      return;
    }
    if (results.empty())
      results = {{tasks.front(), result}};  // who reads it will say what is wrong
    batches.Answered(tasks.size(), result.cpu_s);
    done(results);
  };
  RunInProcesses(next, jobs,
                 [&](std::size_t process) { return AnswersOf(processes[process], work); },
                 limits_of, ended,
                 {.started =
                      [&](std::size_t process) {
                        if (!news.started) return;
                        for (const std::size_t task : processes[process]) {
                          if (task < begun) continue;
                          begun = task + 1;
                          news.started(task);
                        }
                      },
                  .waited = news.waited});
  return processes.size();
}

}  // namespace loopbench::harness
