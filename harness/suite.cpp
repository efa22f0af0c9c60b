#include "harness/suite.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <thread>

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

}  // namespace

std::vector<Case> SelectCases(const Experiment& experiment, const Selection& filter) {
  std::vector<Case> cases;
  for (const Case& one : Expand(experiment)) {
    if (Matches(CaseKeys(experiment, one), filter)) cases.push_back(one);
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
