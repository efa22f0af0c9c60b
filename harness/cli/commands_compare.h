// The subcommands on finished measurements: compare, fit, export. As commands.h.
#pragma once

#include <filesystem>
#include <string>

#include "harness/judge/compare.h"
#include "harness/record/select.h"

namespace loopbench::harness {

struct CompareCommand {
  std::filesystem::path base, fresh;
  std::string format = "text";  ///< text, csv or markdown
  CompareOptions options;
  Selection where = {};  ///< only such records of both sides
  bool json = false;     ///< one document on standard output, with every measure
  /// The base instead: the last good state of a history.
  std::filesystem::path history = {};
  std::string branch = {};
  std::filesystem::path markdown = {}, junit = {};  ///< files besides; none when empty
};
/// 0 the same or better, 1 something is worse or different, 2 could not measure.
int PrintComparison(const CompareCommand& command, const std::string& typed);

struct FitCommand {
  std::filesystem::path file;
  std::string format = "text";
  double from = 0.0;          ///< sizes below are left out
  std::filesystem::path out;  ///< standard output when empty
};
/// Exponents of time over size, one row per benchmark family. 0, or 2 when there is no exponent.
int PrintFits(const FitCommand& command, const std::string& typed);

struct ExportCommand {
  std::filesystem::path file;
  std::string format = "customSmallerIsBetter";  ///< or bmf
  std::filesystem::path out;                     ///< standard output when empty
};
/// Measurements as the JSON that trackers of continuous benchmarking take. 0; 1 when something had
/// to be left out, each named on standard error; 2 when nothing is left.
int ExportMeasurements(const ExportCommand& command);

}  // namespace loopbench::harness
