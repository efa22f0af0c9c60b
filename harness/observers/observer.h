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

// Values sampled at accepted steps, and the few of them that records keep.

/// A value sampled at accepted steps.
struct TimeSeries {
  std::vector<double> t, value;
};

/// Returns every k-th of the first `samples` (default: all), with k such that at most `points` >= 2
/// remain. Always includes the last one.
TimeSeries Thin(const TimeSeries& series, int points, std::size_t samples = SIZE_MAX);

/// The largest distance of the first `samples` from the line through those that Thin() keeps.
double LargestGap(const TimeSeries& series, int points, std::size_t samples);

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
/// line here (observers.cpp) and an entry per key in the table of measures
/// (harness/base/measures.cpp). User-defined ones (registry.h) follow.
template <class Space>
std::vector<std::unique_ptr<Observer<Space>>> MakeObservers(const Watched<Space>& run);

/// Returns the observers of an ensemble member; they keep only largest errors
/// (harness/run/run.h) and need only positions and speeds of a sample.
template <class Space>
std::vector<std::unique_ptr<Observer<Space>>> MakeMemberObservers(const Watched<Space>& run);

/// Drift at position, velocity and acceleration level.
///
/// Position drift is the largest violation of a constraint imposed by the coordinate set: cut
/// joints in joint coordinates, every joint in absolute coordinates; points [m] and rotations [rad]
/// apart. Velocity and acceleration drift are the largest V_Q - V_P and A_Q - A_P - g in the
/// constrained directions, points only [m/s, m/s^2].
///
/// Loop closure compares the two sets. The tree of user joints follows the joint coordinates (in
/// absolute coordinates: those measured between the bodies). The violation at a cut joint then is
/// its loop's closure error, the sum of the violations around the loop. In joint coordinates it
/// equals the position drift; in absolute coordinates violations may cancel.
template <class Space>
class DriftObserver final : public Observer<Space> {
 public:
  /// Watches position drift alone.
  DriftObserver();
  DriftObserver(const MechanismDescription& description, const Mechanism<Space, double>& mechanism);
  ~DriftObserver() override;
  void Observe(const Sample<Space>& sample) override;
  void Write(Record& record) const override;
  void Trace(Traces& traces) const override { traces.drift = series_; }

 private:
  struct Rest;
  void ObserveRest(const Sample<Space>& sample);

  double shift_ = 0.0, rotation_ = 0.0;
  std::string worst_loop_;
  TimeSeries series_;
  std::unique_ptr<Rest> rest_;  ///< null for position drift alone
};

/// Energy balance: the largest deviation of
///   kinetic + potential - work supplied + work dissipated
/// from its first value [J], and its series. Without power, the deviation of the total energy. The
/// relative error compares it with the largest kinetic energy. The energy that moves is the largest
/// of kinetic energy, span of the potential, and work supplied or dissipated, since slow motions
/// have little kinetic energy. It is at least the rounding error of the potential, so that rest is
/// no error. The sensitivity is the largest change of energy, to first order, by errors of 1 m and
/// 1 rad, or of 1 m/s and 1 rad/s, of all bodies. It is the largest sum of applied wrenches, or of
/// momenta.
template <class Space>
class EnergyObserver final : public Observer<Space> {
 public:
  EnergyObserver(int points, bool has_power) : points_(points), has_power_(has_power) {}
  void Observe(const Sample<Space>& sample) override;
  void Write(Record& record) const override;
  void Trace(Traces& traces) const override {
    traces.energy = series_;
    traces.kinetic = kinetic_;
  }

 private:
  int points_;
  bool has_power_;
  bool started_ = false;
  double first_ = 0.0, largest_ = 0.0, kinetic_ = 0.0;
  double supplied_ = 0.0, dissipated_ = 0.0, work_ = 0.0;
  double potential_low_ = 0.0, potential_high_ = 0.0, sensitivity_ = 0.0;
  std::vector<Wrench<Space, double>> wrenches_;
  TimeSeries series_;
};

/// Lengths of accepted steps, and the fastest prescribed function of time: an error estimate does
/// not detect events between the points of a step. The shortest step excludes those clipped by a
/// stop time or the end.
template <class Space>
class StepLengthObserver final : public Observer<Space> {
 public:
  explicit StepLengthObserver(const Watched<Space>& run);
  void Observe(const Sample<Space>& sample) override;
  void Write(Record& record) const override;

 private:
  std::vector<double> stops_;    ///< [s], rising
  double fastest_ = 0.0;         ///< [rad/s]
  double t_ = 0.0, last_ = 0.0;  ///< of the last step, which the end may have clipped
  double longest_ = 0.0, shortest_ = 0.0, shortest_t_ = 0.0;
};

/// The largest angular frequency [rad/s] of prescribed motions and of forces that are harmonic in
/// time; 0 without any. Tables have knots, at which steps end.
double FastestDrive(const MechanismDescription& description);

/// Corrections and cost of projections (levels without drift): the largest violation of points [m],
/// its series, and Newton steps. Writes nothing at other levels.
template <class Space>
class CorrectionObserver final : public Observer<Space> {
 public:
  void Observe(const Sample<Space>& sample) override;
  void Write(Record& record) const override;
  void Trace(Traces& traces) const override {
    traces.correction = series_;
    traces.projection_steps = iterations_;
  }

 private:
  double largest_ = 0.0;
  std::int64_t iterations_ = 0;
  TimeSeries series_;
};

/// Smallest rank, reciprocal condition and weight at accepted steps with their times; numbers of
/// regularized steps and evaluations and of mode changes. `rank_min` is the rank of the loops, in
/// joint coordinates for either set. `rank_constraints_min` is the rank of all constraints of the
/// set, larger by its additional speeds.
template <class Space>
class ConditionObserver final : public Observer<Space> {
 public:
  void Observe(const Sample<Space>& sample) override;
  void ObserveSingular(const Sample<Space>& sample) override { Observe(sample); }
  void Write(Record& record) const override;

 private:
  bool started_ = false;
  int rank_min_ = 0, beyond_joint_speeds_ = 0;
  double rcond_min_ = 1.0, rcond_t_ = 0.0;
  std::int64_t regularized_steps_ = 0, regularized_evaluations_ = 0, mode_changes_ = 0;
};

/// Distance from a singular configuration: the smallest ratio of singular values of the scaled
/// loops (mechanism/loops/scaled_loops.h), at the largest rank met. By Eckart and Young it is the
/// relative distance of the constraints from the nearest ones of lower rank. Near a singular
/// configuration it is about the remaining angle [rad]. At accepted steps only, for loops with few
/// rows; redundant rows do not count.
///
/// A step may cross the singular configuration. The ratio has no sign and then falls and rises like
/// an absolute value; with the sign changed on one side, its course is straighter. Such crossings
/// are counted.
template <class Space>
class SingularityObserver final : public Observer<Space> {
 public:
  SingularityObserver(const MechanismDescription& description,
                      const Mechanism<Space, double>& mechanism);
  ~SingularityObserver() override;
  void Observe(const Sample<Space>& sample) override;
  void Write(Record& record) const override;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

/// Distance from a problem's known solution: branch invariants, closed form (mechanism_reader.h).
template <class Space>
class ExactObserver final : public Observer<Space> {
 public:
  ExactObserver(const ObservedQuantities& problem, const Mechanism<Space, double>& mechanism);
  void Observe(const Sample<Space>& sample) override;
  void Write(Record& record) const override;

  /// The branch combinations at the positions of `kinematics` [rad]; in space up to whole turns of
  /// each body.
  std::vector<double> BranchAt(const Kinematics<Space, double>& kinematics) const;

 private:
  double BodyAngle(const Sample<Space>& sample, int body);

  ObservedQuantities problem_;
  std::vector<std::vector<std::pair<int, double>>> combinations_;  ///< by body index
  int pendulum_body_ = -1;
  std::vector<double> first_, last_angle_;
  double branch_error_ = 0.0, closed_form_error_ = 0.0;
  double theta0_ = 0.0, omega0_ = 0.0;
  bool started_ = false;
  TimeSeries branch_;
};

/// Joint coordinates over time, of mechanisms with few of them, for figures: "series.angle.JOINT"
/// [rad] and "series.displacement.JOINT" [m] over "series.t", for the whole run. These few points
/// may not show the motion: a straight line between two of them misses a sample by more than 1 % of
/// all angles or displacements. Then the same number of points covers its first half, quarter, ...
/// that they do show: "series.opening.angle.JOINT" and so on over "series.opening_t".
template <class Space>
class CoordinateObserver final : public Observer<Space> {
 public:
  explicit CoordinateObserver(int points) : points_(points) {}
  void Observe(const Sample<Space>& sample) override;
  void Write(Record& record) const override;

 private:
  /// Returns true if the points kept of the first `samples` show them, on the group's common axis.
  bool Shows(const std::vector<std::size_t>& group, std::size_t samples) const;
  void WriteOpening(std::size_t samples, const std::string& prefix, const std::string& time,
                    Record& record) const;

  int points_;
  std::vector<std::string> keys_;             ///< "angle.crank", as their series
  std::vector<std::size_t> angles_, shifts_;  ///< which series are
  std::vector<TimeSeries> series_;
};

/// Angle of a pendulum theta'' = -frequency_squared sin(theta) at time t from (theta, omega) at 0:
/// Jacobi elliptic functions, swinging or turning. theta0 in [-pi, pi].
double PendulumAngle(double frequency_squared, double theta0, double omega0, double t);

}  // namespace loopbench::harness
