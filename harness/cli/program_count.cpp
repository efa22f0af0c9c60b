#include "harness/cli/program_count.h"

#include "harness/cli/options.h"
#include "harness/config/formulations.h"
#include "harness/config/sized_family.h"

namespace loopbench::harness {

namespace {

constexpr const char* kCountFooter = R"(
Each row is one right-hand side, recorded shortly after the mechanism's start. Counts are exact and depend on no clock.
docs/operation-counts.md explains the columns.

Examples:
  loopbench count configs/mechanisms/four-bar.json
  loopbench count configs/mechanisms/*.json --level acceleration --format csv --out counts.csv
  loopbench count --family chain --sizes $(seq -s, 3 40) --level acceleration --format jsonl --out chain.jsonl
  loopbench plot chain.jsonl --out chain.svg --x bodies --y flops_per_body --group formulation,coordinates
  loopbench count my.json --formulation odca --coordinates joint --solver as-published --format json

Exit codes: 0 done, 2 bad input or no right-hand side was recorded.)";

}  // namespace

CountOptions::CountOptions(CLI::App& app) {
  app_ = app.add_subcommand("count", "Count the operations of right-hand sides exactly");
  app_->add_option("mechanisms", count_.mechanisms, "Mechanism files (JSON)");
  CLI::Option* family =
      app_->add_option("--family", count_.family,
                       "Family of mechanisms of any size; also prints how counts grow with size, "
                       "and which method is cheapest at which size")
          ->check(CLI::IsMember(NamesOfSizedFamilies()));
  app_->add_option("--sizes", count_.sizes, "Sizes of the family's members: a,b")
      ->delimiter(',')
      ->needs(family);
  app_->add_option("--formulation", count_.formulations, "Formulations (default: all): a,b")
      ->delimiter(',')
      ->check(CLI::IsMember(FormulationNamesWithoutPeers()));
  app_->add_option("--level", count_.levels, "Levels (default: all that are recorded): a,b")
      ->delimiter(',')
      ->check(CLI::IsMember(LevelNames()));
  app_->add_option("--coordinates", count_.coordinates, "Coordinate sets (default: both): a,b")
      ->delimiter(',')
      ->check(CLI::IsMember({"joint", "absolute"}));
  app_->add_option("--solver", count_.solvers, "Solvers: a,b")
      ->delimiter(',')
      ->check(CLI::IsMember({"as-published", "rank-revealing"}))
      ->capture_default_str();
  app_->add_option("--format", count_.format, "Format of the table")
      ->check(CLI::IsMember({"text", "csv", "markdown", "json", "latex", "jsonl"}))
      ->capture_default_str();
  app_->add_option("-o,--out", count_.out, "File (default: the terminal)");
  AddWide(app_);
  AddLimits(app_, &count_.limits);
  app_->footer(kCountFooter);
}

std::optional<int> CountOptions::Run(const std::string& typed) const {
  if (!*app_) return std::nullopt;
  return CountOperations(count_, typed);
}

}  // namespace loopbench::harness
