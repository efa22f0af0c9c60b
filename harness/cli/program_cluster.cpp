#include "harness/cli/program_cluster.h"

#include <fmt/format.h>

#include <set>

#include "harness/cli/options.h"
#include "harness/text/config_error.h"
#include "harness/text/numeric_option.h"

namespace loopbench::harness {

namespace {

constexpr const char* kSubmitFooter = R"(
The parts run as one array job of Slurm, the merge as a job behind it. A part that is killed, preempted or
started twice goes on where its store stopped; --again submits the parts that are not done and not queued.
Without Slurm: --no-queue writes the folder, and any engine calls `sh DIR/part.sh K` for each K, then
`loopbench collect DIR`. docs/clusters.md has GNU parallel, Kubernetes and GitHub.

Examples:
  loopbench submit sweep.json --tasks 100 --out /shared/sweep --time 1:00:00 --partition cpu --no-timing
  loopbench submit sweep.json --tasks 100 --out /shared/sweep --dry-run
  loopbench status /shared/sweep
  loopbench submit --again --out /shared/sweep)";

/// All that was asked for once stands in the folder.
void RequireNothingElse(const CLI::App& submit) {
  const std::set<std::string> may_stand = {"--again", "--out", "--no-queue", "--dry-run"};
  for (const CLI::Option* option : submit.get_options()) {
    if (option->count() == 0 || may_stand.contains(option->get_name())) continue;
    throw ConfigError(fmt::format("--again: found {} beside it, expected none: the folder knows",
                                  option->get_name()));
  }
}

}  // namespace

ClusterOptions::ClusterOptions(CLI::App& app) {
  submit_app_ = app.add_subcommand("submit", "Run experiments in parts on a cluster (Slurm)");
  submit_app_->footer(kSubmitFooter);
  ClusterRun& run = submit_.run;
  submit_app_->add_option("experiment", run.experiments, "Experiment files (JSON)")
      ->check(CLI::ExistingFile);
  submit_app_->add_option("-o,--out", submit_.folder, "New folder that all machines see")
      ->required();
  submit_app_->add_option("--tasks", run.parts, "Parts, each a task of the array job")
      ->check(NumberFrom(1, kMostParts));
  submit_app_
      ->add_option("-j,--jobs", run.jobs, "Cases at once in a part, and processors of its task")
      ->check(NumberFrom(1, kMostJobs))
      ->capture_default_str();
  submit_app_->add_option("--time", time_, "Limit of a part, as sbatch takes it");
  submit_app_->add_option("--partition", partition_, "Slurm partition");
  submit_app_->add_option("--sbatch", run.batch_options,
                          "Another option of sbatch, whole: --sbatch=--account=mine (repeatable)");
  submit_app_->add_option("--filter", run.conditions,
                          "Only cases with key=value[,value] (or !=, <, <=, >, >=)");
  submit_app_->add_option("--set", run.settings, "Set a field before reading: /json/pointer=value");
  submit_app_->add_flag("--no-timing", no_timing_,
                        "Leave the timings out: parts on one machine disturb each other's");
  submit_app_->add_flag("--isolate", run.isolate, "Every case in a process of its own");
  submit_app_->add_flag("--again", submit_.again,
                        "Only the parts of this folder that are not done");
  submit_app_->add_flag("--no-queue", no_queue_, "Write the folder, submit nothing");
  submit_app_->add_flag("--dry-run", submit_.dry_run, "Print the scripts, write nothing");

  status_app_ = app.add_subcommand("status", "Show the progress of a submitted run");
  status_app_->add_option("folder", folder_, "Folder created by submit")->required();
  AddJson(status_app_, &json_);
  AddWide(status_app_);

  collect_app_ = app.add_subcommand("collect", "Merge the parts of a submitted run");
  collect_app_->add_option("folder", folder_, "Folder created by submit")->required();
  collect_app_->footer(
      "DIR/whole gets every case once, in the order of the experiments. Exit codes: 0 merged, 1 a "
      "part or a\ncase is missing and nothing was written, 2 bad input.");
}

std::optional<int> ClusterOptions::Run() {
  if (*status_app_) return PrintStatus(folder_, json_);
  if (*collect_app_) return Collect(folder_);
  if (!*submit_app_) return std::nullopt;
  ClusterRun& run = submit_.run;
  if (submit_.again != run.experiments.empty()) {
    throw ConfigError(submit_.again
                          ? "--again: found experiments beside it, expected none: the folder knows"
                          : "submit: found no experiment, expected at least one, or --again");
  }
  if (submit_.again) RequireNothingElse(*submit_app_);
  if (!time_.empty()) run.batch_options.push_back("--time=" + time_);
  if (!partition_.empty()) run.batch_options.push_back("--partition=" + partition_);
  for (const std::string& option : run.batch_options) {
    if (option.starts_with("--")) continue;
    throw ConfigError("--sbatch: found '" + option + "', expected an option that begins with --");
  }
  run.timing = !no_timing_;
  submit_.queue = !no_queue_;
  return Submit(submit_);
}

}  // namespace loopbench::harness
