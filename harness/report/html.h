// Writers of a report: JSON and an HTML page.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "harness/report/report_data.h"

namespace loopbench::harness {

// Report data as JSON for web/report/, safe inside an HTML element.

/// A data element of the page, which is parsed when it is first displayed.
struct DataElement {
  std::string id;
  std::string json;
};

/// Returns "tables", "costs", "map", "problems" and one "curves-NAME" per plot. Tables have numbers
/// with all digits, curves and poses with display precision.
std::vector<DataElement> ToJson(const ReportData& data);

// Report data as one self-contained HTML page: data, style and script are embedded.

/// web/report/ after uPlot and its licence, embedded when the program is built. Empty in a program
/// built without it (cmake -DLOOPBENCH_REPORT=OFF).
extern const std::string_view kReportScript, kReportStyle;

/// Writes the findings as text, for readers without script and for print; the script draws the rest
/// from the data.
std::string ToHtml(const ReportData& data);

}  // namespace loopbench::harness
