// Observers of a run, and the series that they keep.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "harness/config/mechanism_reader.h"
#include "harness/record/record.h"
#include "mechanism/formulation/system.h"

namespace loopbench::harness {

// Values sampled at accepted steps, and the few of them that records keep.

/// A value sampled at accepted steps.
struct TimeSeries {
  std::vector<double> t, value;
};

/// Of the first `samples` (all, unless said) every k-th, k chosen so that at most `points` >= 2
/// remain, always with the last one.
TimeSeries Thin(const TimeSeries& series, int points, std::size_t samples = SIZE_MAX);

/// The largest distance of the first `samples` from the line through those that Thin() keeps.
double LargestGap(const TimeSeries& series, int points, std::size_t samples);

// What is watched along a run. Observers see accepted steps only; each keeps maxima and, where a
// figure needs one, a series, and writes them into the case's record at the end. An observer that
// saw nothing writes nothing: an empty cell is not a zero.

/// An accepted step. The formulation's kinematics, speeds and, but for members of ensembles,
/// accelerations are those of (t, y).
template <class Space>
struct Sample {
  double t = 0.0;
  const System<Space, double>& formulation;
  double supplied = 0.0, dissipated = 0.0;  ///< work since the start [J]
  bool knows_work = true;                   ///< else these two say nothing
};

/// What an analysis needs besides the record.
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
  /// At a state whose accelerations were lost to a singular matrix: only diagnostics are valid.
  virtual void ObserveSingular(const Sample<Space>& /*sample*/) {}
  virtual void Write(Record& record) const = 0;
  virtual void Trace(Traces& /*traces*/) const {}
};

/// What observers may know before the run; all of it outlives them.
template <class Space>
struct Watched {
  const MechanismDescription& description;
  const Mechanism<Space, double>& mechanism;  ///< made of the description
  const SceneObservation& scene;
  int points;                          ///< kept of a series
  std::span<const double> stops = {};  ///< [s], rising: times at which steps have to end
};

/// All observers of a run, in the order of their keys in records: the built-in ones, each a line
/// here (observers.cpp) and a row for each of its keys in the table of measures
/// (harness/record/measures.cpp), then those of other programs (registry.h).
template <class Space>
std::vector<std::unique_ptr<Observer<Space>>> MakeObservers(const Watched<Space>& run);

/// Those of a member of an ensemble, of which largest errors are kept and no more
/// (harness/run/ensemble.h). They ask for positions and speeds of a sample alone.
template <class Space>
std::vector<std::unique_ptr<Observer<Space>>> MakeMemberObservers(const Watched<Space>& run);

/// Drift at position, velocity and acceleration level.
///
/// Position drift is the largest mismatch of a constraint that the coordinate set imposes: of the
/// cut joints in joint coordinates, of every joint in absolute coordinates; points [m] and
/// rotations [rad] apart. Velocity and acceleration drift are the largest V_Q - V_P and A_Q - A_P -
/// g in the constrained directions, points only [m/s, m/s^2].
///
/// Loop closure compares the two sets: the tree of user joints is followed with the joint
/// coordinates (in absolute coordinates: those measured between the bodies), and what a cut joint
/// then misses is its loop's closure, which equals the sum of the mismatches around the loop. In
/// joint coordinates it is the position drift itself; in absolute coordinates mismatches may cancel
/// in it.
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

/// Lengths of accepted steps, and the fastest given function of time: an error estimate sees
/// nothing of what happens between the points that a step looks at. The shortest step is taken
/// without those that a stop time or the end has clipped.
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

/// What projections (levels that leave no drift) took away and what they cost: the largest mismatch
/// of points [m], its series, and Newton steps. Nothing at other levels.
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

/// Smallest rank, reciprocal condition and weight met at accepted steps, and when; how many steps
/// and evaluations were softened, how often the mode changed. `rank_min` is that of the loops, in
/// joint coordinates whatever the set; `rank_constraints_min` that of all constraints of the set,
/// by as much more as it has more speeds than the joints.
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
  std::int64_t softened_steps_ = 0, softened_evaluations_ = 0, mode_changes_ = 0;
};

/// How near the run came to a singular position: the smallest ratio of singular values of the
/// scaled loops (mechanism/loops/scaled_loops.h), at the largest rank met. By Eckart and Young it
/// is the relative distance of the constraints from the nearest ones of lower rank; near a singular
/// position it is about the angle [rad] still to go. At accepted steps only, and only for loops
/// with few rows; redundant rows do not count.
///
/// A step may carry the run across: then the ratio, which has no sign, falls and rises like the
/// absolute value of a line, and its course is straighter with the sign changed on one side. Such
/// passages are counted.
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

/// Distance from what is known of a scene: branch invariants and closed form (mechanism_reader.h).
template <class Space>
class ExactObserver final : public Observer<Space> {
 public:
  ExactObserver(const SceneObservation& scene, const Mechanism<Space, double>& mechanism);
  void Observe(const Sample<Space>& sample) override;
  void Write(Record& record) const override;

  /// The branch combinations at the positions of `kinematics` [rad]; in space up to whole turns of
  /// each body.
  std::vector<double> BranchAt(const Kinematics<Space, double>& kinematics) const;

 private:
  double BodyAngle(const Sample<Space>& sample, int body);

  SceneObservation scene_;
  std::vector<std::vector<std::pair<int, double>>> combinations_;  ///< by body index
  int pendulum_body_ = -1;
  std::vector<double> first_, last_angle_;
  double branch_error_ = 0.0, closed_form_error_ = 0.0;
  double theta0_ = 0.0, omega0_ = 0.0;
  bool started_ = false;
  TimeSeries branch_;
};

/// Joint coordinates against time, of mechanisms with few of them: a series is for a figure.
/// "series.angle.JOINT" [rad] and "series.displacement.JOINT" [m] against "series.t", from the
/// start to the end of the run. Where so few points do not show the motion (a straight line between
/// two of them misses a sample by more than 1 % of all angles or displacements), the same number of
/// points of its first half, quarter, ... that they do show: "series.opening.angle.JOINT" and so on
/// against "series.opening_t".
template <class Space>
class CoordinateObserver final : public Observer<Space> {
 public:
  explicit CoordinateObserver(int points) : points_(points) {}
  void Observe(const Sample<Space>& sample) override;
  void Write(Record& record) const override;

 private:
  /// Whether the points kept of the first `samples` show them, on an axis for all of the group.
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
