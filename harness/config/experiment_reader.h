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

// The combinations of an experiment file, read one at a time.
//
// A file without "sweep" is one experiment. A sweep goes through the values of fields anywhere in
// the file or in the mechanisms it names; each combination of values is an experiment of its own,
// read as if the values stood in the file, and carries them as parameters. A sweep of ten million
// combinations is as good as one of ten: nothing here grows with their number.

/// "--set /json/pointer=value": the value of one field, set before anything is read. A pointer may
/// go through a scene's mechanism path into that file ("/problems/0/mechanism/gravity"); "*" stands
/// for all elements of an array. Keys that the file leaves out may be set; what the reader does not
/// know it refuses as it does in the file.
struct Setting {
  std::string pointer;
  std::string value;  ///< JSON, or taken as a string when it is none
};

/// Reads "/json/pointer=value". Throws ConfigError when there is no "=" or no leading "/".
Setting ParseSetting(std::string_view text);

inline constexpr std::size_t kMaxCombinations = 10'000'000;  ///< of a sweep
inline constexpr std::size_t kMaxCases = 10'000'000;     ///< of a file, all combinations together
inline constexpr std::size_t kMaxInMemory = 100'000;     ///< combinations that are held at once
inline constexpr std::size_t kMaxHeldCases = 1'000'000;  ///< and cases of them

class ExperimentSource {
 public:
  /// Reads the file, what the settings change, and its sweep; mechanism paths in it are relative to
  /// its folder. Throws ConfigError with all mistakes of the sweep, one per line.
  explicit ExperimentSource(const std::filesystem::path& path,
                            const std::vector<Setting>& settings = {});
  /// The same from text; `path` gives the name used in messages and the folder.
  ExperimentSource(std::string text, const std::filesystem::path& path,
                   const std::vector<Setting>& settings);
  ~ExperimentSource();
  ExperimentSource(ExperimentSource&&) noexcept;

  const std::filesystem::path& path() const;

  /// Number of combinations, those included whose cases are all excluded; 1 without a sweep.
  std::size_t count() const;

  /// Names and numbers of values of the axes, the first one slowest, those of a zip one by one.
  std::vector<std::pair<std::string, std::size_t>> axes() const;

  /// A combination's value on each axis, without reading it.
  Record Parameters(std::size_t combination) const;

  /// Reads one. Throws ConfigError with all its mistakes, those inside the mechanism files
  /// included.
  Experiment Read(std::size_t combination);

  /// Combinations, rising, in which each value of each axis occurs, the first and the last one
  /// among them; some of an axis's values, evenly, where it has more than `most`.
  std::vector<std::size_t> EachValue(std::size_t most) const;

  /// The document as it is read, with all settings.
  std::string Text() const;

  /// All combinations in order, without those whose cases are all excluded.
  ///
  /// Besides names and ranges it refuses what would silently do nothing or do the same twice: a
  /// column, scene or value listed twice, a field that two axes set, and an ensemble rule or
  /// exclusion that matches no case. Throws ConfigError with all mistakes; of a sweep those of the
  /// first combination that has any. More than kMaxInMemory are refused.
  std::vector<Experiment> ReadAll();

  /// Throws ConfigError for rules of "exclude" that match no case of any combination, or that match
  /// all of all. Reads combinations until it is sure.
  /// @param sample  read before the others
  void CheckExclusions(const std::vector<std::size_t>& sample);

 private:
  class Document;
  std::unique_ptr<Document> document_;
};

// Experiments and the mechanisms they name, read whole from JSON
// (configs/schema/experiment.schema.json).

/// All combinations of a file (ExperimentSource::ReadAll()).
std::vector<Experiment> ReadExperiments(const std::filesystem::path& path,
                                        const std::vector<Setting>& settings = {});

/// The same from text; `path` gives the name used in messages and the folder for mechanism paths.
std::vector<Experiment> ParseExperiments(std::string_view text, const std::filesystem::path& path,
                                         const std::vector<Setting>& settings = {});

/// The experiment of a file without a sweep. Throws ConfigError for a sweep of several
/// combinations.
Experiment ReadExperiment(const std::filesystem::path& path);

/// The same from text.
Experiment ParseExperiment(std::string_view text, const std::filesystem::path& path);

// The text of an experiment of one run, for programs that recommend one.

struct SingleRun {
  std::string name, comment;
  std::filesystem::path mechanism;  ///< as the experiment's folder sees it
  double horizon = 1.0;             ///< [s]
  Column column;
  std::string integrator = "ode45";
  double rtol = 1e-8;
  double step = 0.0;  ///< [s]; fixed where it is positive
  ReferenceOptions reference;
};

/// With a certified reference, and timed as it is.
std::string ExperimentText(const SingleRun& run);

// An experiment that runs all models of a ladder alike (mechanism/simplify/model.h).

struct LadderFile {
  std::string name, comment;
  std::vector<std::string> mechanisms;  ///< paths as the experiment says them
  double horizon = 10.0;                ///< [s]
};

/// The whole file: every model in the same columns, at the same tolerances, for the same horizon,
/// with timings, and without the savings that models of the ladder have made themselves.
std::string LadderText(const LadderFile& ladder);

}  // namespace loopbench::harness
