// loopbench_count: exact costs of right-hand sides, independent of the machine's load.
//
// Operations, allocations and hashes are counted here; instructions by Callgrind, which runs this
// program and dumps its counters each time CountedEvaluations returns: one file per case, in their
// order. A second run of this program reads them into the records (tools/baseline).

#include <CLI/CLI.hpp>

#include "harness/base/numeric_option.h"
#include "harness/base/text.h"
#include "harness/run/timing.h"

namespace loopbench::harness {

/// Set to false by an evaluation that fails.
bool all_finished = true;

/// Callgrind finds this function by its name (--toggle-collect, --dump-after).
extern "C" [[gnu::noinline]] void CountedEvaluations(BenchmarkSubject* subject, int evaluations) {
  for (int i = 0; i < evaluations; ++i) {
    if (subject->Derivative() != Outcome::kFinished) all_finished = false;
  }
}

namespace {

constexpr const char* kFooter = R"(
Examples:
  loopbench_count configs/benchmarks/counts.json --out counts.jsonl
  valgrind --tool=callgrind --callgrind-out-file=cg --toggle-collect=CountedEvaluations
    --dump-after=CountedEvaluations loopbench_count configs/benchmarks/counts.json
  loopbench_count configs/benchmarks/counts.json --callgrind cg --out counts.jsonl

Only right-hand sides ("measure": "rhs") are counted. Exit status: 0 success; 2 could not measure.)";

struct Options {
  std::filesystem::path file, callgrind, out;
  int evaluations = 20;  ///< enough to make extra work of a first evaluation negligible
  int planted = 0;
};

Record CountCase(const BenchmarkMember& member, const Method& method, const BenchmarkSet& set,
                 const Options& options) {
  if (method.threads > 1) {
    throw std::runtime_error(
        fmt::format("{} {}: instructions are those of one thread", member.name, ToString(method)));
  }
  const MechanismDescription description = member.Make();
  const BenchmarkState state = ComputeState(description, method.coordinates);
  Record record;
  record.Set("kind", std::string("counts"));
  record.Set("experiment", set.name);
  record.Set("mechanism", member.name);
  record.Set("formulation", method.formulation);
  record.Set("enforcement", std::string(ToString(method.enforcement)));
  record.Set("coordinates", std::string(ToString(method.coordinates)));
  record.Set("solver", std::string(ToString(method.solver)));
  const auto subject = MakeSubject(description, method, state, set.integrator, set.step);
  all_finished = true;
  // the first evaluations take memory that later ones reuse
  for (int i = 0; i < 2; ++i) {
    if (subject->Derivative() != Outcome::kFinished) all_finished = false;
  }
  const Allocations before = AllocationsSoFar();
  CountedEvaluations(subject.get(), options.evaluations + options.planted);
  const Allocations after = AllocationsSoFar();
  if (!all_finished) {
    throw std::runtime_error(
        fmt::format("{} {}: the right-hand side fails", member.name, ToString(method)));
  }
  record.Set("outcome", std::string("finished"));
  record.Set("evaluations", std::int64_t{options.evaluations});
  record.Set("bodies", std::int64_t{subject->bodies()});
  record.Set("rank", std::int64_t{subject->rank()});
  record.Set("start_hash", state.hash);
  record.Set("derivative_hash", HashExact(subject->derivative()));
  record.Set("allocations", (after.count - before.count) / options.evaluations);
  record.Set("bytes", (after.bytes - before.bytes) / options.evaluations);
  if (subject->operations() >= 0) record.Set("rhs_operations", subject->operations());
  return record;
}

int Count(const Options& options) {
  const BenchmarkSet set = ReadBenchmarks(options.file);
  std::string lines;
  int part = 0;
  for (const BenchmarkGroup& group : set.groups) {
    if (std::ranges::count(group.kinds, BenchmarkKind::kRhs) == 0) continue;
    for (const BenchmarkMember& member : group.members) {
      for (const Method& method : group.methods) {
        Record record = CountCase(member, method, set, options);
        ++part;
        if (!options.callgrind.empty()) {
          const std::string file = fmt::format("{}.{}", options.callgrind.string(), part);
          record.Set("instructions",
                     CallgrindInstructions(ReadFile(file), file) / options.evaluations);
        }
        Stamp(record);
        lines += ToJsonLine(record) + "\n";
      }
    }
  }
  if (!options.out.empty()) WriteFileAtomically(options.out, lines);
  Print("{}\n", WithCount(part, "case"));
  return part == 0 ? 2 : 0;
}

int Main(int argc, char** argv) {
  Options options;
  CLI::App app{"Counts operations, allocations and instructions of right-hand sides.",
               "loopbench_count"};
  app.footer(kFooter);
  app.add_option("file", options.file, "What is counted (as for loopbench_bench)")->required();
  app.add_option("--out", options.out, "File of records (.jsonl)");
  app.add_option("--callgrind", options.callgrind,
                 "Files of Callgrind to take instructions from, without .1, .2, ...");
  app.add_option("--evaluations", options.evaluations, "Per case")
      ->check(NumberFrom(1, 1'000'000))
      ->capture_default_str();
  app.add_option("--planted", options.planted,
                 "More evaluations than are reported: the gate's own test must catch them")
      ->check(NumberFrom(0, 1'000'000));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    return Count(options);
  } catch (const std::exception& error) {
    PrintError("{}\n", Lines{error.what()});
    return 2;
  }
}

}  // namespace
}  // namespace loopbench::harness

int main(int argc, char** argv) {
  loopbench::harness::PrepareStreams();
  return loopbench::harness::FinishOutput(loopbench::harness::Main(argc, argv));
}
