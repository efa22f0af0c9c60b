#include "harness/cli/program_baseline.h"

#include "harness/text/numeric_option.h"

namespace loopbench::harness {

namespace {

constexpr const char* kBaselineFooter = R"(
renew     measures and replaces DIR/results.jsonl: commit it, with the reason
check     measures and compares with DIR, as loopbench compare does
selftest  measures, plants changes of values (3 times the drift, a step more, a lost case, ...) and says
          whether a check would catch each

Outcomes and counts are compared wherever the baseline was made; what depends on round-off (hashes,
steps, instructions) only under its compiler, flags and mathematical library. Times are left out: they
belong to one machine (loopbench history).

Examples:
  loopbench baseline renew --experiments bench/arm.json --dir bench/baseline
  loopbench baseline check --experiments bench/*.json --dir bench/baseline --jobs 2
  loopbench baseline selftest --experiments bench/arm.json --dir bench/baseline --counts bench/rhs.json

Exit codes: 0 same or better (renewed, all caught), 1 worse (not caught), 2 could not measure.)";

}  // namespace

BaselineOptions::BaselineOptions(CLI::App& app) {
  app_ = app.add_subcommand("baseline", "Keep and check a baseline of drift and counts");
  app_->footer(kBaselineFooter);
  app_->add_option("action", command_.action, "Action: renew, check or selftest")
      ->required()
      ->check(CLI::IsMember({"check", "renew", "selftest"}));
  app_->add_option("--experiments", command_.experiments, "Experiment files (JSON)")
      ->required()
      ->check(CLI::ExistingFile);
  app_->add_option("--dir", command_.dir, "Folder of the baseline, to be committed")->required();
  app_->add_option("--counts", command_.counts,
                   "Benchmarks (JSON) whose instructions are counted too, by valgrind")
      ->check(CLI::ExistingFile);
  app_->add_option("--counter", command_.counter,
                   "The program loopbench_count, where it is not beside this one nor in PATH");
  app_->add_option("-j,--jobs", command_.jobs, "Runs at once")
      ->check(NumberFrom(1, 1024))
      ->capture_default_str();
  app_->add_option("--keep", command_.keep, "New folder for what was measured (default: none)");
}

std::optional<int> BaselineOptions::Run(const std::string& typed) {
  if (!*app_) return std::nullopt;
  return Baseline(command_, typed);
}

}  // namespace loopbench::harness
