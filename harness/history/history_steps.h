// The steps of a history as rows.
#pragma once

#include <optional>
#include <string>

#include "harness/history/history_series.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

/// A row for each step, newest first; of one commit other endings first. "ratio" is empty where the
/// level was 0 or is a text.
Table StepTable(const History& history, const HistoryFindings& found);

/// How many times were left out; nothing where none was.
std::optional<std::string> UnsteadyNote(const HistoryFindings& found);

}  // namespace loopbench::harness
