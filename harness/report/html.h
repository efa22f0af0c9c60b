// A report as JSON, and the page that shows it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "harness/report/report_data.h"

namespace loopbench::harness {

// Report data as JSON for web/report/, safe inside an element of HTML.

/// An element of the page with data: it is parsed when it is looked at for the first time.
struct DataElement {
  std::string id;
  std::string json;
};

/// "tables", "costs", "map", "scenes" and one "curves-NAME" per plot. Numbers of tables have all
/// digits, those of curves and poses as many as a screen shows.
std::vector<DataElement> ToJson(const ReportData& data);

// Report data as one page of HTML: data, style and script in it, nothing from elsewhere.

/// web/report/, with uPlot and its licence before it, as they were when the program was built.
/// Empty in a program that was built without (cmake -DLOOPBENCH_REPORT=OFF).
extern const std::string_view kReportScript, kReportStyle;

/// What was found stands in the page as text, for readers without script and for paper; the rest is
/// drawn from its data.
std::string ToHtml(const ReportData& data);

}  // namespace loopbench::harness
