// loopbench_bench: right-hand sides under Google Benchmark, with an allocation counter.
//
// Families: every column of the paper's experiment on its scenes, and closed chains and ladders of
// 3 to 1000 bars (the dense baselines to 100). Counters: ns_per_body, allocations per evaluation.
// The benchmark library of Debian 12 calls itself a debug build; the context line "build" tells
// what this one is.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <atomic>
#include <cstdlib>

#include "harness/config/experiment_reader.h"
#include "harness/provenance.h"
#include "harness/run_case.h"
#include "mechanism/assembly.h"
#include "mechanism/library.h"

namespace {

std::atomic<long> allocations = 0;

}  // namespace

// glibc's own entry point, so that every allocation of the process passes the counter.
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}

namespace {

using namespace loopbench;
using namespace loopbench::harness;

/// One right-hand side, from the scene's own start given a little time to move.
void TimeDerivative(benchmark::State& state, const MechanismDescription& description,
                    const Column& column) {
  const Mechanism<Planar, double> mechanism(description, column.coordinates);
  const Start<double> start = Assemble<Planar>(description, mechanism);
  const auto formulation = MakeFormulation<Planar>(column, mechanism);
  std::vector<double> y, ydot;
  Outcome outcome = start.outcome;
  if (outcome == Outcome::kFinished) {
    formulation->Start(start.q, start.u);
    y.resize(formulation->state_size());
    ydot = y;
    formulation->ToState(start.q, start.u, y);
    // a few small Euler steps: speeds that are not zero tickle the relevant paths
    for (int i = 0; i < 10 && outcome == Outcome::kFinished; ++i) {
      outcome = formulation->Derivative(0.0, y, ydot);
      for (std::size_t k = 0; k < y.size(); ++k) y[k] += 1e-3 * ydot[k];
    }
  }
  if (outcome != Outcome::kFinished) {
    state.SkipWithError(std::string(ToString(outcome)).c_str());
    return;
  }
  const long before = allocations;
  for (auto _ : state) {
    formulation->Derivative(0.0, y, ydot);
    benchmark::DoNotOptimize(ydot.data());
  }
  const double evaluations = static_cast<double>(state.iterations());
  state.counters["allocations"] = static_cast<double>(allocations - before) / evaluations;
  // a time per body: the inverse of a rate of bodies
  state.counters["per_body"] =
      benchmark::Counter(mechanism.num_bodies() - 1, benchmark::Counter::kIsIterationInvariantRate |
                                                         benchmark::Counter::kInvert);
}

void Register(const std::string& name, const MechanismDescription& description,
              const Column& column) {
  benchmark::RegisterBenchmark(fmt::format("rhs/{}/{}", name, ToString(column)).c_str(),
                               [description, column](benchmark::State& state) {
                                 TimeDerivative(state, description, column);
                               });
}

}  // namespace

int main(int argc, char** argv) {
  const Experiment paper =
      ReadExperiment(LOOPBENCH_SOURCE_DIR "/configs/experiments/paper/paper.json");
  for (const ExperimentScene& scene : paper.scenes) {
    for (const Column& column : paper.columns) {
      Register(scene.name, scene.mechanism.description, column);
    }
  }
  for (const int bars : {3, 10, 30, 100, 300, 1000}) {
    // a ladder of N windows has 2 N + 1 bars
    MechanismDescription chain = Chain(bars);
    chain.initial.speeds.push_back({0, {1.0}});
    for (const MechanismDescription& family : {chain, Ladder((bars - 1) / 2, -1.0, 0.5)}) {
      for (const Column& column : paper.columns) {
        // a dense baseline of 1000 bars takes seconds for one evaluation
        if (column.formulation != FormulationKind::kOdca && bars > 100) continue;
        Register(family.name, family, column);
      }
    }
  }
  for (const std::string& line : Provenance(CommandLine(argc, argv))) {
    const std::size_t colon = line.find(": ");
    benchmark::AddCustomContext(line.substr(0, colon), line.substr(colon + 2));
  }
  benchmark::AddCustomContext("build", "Release");
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
