// Report data as one page of HTML: data, style and script in it, nothing from elsewhere.
#pragma once

#include <string>
#include <string_view>

#include "harness/report/report_data.h"

namespace loopbench::harness {

/// web/report/, with uPlot and its licence before it, as they were when the program was built.
/// Empty in a program that was built without (cmake -DLOOPBENCH_REPORT=OFF).
extern const std::string_view kReportScript, kReportStyle;

/// What was found stands in the page as text, for readers without script and for paper; the rest is
/// drawn from its data.
std::string ToHtml(const ReportData& data);

}  // namespace loopbench::harness
