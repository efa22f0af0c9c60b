// Options of the subcommands run, list, check, plan, explain, simplify and schema: those of the
// files that users write.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "harness/cli/commands.h"
#include "harness/cli/commands_advise.h"
#include "harness/cli/commands_simplify.h"

namespace loopbench::harness {

class FileOptions {
 public:
  /// Adds the subcommands to `app`, which must outlive this.
  explicit FileOptions(CLI::App& app);

  /// Runs the subcommand that was parsed, if it is one of these: its exit code.
  /// @param again  the command as a shell takes it (ShellLine)
  std::optional<int> Run(const std::string& typed, const std::string& again);

 private:
  void AddRun(CLI::App& app);
  void AddCheck(CLI::App& app);
  void AddExplain(CLI::App& app);
  void AddSimplify(CLI::App& app);
  void AddSchema(CLI::App& app);
  void AddAdvise(CLI::App& app);
  int RunExperiments(const std::string& typed);

  CLI::App *run_app_, *list_app_, *check_app_, *plan_app_, *explain_app_, *simplify_app_,
      *schema_app_, *advise_app_;
  std::vector<std::string> conditions_, settings_;  ///< --filter and --set, as typed
  ExperimentFiles files_;
  RunCommand run_;
  std::string shard_ = "1/1", rerun_ = "none";
  bool no_timing_ = false, timing_only_ = false, precision_only_ = false;
  CheckCommand check_;
  bool no_assembly_ = false;
  PlanCommand plan_;
  ProcessLimits explain_limits_ = kFileLimits;
  bool explain_all_ = false, json_ = false;
  AdviseCommand advise_;
  SimplifyCommand simplify_;
  std::string lumping_ = LumpingNames().front();
  bool simplify_list_ = false, simplify_all_ = false;
  std::string schema_kind_;
  bool schema_tables_ = false;
};

}  // namespace loopbench::harness
