// Report data as JSON for web/report/, safe inside an element of HTML.
#pragma once

#include <string>
#include <vector>

#include "harness/report/report_data.h"

namespace loopbench::harness {

/// An element of the page with data: it is parsed when it is looked at for the first time.
struct DataElement {
  std::string id;
  std::string json;
};

/// "tables", "costs", "map", "scenes" and one "curves-NAME" per plot. Numbers of tables have all
/// digits, those of curves and poses as many as a screen shows.
std::vector<DataElement> ToJson(const ReportData& data);

}  // namespace loopbench::harness
