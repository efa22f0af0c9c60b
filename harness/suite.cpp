#include "harness/suite.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <thread>

#include "harness/config/config_error.h"
#include "harness/progress.h"
#include "harness/run_case.h"
#include "harness/timing/time_cases.h"

namespace loopbench::harness {

namespace {

/// Steps grow with the horizon and with rtol^(-1/5); costly cases go first, so that none is left to
/// run alone at the end.
double Cost(const Case& one) { return one.ensemble * one.horizon * std::pow(one.rtol, -0.2); }

void RunAccuracy(const Experiment& experiment, std::vector<Case> cases, int jobs,
                 ResultStore& store) {
  std::ranges::stable_sort(cases, std::greater<>(), Cost);
  Progress progress("accuracy", cases.size());
  std::atomic<std::size_t> next = 0;
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < cases.size(); i = next++) {
        store.Append(RunCase(experiment, cases[i]));
        progress.Step(
            fmt::format("{} {} {}", cases[i].mechanism, ToString(cases[i].column), cases[i].rtol));
      }
    } catch (...) {
      const std::lock_guard lock(failure_mutex);
      failure = std::current_exception();
      next = cases.size();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int j = 0; j < jobs; ++j) threads.emplace_back(work);
  }
  if (failure) std::rethrow_exception(failure);
}

/// A condition on a key that cases do not have would silently match nothing.
[[noreturn]] void RejectKey(const std::string& key, const Record& keys) {
  std::string known;
  for (const auto& [name, value] : keys.items()) known += (known.empty() ? "" : ", ") + name;
  throw ConfigError(fmt::format("--filter {}: no such key; cases have {}", key, known));
}

}  // namespace

std::vector<Case> SelectCases(const Experiment& experiment, const Selection& filter) {
  std::vector<Case> cases;
  for (const Case& one : Expand(experiment)) {
    const Record keys = CaseKeys(experiment, one);
    for (const Condition& condition : filter) {
      if (keys.Find(condition.key) == nullptr) RejectKey(condition.key, keys);
    }
    if (Matches(keys, filter)) cases.push_back(one);
  }
  if (cases.empty()) {
    throw ConfigError(
        fmt::format("{}: no case matches {}", experiment.path.string(), ToText(filter)));
  }
  return cases;
}

void RunSuite(const Experiment& experiment, const SuiteOptions& options, ResultStore& store) {
  if (options.accuracy) {
    RunAccuracy(experiment, SelectCases(experiment, options.filter), options.jobs, store);
  }
  if (options.timing && CountTimings(experiment) > 0) {
    Progress progress("timing", CountTimings(experiment));
    TimeExperiment(experiment, [&](const Record& record) {
      store.Append(record);
      progress.Step(record.Text("mechanism"));
    });
  }
}

}  // namespace loopbench::harness
