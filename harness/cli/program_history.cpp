#include "harness/cli/program_history.h"

#include "harness/cli/options.h"

namespace loopbench::harness {

namespace {

constexpr const char* kHistoryFooter = R"(
A history is a folder (--store) or a branch of the repository that you are in (--branch, which add begins when it
is not there). Steps are found in the logarithms of each measure of each case on each machine, by the least penalised
cost with a bounded loss (Fearnhead and Rigaill 2019), so that single slow runs are none; docs/history.md.

Examples:
  loopbench history add results/runs/bench --branch loopbench-history
  loopbench history show --branch loopbench-history --measure wall_s
  loopbench history report --branch loopbench-history --out history.html
  loopbench history mark 1a2b3c accepted --note 'exact mass matrix, slower' --branch loopbench-history
  loopbench compare --branch loopbench-history results/runs/bench --markdown summary.md)";

void AddPlace(CLI::App* app, HistoryPlace* place) {
  CLI::Option* store = app->add_option("--store", place->store, "Folder of the history");
  app->add_option("--branch", place->branch,
                  "Branch of the git repository here, instead of a folder")
      ->excludes(store);
}

}  // namespace

HistoryOptions::HistoryOptions(CLI::App& app) {
  app_ = app.add_subcommand("history", "Follow measurements over commits and find change points");
  app_->footer(kHistoryFooter);
  app_->require_subcommand(1);

  add_app_ = app_->add_subcommand("add", "Add the results of a commit");
  add_app_
      ->add_option("results", add_.results, "Folder of a run, .jsonl, or JSON of Google Benchmark")
      ->required();
  add_app_->add_option("--commit", add_.commit,
                       "Commit of the results (default: the one checked out)");
  add_app_->add_option("--date", add_.date,
                       "ISO 8601, by which commits are ordered (default: the commit's)");
  add_app_->add_flag("--replace", add_.replaces, "Replace an earlier measurement of this commit");
  AddPlace(add_app_, &place_);

  show_app_ = app_->add_subcommand("show", "List change points and recent commits");
  show_app_->add_option("--case", show_.one, "Only cases whose name contains this text");
  show_app_->add_option("--measure", show_.measure, "Only measures whose name contains this text");
  show_app_->add_option("--format", show_.format, "Output format")
      ->check(CLI::IsMember({"text", "csv", "markdown", "json"}))
      ->capture_default_str();
  AddPlace(show_app_, &place_);
  AddJson(show_app_, &show_.json);
  AddWide(show_app_);

  report_app_ =
      app_->add_subcommand("report", "Write an HTML page with all change points and charts");
  report_app_->add_option("-o,--out", report_.out,
                          "The page (default: history.html in the folder)");
  report_app_->add_option("--title", report_.title, "Page title")
      ->default_val("Measurements over commits");
  AddPlace(report_app_, &place_);

  mark_app_ = app_->add_subcommand("mark", "Mark a commit as good, bad or accepted");
  mark_app_->add_option("commit", mark_.commit, "Commit hash or prefix")->required();
  mark_app_
      ->add_option("mark", mark_.mark, "good and accepted: compare takes it as base; bad: never")
      ->required()
      ->check(CLI::IsMember({"good", "accepted", "bad"}));
  mark_app_->add_option("--note", mark_.note, "Reason, stored with the mark");
  mark_app_->add_flag("--keep-accepted", mark_.keeps_accepted,
                      "Leave it as it is where somebody accepted it (for jobs)");
  AddPlace(mark_app_, &place_);
}

std::optional<int> HistoryOptions::Run(const std::string& typed) {
  if (!*app_) return std::nullopt;
  add_.place = show_.place = report_.place = mark_.place = place_;
  if (*add_app_) return HistoryAdd(add_);
  if (*show_app_) return HistoryShow(show_, typed);
  if (*report_app_) return HistoryReport(report_, typed);
  return HistoryMark(mark_);
}

}  // namespace loopbench::harness
