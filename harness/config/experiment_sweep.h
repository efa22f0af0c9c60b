// "sweep" of an experiment file: axes that are crossed, each the values of one field.
//
//   "sweep": [{"name": "mass", "field": "/scenes/0/mechanism/bodies/1/mass", "values": [1, 2, 3]},
//             {"zip": [{"name": "stiffness", ...}, {"name": "damping", ...}]}]
//
// makes 3 n combinations: the axes of a zip go in step. Internal to harness/config.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "harness/config/experiment_fields.h"

namespace loopbench::harness {

struct SweepAxis {
  std::string name;
  std::string source;             ///< pointer of the axis in the experiment file
  FieldTargets fields;            ///< what each value is set to
  std::vector<Json> values;       ///< at least one
  std::vector<Value> parameters;  ///< the same as records hold them
};

/// Axes in step; a plain axis is alone.
struct SweepGroup {
  std::vector<SweepAxis> axes;
  std::size_t count() const { return axes.front().values.size(); }
};

class Sweep {
 public:
  /// Reads "sweep" and finds the fields; mistakes go to the root's errors. `settings` are the
  /// fields that --set has set: a sweep over one of them would undo it.
  Sweep(const JsonNode& root, ExperimentFields& fields, const std::vector<std::string>& settings);

  /// False when there are mistakes in it, or in a mechanism file that it goes through.
  bool sound() const { return sound_; }

  /// Number of combinations; 1 without a sweep, which is the file as it stands.
  std::size_t count() const { return count_; }

  /// Sets the fields of one combination; the last group is the fastest.
  void Apply(std::size_t combination, ExperimentFields& fields) const;

  /// Its values by name.
  Record Parameters(std::size_t combination) const;

  /// Names and numbers of values.
  std::vector<std::pair<std::string, std::size_t>> Axes() const;

  /// As ExperimentSource::EachValue().
  std::vector<std::size_t> EachValue(std::size_t most) const;

  /// Notes where values come from, for messages.
  void Note(Origins* origins) const;

 private:
  void Read(const JsonNode& node, ExperimentFields& fields,
            const std::vector<std::string>& settings);
  void CheckOverlaps(const JsonNode& node, const std::vector<std::string>& settings) const;
  std::vector<std::size_t> Indices(std::size_t combination) const;

  std::vector<SweepGroup> groups_;
  std::size_t count_ = 1;
  bool sound_ = true;
};

/// "exclude": conditions on case keys and axis names, as selections that match excluded cases.
std::vector<Selection> ReadExclusions(const JsonNode& root, const Record& keys);

}  // namespace loopbench::harness
