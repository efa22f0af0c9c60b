// Observers of other programs. One registers its own before it calls loopbench::Main():
//
//   harness::RegisterObserver(harness::ObserverRowOf<Turns>(
//       "turns", "how far bodies turn.",
//       {{"turns_max", kNumber, {"largest turn", "rad", kScientific}, {kLargest}, kError}}));
//
// It then watches every accuracy run but the members of ensembles. Its keys are measures like all
// others (measures.h): they stand in records, with words for a heading in drift.csv, and `compare`
// judges those that have a rule.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "harness/observers/observer.h"
#include "harness/record/measures.h"
#include "harness/record/record.h"
#include "mechanism/simplify/compile.h"

namespace loopbench::harness {

/// Makes an observer of a run, which outlives it.
template <class Space>
using ObserverFactory = std::function<std::unique_ptr<Observer<Space>>(const Watched<Space>&)>;

struct ObserverRow {
  std::string name;      ///< a word: a-z, 0-9, '-' and '_'
  std::string sentence;  ///< what `explain` says of it, after "name: "
  ObserverFactory<Planar> planar;
  ObserverFactory<Spatial> spatial;
  std::vector<Measure> measures;  ///< a row for each key that it writes, and no other keys

  std::unique_ptr<Observer<Planar>> Make(const Watched<Planar>& run) const { return planar(run); }
  std::unique_ptr<Observer<Spatial>> Make(const Watched<Spatial>& run) const {
    return spatial(run);
  }
};

/// The row of a class template derived from Observer<Space>, made from what may be known of a run.
template <template <class Space> class Own>
ObserverRow ObserverRowOf(std::string name, std::string sentence, std::vector<Measure> measures) {
  const auto make = []<class Space>(const Watched<Space>& run) {
    return std::unique_ptr<Observer<Space>>(std::make_unique<Own<Space>>(run));
  };
  return {std::move(name), std::move(sentence), make, make, std::move(measures)};
}

/// Adds an observer and its measures; not while experiments run. Throws std::invalid_argument for a
/// row that is not sound (mechanism/description/registration.h), and for a measure that cannot be
/// (AddMeasures()): then nothing is added.
void RegisterObserver(ObserverRow row, int alignment = EIGEN_MAX_STATIC_ALIGN_BYTES);

/// In the order of their registration. Rows stay where they are.
const std::deque<ObserverRow>& RegisteredObservers();

// Where a run ended: the poses of the user's bodies, whatever was simplified for it.

/// Writes "series.final.<body>" for the bodies of `part`, at most kMostFinalBodies of the whole
/// mechanism, evenly chosen: of a planar mechanism x, y [m] of the body's origin and its angle
/// [rad] with all its turns; in space x, y, z and the body's first two axes in ground axes, where
/// whole turns do not show.
inline constexpr std::size_t kMostFinalBodies = 100;
template <class Space>
void WriteFinalPoses(const MechanismDescription& user, const Compiled& compiled, int part,
                     const Kinematics<Space, double>& kinematics, Record& record);

}  // namespace loopbench::harness
