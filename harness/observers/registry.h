// User-defined observers. A program registers them before it calls loopbench::Main():
//
//   harness::RegisterObserver(harness::ObserverRowOf<Turns>(
//       "turns", "how far bodies turn.",
//       {{"turns_max", kNumber, {"largest turn", "rad", kScientific}, {kLargest}, kError}}));
//
// They observe every accuracy run except members of ensembles. Their keys are measures like all
// others (record.h): records contain them, drift.csv has their headings, and `compare` judges
// those with a rule.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "harness/base/record.h"
#include "harness/observers/observer.h"
#include "mechanism/simplify/compile.h"

namespace loopbench::harness {

/// Makes an observer of a run, which outlives it.
template <class Space>
using ObserverFactory = std::function<std::unique_ptr<Observer<Space>>(const Watched<Space>&)>;

struct ObserverRow {
  std::string name;      ///< a word: a-z, 0-9, '-' and '_'
  std::string sentence;  ///< text of `explain`, after "name: "
  ObserverFactory<Planar> planar;
  ObserverFactory<Spatial> spatial;
  std::vector<Measure> measures;  ///< an entry for each key that it writes, and no other keys

  std::unique_ptr<Observer<Planar>> Make(const Watched<Planar>& run) const { return planar(run); }
  std::unique_ptr<Observer<Spatial>> Make(const Watched<Spatial>& run) const {
    return spatial(run);
  }
};

/// Returns the entry of a class template derived from Observer<Space>, built per run.
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

/// Returns the entries in registration order. References stay valid.
const std::deque<ObserverRow>& RegisteredObservers();

// Final poses of the user's bodies, independent of preprocessing.

/// Writes "series.final.<body>" for the bodies of `part`, at most kMaxFinalBodies of the whole
/// mechanism, evenly chosen: of a planar mechanism x, y [m] of the body's origin and its angle
/// [rad] with all its turns; in space x, y, z and the body's first two axes in ground axes, where
/// whole turns do not show.
inline constexpr std::size_t kMaxFinalBodies = 100;
template <class Space>
void WriteFinalPoses(const MechanismDescription& user, const Compiled& compiled, int part,
                     const Kinematics<Space, double>& kinematics, Record& record);

}  // namespace loopbench::harness
