#include "harness/cli/program_report.h"

namespace loopbench::harness {

ReportCommandOptions::ReportCommandOptions(CLI::App& app) {
  app_ = app.add_subcommand("report", "Write a self-contained HTML report of a run");
  app_->add_option("store", report_.store, "Folder with results.jsonl, or a .jsonl file")
      ->required();
  app_->add_option("-o,--out", report_.out, "File (default: report.html in the store)");
  app_->add_option("--rules", report_.rules, "Rules of a failure map, which the page then has");
  app_->add_option("--claims", report_.claims, "Claims, whose verdicts the page then has");
  app_->footer(
      "Verdicts and doubts, all cases as tables to sort and filter, drift and errors against time\n"
      "beside the mechanism in motion, work and precision with the Pareto front, the failure map, "
      "and\n"
      "where each number comes from. Motions are those that the run has kept: with \"output\" or\n"
      "\"reference\" in the experiment. Nothing is computed again.\n"
      "  loopbench report out\n"
      "  loopbench report results/runs/extremes --rules configs/experiments/extremes/map.json");
}

std::optional<int> ReportCommandOptions::Run(const std::string& typed) const {
  if (!*app_) return std::nullopt;
  return WriteReport(report_, typed);
}

}  // namespace loopbench::harness
