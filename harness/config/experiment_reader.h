// Experiment files: one experiment, or the combinations of a sweep, read and written.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/config/experiment.h"

namespace loopbench::harness {

/// "--set /json/pointer=value": the value of one field, set before anything is read. A pointer may
/// go through a problem's mechanism path into that file ("/problems/0/mechanism/gravity"); "*"
/// stands for all elements of an array. Keys missing in the file may be set; unknown keys are
/// rejected as in the file.
struct Setting {
  std::string pointer;
  std::string value;  ///< JSON; other text is a string
};

/// Reads "/json/pointer=value". Throws ConfigError if "=" or the leading "/" is missing.
Setting ParseSetting(std::string_view text);

inline constexpr std::size_t kMaxCombinations = 10'000'000;  ///< of a sweep
inline constexpr std::size_t kMaxCases = 10'000'000;         ///< of a file, all combinations
inline constexpr std::size_t kMaxInMemory = 100'000;         ///< combinations in memory at once
inline constexpr std::size_t kMaxHeldCases = 1'000'000;      ///< cases in memory at once

/// Combinations of an experiment file, read one at a time. A file without "sweep" is one
/// experiment. A sweep varies fields of the file or of its mechanisms. Each combination of values
/// is a separate experiment, read as if the values were in the file, with the values as parameters.
class ExperimentSource {
 public:
  /// Reads the file, applies settings and reads the sweep; mechanism paths are relative to the
  /// file's folder. Throws ConfigError with all errors of the sweep, one per line.
  explicit ExperimentSource(const std::filesystem::path& path,
                            const std::vector<Setting>& settings = {});
  /// Reads from text; `path` gives the name used in messages and the folder.
  ExperimentSource(std::string text, const std::filesystem::path& path,
                   const std::vector<Setting>& settings);
  ~ExperimentSource();
  ExperimentSource(ExperimentSource&&) noexcept;

  const std::filesystem::path& path() const;

  /// Returns the number of combinations, including fully excluded combinations; 1 without a sweep.
  std::size_t count() const;

  /// Returns names and numbers of values of all axes, the slowest first, axes of a zip singly.
  std::vector<std::pair<std::string, std::size_t>> axes() const;

  /// Returns the values of a combination by axis, without reading the experiment.
  Record Parameters(std::size_t combination) const;

  /// Reads a combination. Throws ConfigError with all errors, including errors of mechanism files.
  Experiment Read(std::size_t combination);

  /// Returns ascending combinations, including the first and the last, in which each value of each
  /// axis occurs. Of an axis with more than `most` values, only some occur, evenly spaced.
  std::vector<std::size_t> EachValue(std::size_t most) const;

  /// Returns the document with all settings applied.
  std::string Text() const;

  /// Returns all combinations in order, except combinations whose cases are all excluded.
  ///
  /// In addition to names and ranges, rejects repeated methods, problems or values, fields set by
  /// two axes, and ensemble rules or exclusions that match no case. Throws ConfigError with all
  /// errors, in a sweep with all errors of the first invalid combination. More than kMaxInMemory
  /// combinations are rejected.
  std::vector<Experiment> ReadAll();

  /// Throws ConfigError if a rule of "exclude" matches no case, or if the rules exclude all cases.
  /// Reads combinations until both are decided.
  /// @param sample  combinations that are read first
  void CheckExclusions(const std::vector<std::size_t>& sample);

 private:
  struct Document;
  std::unique_ptr<Document> document_;
};

/// Reads all combinations of a file (ExperimentSource::ReadAll()).
std::vector<Experiment> ReadExperiments(const std::filesystem::path& path,
                                        const std::vector<Setting>& settings = {});

/// Reads from text; `path` gives the name used in messages and the folder of mechanism paths.
std::vector<Experiment> ParseExperiments(std::string_view text, const std::filesystem::path& path,
                                         const std::vector<Setting>& settings = {});

/// Reads a file without a sweep. Throws ConfigError for a sweep of several combinations.
Experiment ReadExperiment(const std::filesystem::path& path);

/// Reads an experiment from text.
Experiment ParseExperiment(std::string_view text, const std::filesystem::path& path);

/// Experiment of one run, for recommended settings.
struct SingleRun {
  std::string name, comment;
  std::filesystem::path mechanism;  ///< relative to the experiment's folder
  double horizon = 1.0;             ///< [s]
  Method method;
  std::string integrator = "ode45";
  double rtol = 1e-8;
  double step = 0.0;  ///< fixed step [s] if positive
  ReferenceOptions reference;
};

/// Returns the experiment with a certified reference and timing of its case.
std::string ExperimentText(const SingleRun& run);

/// Experiment that runs all models of a ladder equally (mechanism/simplify/model.h).
struct LadderFile {
  std::string name, comment;
  std::vector<std::string> mechanisms;  ///< paths as written in the experiment
  double horizon = 10.0;                ///< [s]
};

/// Returns the file: all models with the same methods, tolerances and horizon, with timing, and
/// without the simplifications that the models of the ladder already contain.
std::string LadderText(const LadderFile& ladder);

}  // namespace loopbench::harness
