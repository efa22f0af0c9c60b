// Options of the subcommands merge, table, plot, tradeoff, trajectory, verdict and map: those that
// read stores.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "harness/cli/commands.h"
#include "harness/cli/commands_tradeoff.h"
#include "harness/cli/commands_trajectory.h"

namespace loopbench::harness {

class StoreOptions {
 public:
  /// Adds the subcommands to `app`, which must outlive this.
  explicit StoreOptions(CLI::App& app);

  /// Runs the subcommand that was parsed, if it is one of these: its exit code.
  std::optional<int> Run(const std::string& typed);

 private:
  void AddTable(CLI::App& app);
  void AddPlot(CLI::App& app);
  void AddTradeoff(CLI::App& app);
  void AddTrajectory(CLI::App& app);
  void AddMap(CLI::App& app);

  CLI::App *merge_app_, *table_app_, *plot_app_, *tradeoff_app_, *trajectory_app_, *verdict_app_,
      *map_app_;
  std::vector<std::string> conditions_;  ///< --where, as typed
  MergeCommand merge_;
  TableCommand table_;
  PlotCommand plot_;
  TradeoffCommand tradeoff_;
  bool draws_tradeoff_ = false;  ///< --figures
  std::string drawn_as_ = "svg";
  TrajectoryCommand trajectory_;
  VerdictCommand verdict_;
  MapCommand map_;
};

}  // namespace loopbench::harness
