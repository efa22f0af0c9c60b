// Observers of a run, and the series that they keep.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "harness/base/record.h"
#include "harness/config/mechanism_reader.h"
#include "mechanism/formulation/system.h"

namespace loopbench::harness {

/// A value sampled at accepted steps.
struct TimeSeries {
  std::vector<double> t, value;

  void Add(double time, double sample) {
    t.push_back(time);
    value.push_back(sample);
  }
};

/// Returns at most `points` >= 2 of the first `samples`, evenly, always with the last one.
TimeSeries Thin(const TimeSeries& series, int points, std::size_t samples = SIZE_MAX);

// Measurements along a run. Observers receive accepted steps only. Each keeps maxima and, for
// figures, a series, and writes them into the case's record at the end. An observer without data
// writes nothing: missing values are not zero.

/// An accepted step. The formulation's kinematics and speeds belong to (t, y); so do its
/// accelerations, except for members of ensembles.
template <class Space>
struct Sample {
  double t = 0.0;
  const System<Space, double>& formulation;
  double supplied = 0.0, dissipated = 0.0;  ///< work since the start [J]
  bool knows_work = true;                   ///< if false, these two are undefined
};

/// Data of an analysis besides the record.
struct Traces {
  TimeSeries drift, correction;       ///< [m]
  TimeSeries energy;                  ///< deviation [J]
  double kinetic = 0.0;               ///< largest [J]
  std::int64_t projection_steps = 0;  ///< Newton steps of projections
};

template <class Space>
class Observer {
 public:
  virtual ~Observer() = default;
  virtual void Observe(const Sample<Space>& sample) = 0;
  /// Observes a state whose singular matrix gave no accelerations: only diagnostics are valid.
  virtual void ObserveSingular(const Sample<Space>& /*sample*/) {}
  virtual void Write(Record& record) const = 0;
  virtual void Trace(Traces& /*traces*/) const {}
};

/// Data available to observers before the run; it outlives them.
template <class Space>
struct Watched {
  const MechanismDescription& description;
  const Mechanism<Space, double>& mechanism;  ///< made of the description
  const ObservedQuantities& problem;
  int points;                          ///< kept of a series
  std::span<const double> stops = {};  ///< [s], rising: times at which steps have to end
};

/// Returns all observers of a run, in the order of their record keys. Built-in observers have a
/// line here (built_in.cpp) and an entry per key in the table of measures
/// (harness/base/measures.cpp). User-defined ones (registry.h) follow. Those of a member of an
/// ensemble keep only largest errors (harness/run/run.h) and need only positions and speeds of a
/// sample.
template <class Space>
std::vector<std::unique_ptr<Observer<Space>>> MakeObservers(const Watched<Space>& run,
                                                            bool is_member);

/// Appends the observers of coordinates, corrections and step lengths (series.cpp).
template <class Space>
void AddSeriesObservers(const Watched<Space>& run,
                        std::vector<std::unique_ptr<Observer<Space>>>* all);

/// The branch combinations at `kinematics` [rad]; in space up to whole turns of each body.
template <class Space>
std::vector<double> BranchAt(const ObservedQuantities& problem,
                             const Kinematics<Space, double>& kinematics);

/// Angle of a pendulum theta'' = -frequency_squared sin(theta) at time t from (theta, omega) at 0:
/// Jacobi elliptic functions, swinging or turning. theta0 in [-pi, pi].
double PendulumAngle(double frequency_squared, double theta0, double omega0, double t);

}  // namespace loopbench::harness
