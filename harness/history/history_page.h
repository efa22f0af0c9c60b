// A history as one page of HTML: the steps, the commits, and a chart of each series.
#pragma once

#include <string>
#include <vector>

#include "harness/history/history_series.h"

namespace loopbench::harness {

/// Charts are SVG in the page, without script; those with steps stand first. At most 200 are drawn,
/// and the page says how many are not.
std::string HistoryPage(const History& history, const HistoryFindings& found,
                        const std::string& title, const std::vector<std::string>& provenance);

}  // namespace loopbench::harness
