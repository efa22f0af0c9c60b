#include "harness/cli/program_compare.h"

#include "harness/cli/options.h"
#include "harness/text/config_error.h"
#include "harness/text/numeric_option.h"

namespace loopbench::harness {

namespace {

constexpr const char* kCompareFooter = R"(
Counts, hashes and outcomes are compared exactly; errors and instructions by their ratio; times by a
Mann-Whitney test for effects beyond 2 % (Holm's correction over all times), on one machine only.
Samples that lie a factor of 1.5 apart differ, however few they are.
What depends on round-off is compared under one compiler, flags and mathematical library only.
A value that one side lacks, or that is none (null, a text for a number), is a difference.

Examples:
  loopbench compare results/baselines results/runs/now
  loopbench compare old.json new.json --only times
  loopbench compare --history bench/history results/runs/now --markdown summary.md --junit junit.xml
  loopbench compare results/runs/before results/runs/after --only counts --only hashes
  loopbench compare before after --match mechanism,formulation   # with other tolerances, masses, ...

Exit codes: 0 the same or better, 1 something is worse or different, 2 could not measure: no time of
those on both sides could be compared, or a case is missing on one side.)";

constexpr const char* kFitFooter = R"(
Examples:
  loopbench_bench --benchmark_filter=/chain/ --benchmark_out=chain.json
  loopbench fit chain.json
  loopbench fit chain.json --from 30 --format markdown --out chain.md
  loopbench fit results/runs/paper                     # timings of "chain-3", "chain-10", ...)";

constexpr const char* kExportFooter = R"(
Examples:
  loopbench export new.json --out benchmarks.json      # github-action-benchmark, customSmallerIsBetter
  loopbench export results/runs/paper --format bmf --out bmf.json    # Bencher, adapter json

Cases that failed, and values that are no numbers, cannot be tracked: each is named.
Exit codes: 0 all exported, 1 all but those named, 2 nothing to export or bad input.)";

}  // namespace

ComparisonOptions::ComparisonOptions(CLI::App& app) {
  const CLI::IsMember formats({"text", "csv", "markdown"});
  const std::string what = "Folder of a run, a .jsonl file, or JSON of Google Benchmark";

  compare_app_ =
      app.add_subcommand("compare", "Compare results with a baseline and report regressions");
  compare_app_->footer(kCompareFooter);
  compare_app_->add_option("base", files_, what + "; left out beside --history and --branch")
      ->required()
      ->expected(1, 2)
      ->option_text("BASE NEW");
  CLI::Option* history = compare_app_->add_option(
      "--history", compare_.history, "Take the last good state of this history as BASE");
  compare_app_
      ->add_option("--branch", compare_.branch, "Last good state of a history on this git branch")
      ->excludes(history);
  compare_app_->add_option("--markdown", compare_.markdown,
                           "Write a summary for a pull request to this file too");
  compare_app_->add_option("--junit", compare_.junit,
                           "Write JUnit XML for a CI server to this file too");
  compare_app_->add_option("--only", compare_.options.only, "Only this group (repeatable)")
      ->check(CLI::IsMember(GroupNames()));
  compare_app_->add_option("--where", conditions_,
                           "Only records of both with key=value[,value] (or !=, <, <=, >, >=)");
  compare_app_
      ->add_option("--match", compare_.options.match,
                   "KEY[,KEY]: cases meet by these keys, whatever else they were run with "
                   "(default: all keys, and equal mechanisms and limits)")
      ->delimiter(',');
  compare_app_->add_flag("--subset", compare_.options.subset, "NEW may lack cases of BASE");
  compare_app_->add_flag("--added", compare_.options.added,
                         "NEW may have cases that BASE lacks (always with a history)");
  compare_app_
      ->add_option("--error-ratio", compare_.options.error_ratio, "Allowed on the same build")
      ->check(NumberFrom(1.0, 1e9))
      ->capture_default_str();
  compare_app_
      ->add_option("--format", compare_.format, "How tables are written (csv: all measures)")
      ->check(formats)
      ->capture_default_str();
  AddWide(compare_app_);
  AddJson(compare_app_, &compare_.json);

  fit_app_ =
      app.add_subcommand("fit", "Fit scaling exponents of right-hand sides against mechanism size");
  fit_app_->footer(kFitFooter);
  fit_app_
      ->add_option("file", fit_.file,
                   "JSON of Google Benchmark, or a result store with timings of families")
      ->required();
  fit_app_->add_option("--from", fit_.from, "Leave out sizes below [bodies]")
      ->check(NumberFrom(0.0, 1e9));
  fit_app_->add_option("--format", fit_.format, "How the table is written")
      ->check(formats)
      ->capture_default_str();
  fit_app_->add_option("-o,--out", fit_.out, "File (default: the terminal)");
  AddWide(fit_app_);

  export_app_ = app.add_subcommand("export", "Write measurements for a benchmark tracker");
  export_app_->footer(kExportFooter);
  export_app_->add_option("file", export_.file, what)->required();
  export_app_
      ->add_option("--format", export_.format, "Output format: github-action-benchmark or Bencher")
      ->check(CLI::IsMember({"customSmallerIsBetter", "bmf"}))
      ->capture_default_str();
  export_app_->add_option("-o,--out", export_.out, "File (default: the terminal)");
}

void ComparisonOptions::TakeFiles() {
  const bool has_history = !compare_.history.empty() || !compare_.branch.empty();
  if (files_.size() != (has_history ? 1u : 2u)) {
    throw ConfigError(has_history
                          ? "compare: found BASE beside a history, expected NEW alone"
                          : "compare: found NEW missing, expected BASE NEW, or NEW and --history");
  }
  compare_.fresh = files_.back();
  if (!has_history) compare_.base = files_.front();
}

std::optional<int> ComparisonOptions::Run(const std::string& typed) {
  compare_.where = ParseSelection(conditions_);
  if (*compare_app_) TakeFiles();
  if (*compare_app_) return PrintComparison(compare_, typed);
  if (*fit_app_) return PrintFits(fit_, typed);
  if (*export_app_) return ExportMeasurements(export_);
  return std::nullopt;
}

}  // namespace loopbench::harness
