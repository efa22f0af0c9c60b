// The subcommand report.
#pragma once

#include <filesystem>
#include <string>

namespace loopbench::harness {

struct ReportCommand {
  std::filesystem::path store;
  std::filesystem::path out;     ///< default report.html in the store's folder
  std::filesystem::path rules;   ///< of a failure map, or none
  std::filesystem::path claims;  ///< or none
};
/// Writes the page; 2 where the store has no records, or this program no pages.
int WriteReport(const ReportCommand& command, const std::string& typed);

}  // namespace loopbench::harness
