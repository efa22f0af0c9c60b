// The series of records as curves against time.
#pragma once

#include <string>
#include <vector>

#include "harness/report/report_data.h"

namespace loopbench::harness {

/// Drift, energy error and true error of the rows that have them; together at most `most` points,
/// shared evenly among the curves, with the extremes of each.
std::vector<ReportPlot> MakePlots(const std::vector<Record>& rows, std::size_t most);

}  // namespace loopbench::harness
