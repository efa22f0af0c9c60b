// tradeoff: what accuracy costs. As commands.h.
#pragma once

#include <filesystem>
#include <string>

#include "harness/judge/tradeoff.h"

namespace loopbench::harness {

struct TradeoffCommand {
  std::filesystem::path store;
  TradeoffOptions options;
  std::string format = "text";      ///< of what is printed: text, csv, markdown, json or latex
  std::filesystem::path out;        ///< folder; default: that of the store
  std::string figures;              ///< svg or pdf; "" for none
  std::string size = "two-column";  ///< of figures, a name of a FigureSize
  bool all = false;                 ///< print every row, not the front alone
};
/// Prints fronts, overview and fairness statement; writes tradeoff.csv, tradeoff-overview.csv,
/// tradeoff.md and the figures.
int PrintTradeoff(const TradeoffCommand& command, const std::string& typed);

}  // namespace loopbench::harness
