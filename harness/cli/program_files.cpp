#include "harness/cli/program_files.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/cli/commands_schema.h"
#include "harness/cli/options.h"
#include "harness/text/numeric_option.h"

namespace loopbench::harness {

namespace {

std::vector<Setting> ParseSettings(const std::vector<std::string>& texts) {
  std::vector<Setting> settings;
  for (const std::string& text : texts) settings.push_back(ParseSetting(text));
  return settings;
}

/// Repeatable, one value each: a second word would be the name of a file.
void AddSettings(CLI::App* app, std::vector<std::string>* settings) {
  app->add_option("--set", *settings, "Set a field before reading: /json/pointer=value");
}

std::string SimplifyFooter() {
  std::string ideas;
  for (const Idea& idea : Ideas()) {
    ideas += fmt::format("  {:16} {}\n", idea.name, idea.sentence);
    if (idea.limit != nullptr) {
      ideas += fmt::format("  {:16} by {}\n", "", idea.number);
    }
  }
  return fmt::format(
      "\nIdeas; those with a number change the motion, the others do not:\n{}\n"
      "Examples:\n"
      "  loopbench simplify configs/experiments/models/light-rod-compressor.json\n"
      "  loopbench simplify my.json --threshold light-links=0.05 --only welds,light-links --out "
      "ladder\n"
      "  loopbench run ladder/NAME-ladder.json\n\n"
      "Bodies, joints and points keep their names; points of a body that another one took over\n"
      "are called BODY.POINT there. ladder.md says what was done, what is gone, and when it is "
      "right.",
      ideas);
}

}  // namespace

FileOptions::FileOptions(CLI::App& app) {
  AddRun(app);

  list_app_ = app.add_subcommand("list", "Show the cases of experiments");
  list_app_->add_option("experiment", files_.paths, "Experiment files (JSON)")->required();
  list_app_->add_option("--filter", conditions_,
                        "Only cases with key=value[,value] (or !=, <, <=, >, >=)");
  AddSettings(list_app_, &settings_);
  AddWide(list_app_);
  AddJson(list_app_, &json_);

  AddCheck(app);

  plan_app_ = app.add_subcommand("plan", "Count cases and runs, and estimate their time");
  plan_app_->add_option("experiment", files_.paths, "Experiment files (JSON)")->required();
  plan_app_->add_option("--from", plan_.from,
                        "Earlier results whose times are used, not a pilot's");
  plan_app_->add_option("--filter", conditions_,
                        "Only cases with key=value[,value] (or !=, <, <=, >, >=)");
  plan_app_->add_flag("--no-timing", no_timing_, "Leave the timings out");
  AddSettings(plan_app_, &settings_);
  AddWide(plan_app_);
  AddJson(plan_app_, &json_);

  AddExplain(app);
  AddSimplify(app);
  AddSchema(app);
  AddAdvise(app);
}

void FileOptions::AddRun(CLI::App& app) {
  run_app_ =
      app.add_subcommand("run", "Run experiments (resumes an interrupted run) and write results");
  run_app_->add_option("experiment", run_.experiments, "Experiment files (JSON)")->required();
  run_app_->add_option("-o,--out", run_.out,
                       "Folder for results.jsonl, drift.csv and timing.csv "
                       "(default: results/runs/NAME)");
  run_app_->add_option("-j,--jobs", run_.suite.jobs, "Accuracy cases at once; timings run alone")
      ->check(NumberFrom(1, 1024))
      ->capture_default_str();
  run_app_
      ->add_option("--threads", run_.threads,
                   "Threads per right-hand side (O-DCA on long chains); same results")
      ->check(NumberFrom(1, kMostThreads));
  run_app_->add_option("--filter", conditions_,
                       "Only cases with key=value[,value] (or !=, <, <=, >, >=)");
  AddSettings(run_app_, &settings_);
  AddWide(run_app_);
  run_app_->add_option("--shard", shard_, "k/n: the k-th of n parts, to be merged later")
      ->capture_default_str();
  run_app_->add_flag("--isolate", run_.suite.isolate,
                     "Every case in a process of its own; else short ones share processes");
  run_app_->add_flag("--wait", run_.wait,
                     "Wait while another process writes to the store, then go on with it");
  run_app_->add_option("--rerun", rerun_, "Cases to run although the store has them")
      ->check(CLI::IsMember({"none", "failed", "all"}))
      ->capture_default_str();
  CLI::Option* gate = AddGate(run_app_, &run_.gate);
  run_app_->footer(
      "A run that was interrupted goes on where it stopped: give the same command again.");
  CLI::Option* no = run_app_->add_flag("--no-timing", no_timing_, "Leave the timings out");
  CLI::Option* timings =
      run_app_->add_flag("--timing-only", timing_only_, "Only the timings")->excludes(no);
  timings->excludes(gate);  // which judges accuracy runs
  run_app_->add_flag("--precision-only", precision_only_, "Only the runs in several scalars")
      ->excludes(no)
      ->excludes(timings)
      ->excludes(gate);
}

void FileOptions::AddCheck(CLI::App& app) {
  check_app_ =
      app.add_subcommand("check", "Validate files and solve for consistent initial conditions");
  check_app_->add_option("file", files_.paths, "Files (JSON)")->required();
  check_app_->add_flag("--no-assembly", no_assembly_, "Read only, assemble no start");
  AddLimits(check_app_, &check_.limits);
  AddJson(check_app_, &json_);
  AddSettings(check_app_, &settings_);
}

void FileOptions::AddExplain(CLI::App& app) {
  explain_app_ = app.add_subcommand(
      "explain", "Describe an experiment or a mechanism (joints, loops, freedom, redundancy)");
  explain_app_->add_option("file", files_.paths, "Experiment or mechanism files (JSON)")
      ->required();
  explain_app_->add_option("--filter", conditions_,
                           "Only cases with key=value[,value] (or !=, <, <=, >, >=)");
  AddLimits(explain_app_, &explain_limits_);
  AddSettings(explain_app_, &settings_);
  AddWide(explain_app_);
  AddJson(explain_app_, &json_);
  explain_app_->add_flag("--all", explain_all_, "Every row of long tables of a mechanism");
}

void FileOptions::AddSimplify(CLI::App& app) {
  simplify_app_ = app.add_subcommand(
      "simplify", "Generate simpler models of a mechanism and measure their errors");
  simplify_app_->add_option("mechanism", simplify_.mechanism, "Mechanism file (JSON)")->required();
  CLI::Option* list = simplify_app_->add_flag("--list", simplify_list_,
                                              "Only list what could be simplified (the default)");
  simplify_app_->add_option("--only", simplify_.only, "Only these ideas: NAME[,NAME]")
      ->delimiter(',');
  simplify_app_->add_option("--threshold", simplify_.thresholds,
                            "NAME=VALUE: an idea's limit, unless said " + LimitsText());
  simplify_app_->add_option("--lump", lumping_, "Where the mass of a light link goes")
      ->check(CLI::IsMember(LumpingNames()))
      ->capture_default_str();
  simplify_app_
      ->add_option("--short-run", simplify_.short_run,
                   "Length of the short run that shows what hardly moves [s], 0: none")
      ->check(NumberFrom(0.0, 1e6))
      ->capture_default_str();
  simplify_app_
      ->add_option("--errors", simplify_.errors,
                   "Run all models for so long [s] and say how far their points are off, 0: no")
      ->check(NumberFrom(0.0, 1e6))
      ->capture_default_str();
  CLI::Option* accept =
      simplify_app_
          ->add_option("--accept", simplify_.accept,
                       "Largest error that a model may cause [m]: its verdict in the store")
          ->check(NumberFrom(1e-15, 1e6));
  accept->needs("--errors");
  simplify_app_
      ->add_option("--store", simplify_.store,
                   "Add a record for each model to this store: error against the certified motion "
                   "of the whole one, times, verdict (loopbench table STORE --kind models)")
      ->needs(accept);
  simplify_app_
      ->add_option("--horizon", simplify_.horizon, "Simulated time of the written experiment [s]")
      ->check(NumberFrom(1e-9, 1e9))
      ->capture_default_str();
  AddWide(simplify_app_);
  simplify_app_
      ->add_option("-o,--out", simplify_.out,
                   "New folder for the models, an experiment that runs them, and ladder.md")
      ->excludes(list);
  simplify_app_->add_flag("--assembled", simplify_.assembled,
                          "Begin from a whole model that says all of its assembled start");
  simplify_app_->add_flag("--force", simplify_.force, "Overwrite files of an existing folder");
  simplify_.limits = kFileLimits;
  AddLimits(simplify_app_, &simplify_.limits);
  simplify_app_->add_flag("--all", simplify_all_, "Every row of long tables");
  simplify_app_->footer(SimplifyFooter());
}

void FileOptions::AddSchema(CLI::App& app) {
  schema_app_ = app.add_subcommand("schema", "Print the JSON Schema (draft 07) of a file type");
  schema_app_->add_option("kind", schema_kind_, "File type")
      ->required()
      ->check(CLI::IsMember(SchemaKinds()));
  schema_app_->add_flag("--tables", schema_tables_, "Tables of keys in Markdown instead");
}

void FileOptions::AddAdvise(CLI::App& app) {
  advise_app_ =
      app.add_subcommand("advise", "Recommend the cheapest method that meets an error bound");
  advise_app_->add_option("mechanism", advise_.mechanism, "Mechanism file (JSON)")->required();
  CLI::Option* error =
      advise_app_
          ->add_option("--error", advise_.error, "Largest error of points [m] (default: 1e-6)")
          ->check(NumberFrom(1e-13, 1e9));
  advise_app_
      ->add_option("--budget", advise_.budget,
                   "Wall-time budget per simulated second; find the most accurate method")
      ->check(NumberFrom(1e-9, 1e6))
      ->excludes(error);
  advise_app_->add_option("--horizon", advise_.horizon, "Simulated time [s]")
      ->check(NumberFrom(1e-9, 1e9))
      ->capture_default_str();
  advise_app_->add_option("--points", advise_.points,
                          "Points that define the error: BODY.POINT or BODY (default: all)");
  advise_app_
      ->add_flag("--simplify", advise_.simplify,
                 "Also try simpler models, with their errors and times (loopbench simplify)")
      ->excludes("--budget");
  advise_app_->add_flag("--generated", advise_.generated,
                        "Also time generated code of all formulations with the advice's settings");
  advise_app_->add_flag("--exhaustive", advise_.exhaustive,
                        "Try all combinations of formulation, level, integrator and tolerance");
  advise_app_->add_option("-o,--out", advise_.out, "File for the experiment that reproduces it");
  advise_app_->add_option("--format", advise_.format, "Format of the finalists' table")
      ->check(CLI::IsMember({"text", "csv", "markdown", "json", "latex"}))
      ->capture_default_str();
  AddLimits(advise_app_, &advise_.limits);
  AddWide(advise_app_);
  advise_app_->footer(
      "Errors are true ones, against a certified reference; times are of bare runs, one at a "
      "time.\n"
      "Exit codes: 0 found, 1 nothing reached what was asked for (the nearest is shown), 2 no "
      "reference or bad input.\n"
      "  loopbench advise four-bar.json --error 1e-6\n"
      "  loopbench advise arm.json --budget 0.001 --horizon 5 --points gripper.tip --out "
      "best.json");
}

int FileOptions::RunExperiments(const std::string& typed) {
  run_.settings = files_.settings;
  run_.suite.filter = files_.filter;
  run_.suite.timing = !no_timing_ && !precision_only_;
  run_.suite.accuracy = !timing_only_ && !precision_only_;
  run_.suite.precision = !timing_only_;
  run_.suite.set = fmt::format("{}", fmt::join(settings_, " "));
  run_.suite.shard = ParseShard(shard_);
  run_.suite.rerun = rerun_ == "all"      ? Rerun::kAll
                     : rerun_ == "failed" ? Rerun::kFailed
                                          : Rerun::kNone;
  return harness::Run(run_, typed);
}

std::optional<int> FileOptions::Run(const std::string& typed, const std::string& again) {
  files_.filter = ParseSelection(conditions_);
  files_.settings = ParseSettings(settings_);
  run_.again = again;
  if (*run_app_) return RunExperiments(typed);
  if (*list_app_) return List(files_, json_);
  if (*plan_app_) {
    plan_.files = files_;
    plan_.json = json_;
    plan_.timing = !no_timing_;
    return PrintPlans(plan_);
  }
  if (*explain_app_) return Explain(files_, explain_all_, json_, explain_limits_);
  if (*advise_app_) {
    constexpr double kError = 1e-6;
    if (advise_.error == 0.0 && advise_.budget == 0.0) advise_.error = kError;
    return Advise(advise_, typed);
  }
  if (*simplify_app_) {
    simplify_.lumping =
        static_cast<Lumping>(std::ranges::find(LumpingNames(), lumping_) - LumpingNames().begin());
    return Simplify(simplify_, simplify_all_, typed);
  }
  if (*schema_app_) {
    PrintText(schema_tables_ ? TablesOfKinds({schema_kind_}) : SchemaOfKind(schema_kind_));
    return 0;
  }
  if (*check_app_) {
    check_.files = files_;
    check_.json = json_;
    check_.assembly = !no_assembly_;
    return CheckFiles(check_);
  }
  return std::nullopt;
}

}  // namespace loopbench::harness
