// loopbench_bench: right-hand sides and integrator steps under Google Benchmark.
//
// A JSON file defines the measurements; they are registered at run time. The library's JSON writer
// prints NaN, which JSON readers reject: runs pass through SafeReporter first.
#include <benchmark/benchmark.h>

#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "harness/base/text.h"
#include "harness/run/timing.h"

namespace {

using namespace loopbench;
using namespace loopbench::harness;

constexpr const char* kHelp =
    R"(loopbench_bench: time, allocations and bytes of right-hand sides and integrator steps.

  --families FILE   what is measured (JSON); default configs/benchmarks/default.json
  --save-states     compute the states of FILE and save their hashes, measure nothing

All options of Google Benchmark 1.7 hold, among them
  --benchmark_filter=REGEX --benchmark_list_tests --benchmark_min_time=0.1
  --benchmark_repetitions=9 --benchmark_out=FILE --benchmark_format=json

Examples:
  loopbench_bench --benchmark_filter='rhs/chain/.*/odca/acceleration'
  loopbench_bench --benchmark_repetitions=9 --benchmark_out=new.json
  loopbench fit-scaling new.json
  loopbench compare base.json new.json

Names are MEASURE/MECHANISM[/SIZE]/FORMULATION/LEVEL/COORDINATES/SOLVER[/N-threads]. Times are of the
processor, with several threads by the clock. A benchmark that cannot be measured is an error with
its reason, without counters.
Exit status: 0 success; 2 invalid input, or nothing could be measured.
)";

/// Omits values that JSON cannot represent, such as the spread of a counter that is always zero.
class SafeReporter final : public benchmark::JSONReporter {
 public:
  void Finalize() override {
    JSONReporter::Finalize();
    is_written_ = GetOutputStream().flush().good();
  }
  bool is_written() const { return is_written_; }

  void ReportRuns(const std::vector<Run>& runs) override {
    std::vector<Run> finite = runs;
    for (Run& run : finite) {
      std::erase_if(run.counters,
                    [](const auto& named) { return !std::isfinite(named.second.value); });
    }
    JSONReporter::ReportRuns(finite);
  }

 private:
  bool is_written_ = true;
};

#ifdef NDEBUG
constexpr const char* kAssertions = "off";
#else
constexpr const char* kAssertions = "on (the preset native builds without)";
#endif

/// The reporter of a terminal, without the library's warning that it was "built as DEBUG" and
/// "timings may be affected". Debian builds it without NDEBUG, but that code is not timed: the loop
/// over iterations is a header, compiled with this program's flags. The context lists these flags
/// in the lines "assertions" and "flags".
class PlainReporter final : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context& context) override {
    std::ostringstream said;
    reporter_->SetErrorStream(&said);
    const bool go_on = reporter_->ReportContext(context);
    reporter_->SetErrorStream(&GetErrorStream());
    std::string text = said.str();
    const std::string_view warning =
        "***WARNING*** Library was built as DEBUG. Timings may be affected.\n";
    if (const std::size_t at = text.find(warning); at != std::string::npos)
      text.erase(at, warning.size());
    GetErrorStream() << text;
    return go_on;
  }
  void ReportRuns(const std::vector<Run>& runs) override { reporter_->ReportRuns(runs); }
  void Finalize() override { reporter_->Finalize(); }

 private:
  std::unique_ptr<benchmark::BenchmarkReporter> reporter_{
      benchmark::CreateDefaultDisplayReporter()};
};

/// The states of a set, each computed once.
class States {
 public:
  explicit States(StateHashes saved) : saved_(std::move(saved)) {}

  /// Throws std::runtime_error when the state is not the saved one.
  const BenchmarkState& Get(const BenchmarkMember& member, const MechanismDescription& description,
                            Coordinates coordinates) {
    const std::string name = fmt::format("{}/{}", member.name, ToString(coordinates));
    const auto [at, is_new] = computed_.try_emplace(name);
    if (is_new) at->second = ComputeState(description, coordinates);
    const auto saved = saved_.find(name);
    if (saved != saved_.end() && saved->second != at->second.hash) {
      throw std::runtime_error(
          fmt::format("state {} has hash {}, saved is {}", name, at->second.hash, saved->second));
    }
    return at->second;
  }

  StateHashes hashes() const {
    StateHashes hashes;
    for (const auto& [name, state] : computed_) {
      if (!state.hash.empty()) hashes[name] = state.hash;
    }
    return hashes;
  }

 private:
  StateHashes saved_;
  std::map<std::string, BenchmarkState> computed_;
};

/// The library calls a benchmark several times; the last one's subject is kept.
struct Fixture {
  std::string name, hash;
  std::unique_ptr<BenchmarkSubject> subject;
};

/// Sets a counter, unless it is not a number.
void Count(benchmark::State& state, const char* name, double value) {
  if (std::isfinite(value)) state.counters[name] = value;
}

/// Returns processor time, or wall time with several threads.
double Nanoseconds(const Method& method) {
  timespec now{};
  clock_gettime(method.threads > 1 ? CLOCK_MONOTONIC : CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

void Measure(benchmark::State& state, BenchmarkSubject& subject, BenchmarkKind kind,
             const Method& method) {
  const auto once = [&] {
    return kind == BenchmarkKind::kRhs ? subject.Derivative() : subject.Step();
  };
  // the first evaluation takes memory that later ones reuse
  Outcome outcome = once();
  if (outcome == Outcome::kFinished) outcome = once();
  if (outcome != Outcome::kFinished) {
    state.SkipWithError(std::string(ToString(outcome)).c_str());
    return;
  }
  const double calibration = CalibrationNs();
  const Allocations before = AllocationsSoFar();
  const double begin = Nanoseconds(method);
  for (auto _ : state) {
    outcome = once();
    benchmark::DoNotOptimize(outcome);
  }
  const double spent = Nanoseconds(method) - begin;
  const Allocations after = AllocationsSoFar();
  const double evaluations = static_cast<double>(state.iterations());
  const double bodies = subject.bodies();
  Count(state, "bodies", bodies);
  Count(state, "calibration_ns", std::max(calibration, CalibrationNs()));
  // not a rate of the library: it would print nanoseconds with the unit of seconds
  Count(state, "ns_per_body", spent / evaluations / bodies);
  Count(state, "allocations", static_cast<double>(after.count - before.count) / evaluations);
  Count(state, "bytes", static_cast<double>(after.bytes - before.bytes) / evaluations);
  if (kind == BenchmarkKind::kRhs && subject.operations() >= 0) {
    Count(state, "rhs_operations", static_cast<double>(subject.operations()));
  }
}

void Register(const BenchmarkSet& set, States& states, const BenchmarkMember& member,
              BenchmarkKind kind, const Method& method) {
  const std::string name = BenchmarkName(kind, member, method);
  const auto run = [&set, &states, &member, kind, method, name](benchmark::State& state) {
    static Fixture last;
    try {
      if (last.name != name) {
        last = {};
        const MechanismDescription description = member.Make();
        const BenchmarkState& at = states.Get(member, description, method.coordinates);
        last.subject = MakeSubject(description, method, at, set.integrator, set.step);
        last.hash = at.hash;
        last.name = name;
      }
      state.SetLabel(last.hash);
      Measure(state, *last.subject, kind, method);
    } catch (const std::exception& error) {
      state.SkipWithError(EscapeTerminal(error.what()).c_str());
    }
  };
  // the library prints names as they are, and up to a zero byte
  benchmark::RegisterBenchmark(EscapeTerminal(name).c_str(), run);
}

int SaveStates(const BenchmarkSet& set) {
  if (set.states_path.empty()) {
    PrintError("{}: no \"states\": it does not name a file to save them in\n", set.path.string());
    return 2;
  }
  States states({});
  for (const BenchmarkGroup& group : set.groups) {
    for (const BenchmarkMember& member : group.members) {
      const MechanismDescription description = member.Make();
      for (const Method& method : group.methods) {
        const BenchmarkState& state = states.Get(member, description, method.coordinates);
        if (state.outcome == Outcome::kFinished) continue;
        PrintError("{}: no state: {} {}\n", member.name, ToString(state.outcome), state.message);
        return 2;
      }
    }
  }
  WriteFileAtomically(set.states_path, StatesToJson(states.hashes()));
  Print("wrote {} hashes to {}\n", states.hashes().size(), set.states_path.string());
  return 0;
}

/// The value of our option `--name VALUE` or `--name=VALUE`, taken out of the arguments.
std::optional<std::string> TakeOption(std::vector<char*>& arguments, const std::string& name) {
  for (auto at = arguments.begin() + 1; at != arguments.end(); ++at) {
    const std::string word = *at;
    if (word.rfind(name + "=", 0) == 0) {
      arguments.erase(at);
      return word.substr(name.size() + 1);
    }
    if (word != name) continue;
    if (at + 1 == arguments.end()) throw std::runtime_error(name + ": expected a file after it");
    std::string value = *(at + 1);
    arguments.erase(at, at + 2);
    return value;
  }
  return std::nullopt;
}

bool TakeFlag(std::vector<char*>& arguments, const std::string& name) {
  return std::erase_if(arguments, [&](const char* word) { return name == word; }) > 0;
}

/// Returns the library's value of a string option, from the arguments or the environment.
std::string LibraryOption(const std::vector<char*>& arguments, const std::string& name) {
  std::string variable;
  for (const char c : name) variable += static_cast<char>(std::toupper(c));
  const char* set = std::getenv(variable.c_str());
  std::string value = set == nullptr ? "" : set;
  for (const std::string word : arguments) {
    if (word.rfind("--" + name + "=", 0) == 0) value = word.substr(name.size() + 3);
  }
  return value;
}

/// The library takes "nan" and "inf" for times, and then does not end.
void RequireSeconds(const std::vector<char*>& arguments, const std::string& name) {
  const std::string text = LibraryOption(arguments, name);
  if (text.empty()) return;
  constexpr double kLongest = 1e6;
  const auto seconds = WholeNumber<double>(text);
  if (seconds && *seconds >= 0.0 && *seconds <= kLongest) return;
  throw std::runtime_error(
      fmt::format("--{}: found \"{}\", expected seconds from 0 to {}", name, text, kLongest));
}

int Measured(int argc, char** argv) {
  std::vector<char*> arguments(argv, argv + argc);
  if (TakeFlag(arguments, "--help") || TakeFlag(arguments, "-h")) {
    PrintText(kHelp);
    return 0;
  }
  const std::string file = TakeOption(arguments, "--families")
                               .value_or(LOOPBENCH_SOURCE_DIR "/configs/benchmarks/default.json");
  const bool save = TakeFlag(arguments, "--save-states");
  const std::string out_format = LibraryOption(arguments, "benchmark_out_format");
  const std::string out = LibraryOption(arguments, "benchmark_out");
  // the library would leave with 1
  if (!out.empty() && !std::ofstream(out, std::ios::app)) FailOn("write", out);
  const bool json_to_file = !out.empty() && (out_format.empty() || out_format == "json");
  const bool json_to_terminal = LibraryOption(arguments, "benchmark_format") == "json";
  RequireSeconds(arguments, "benchmark_min_time");
  RequireSeconds(arguments, "benchmark_min_warmup_time");
  int count = static_cast<int>(arguments.size());
  arguments.push_back(nullptr);
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) return 2;

  const BenchmarkSet set = ReadBenchmarks(file);
  if (save) return SaveStates(set);
  States states(set.states);
  for (const BenchmarkGroup& group : set.groups) {
    for (const BenchmarkMember& member : group.members) {
      for (const BenchmarkKind kind : group.kinds) {
        for (const Method& method : group.methods) Register(set, states, member, kind, method);
      }
    }
  }
  const Origin& origin = ThisOrigin();
  benchmark::AddCustomContext("command", CommandLine(argc, argv));
  benchmark::AddCustomContext("machine", origin.machine);
  benchmark::AddCustomContext("compiler", origin.compiler);
  benchmark::AddCustomContext("flags", origin.flags);
  benchmark::AddCustomContext("assertions", kAssertions);
  benchmark::AddCustomContext("libm", origin.libm);
  benchmark::AddCustomContext("commit", origin.commit);
  SafeReporter to_terminal, to_file;
  PlainReporter plain;
  benchmark::BenchmarkReporter* const display =
      json_to_terminal ? static_cast<benchmark::BenchmarkReporter*>(&to_terminal) : &plain;
  const std::size_t measured =
      benchmark::RunSpecifiedBenchmarks(display, json_to_file ? &to_file : nullptr);
  benchmark::Shutdown();
  if (!to_file.is_written()) throw std::runtime_error(fmt::format("cannot write '{}'", out));
  return measured == 0 ? 2 : 0;
}

int Main(int argc, char** argv) {
  try {
    CheckAllocationsAreCounted();
    return Measured(argc, argv);
  } catch (const std::exception& error) {
    PrintError("{}\n", Lines{error.what()});
    return 2;
  }
}

}  // namespace

int main(int argc, char** argv) {
  PrepareStreams();
  return FinishOutput(Main(argc, argv));
}
