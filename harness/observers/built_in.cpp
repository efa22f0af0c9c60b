// The built-in observers.
#include <algorithm>
#include <array>
#include <boost/math/special_functions/ellint_1.hpp>
#include <boost/math/special_functions/jacobi_elliptic.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "harness/observers/observer.h"
#include "harness/observers/registry.h"
#include "mechanism/loops/scaled_loops.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench::harness {
namespace {

/// The loops of a mechanism in joint coordinates, whatever coordinates are integrated.
template <class Space>
class JointView {
 public:
  /// Builds the view of `mechanism`, made of `description`; it must outlive the view. Loops have
  /// all constrained directions of their joints, or omit those redundant at every position.
  JointView(const MechanismDescription& description, const Mechanism<Space, double>& mechanism,
            bool with_released)
      : mechanism_(&mechanism) {
    const bool same = !with_released || mechanism.released().empty();
    if (mechanism.coordinates() == Coordinates::kJoint && same) return;
    own_ = std::make_unique<Mechanism<Space, double>>(
        with_released && !description.rounded ? Unreleased(description) : description,
        Coordinates::kJoint);
    mechanism_ = own_.get();
    kinematics_ = std::make_unique<Kinematics<Space, double>>(*own_);
  }

  const Mechanism<Space, double>& mechanism() const { return *mechanism_; }

  /// Current positions: `kinematics` itself in joint coordinates, else the tree of user joints
  /// followed with the coordinates measured between its bodies.
  const Kinematics<Space, double>& At(const Kinematics<Space, double>& kinematics) {
    if (!own_) return kinematics;
    if (!own_->released().empty() && kinematics.released() != kinematics_->released()) {
      kinematics_->Release(kinematics.released());
    }
    kinematics_->SetTime(kinematics.time());
    kinematics_->UpdatePosition(kinematics.CoordinatesIn(*own_));
    return *kinematics_;
  }

 private:
  const Mechanism<Space, double>* mechanism_;
  std::unique_ptr<Mechanism<Space, double>> own_;
  std::unique_ptr<Kinematics<Space, double>> kinematics_;
};

/// Keeps the larger value; NaN stays.
void Keep(double* largest, double value) {
  if (!std::isnan(*largest) && !(value <= *largest)) *largest = value;
}

/// Directions released for the accuracy of the input are open by this many accuracies at most, as
/// long as runs release suitable ones (self_stress.h).
constexpr double kMostOpen = 100.0;

/// Violation of a constraint, with released directions if they are open beyond the accuracy.
template <class Space>
Direction<Space, double> ViolationOf(const Kinematics<Space, double>& kinematics, int index) {
  const Mechanism<Space, double>& mechanism = kinematics.mechanism();
  const Velocity<Space, double> mismatch = kinematics.ConstraintMismatch(index);
  const Direction<Space, double> whole = kinematics.Forbidden(index, mismatch);
  const double most = kMostOpen * mechanism.accuracy();
  const bool is_open =
      !mechanism.released().empty() &&
      (whole.angular.norm() > most || whole.linear.norm() > most * mechanism.length());
  return is_open ? whole : kinematics.Constrained(index, mismatch);
}

/// Largest violation of some joints: points and rotations apart; joint with the worst points.
struct Largest {
  double shift = 0.0, rotation = 0.0;
  int joint = -1;

  template <class Space>
  void Add(const Kinematics<Space, double>& kinematics, int index) {
    const Direction<Space, double> mismatch = ViolationOf(kinematics, index);
    Keep(&rotation, mismatch.angular.norm());
    const double s = mismatch.linear.norm();
    if (joint < 0 || !(s <= shift)) {
      shift = s;
      joint = index;
    }
  }
};

/// A mismatch of a coupling or its rate as a shift of its first joint; angles as arcs at a length.
template <class Space>
double ShiftOf(const Kinematics<Space, double>& kinematics, int coupling, double mismatch,
               double* rotation) {
  const double by = std::abs(kinematics.OfFirstJoint(coupling, mismatch));
  if (!kinematics.FirstTurns(coupling)) return by;
  Keep(rotation, by);
  return by * kinematics.mechanism().length();
}

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
  /// Without a description: watches position drift alone.
  DriftObserver(const Mechanism<Space, double>& mechanism, const MechanismDescription* description)
      : coupling_max_(mechanism.num_coordinate_couplings(), 0.0) {
    if (description != nullptr) rest_.emplace(*description, mechanism);
  }

  void Observe(const Sample<Space>& sample) override {
    const Kinematics<Space, double>& kinematics = sample.formulation.kinematics();
    const Mechanism<Space, double>& mechanism = kinematics.mechanism();
    Largest now;
    for (int index : mechanism.constraints()) now.Add(kinematics, index);
    const std::string* worst = now.joint < 0 ? nullptr : &mechanism.joint_names()[now.joint];
    for (int c = 0; c < mechanism.num_coordinate_couplings(); ++c) {
      const double by = ShiftOf(kinematics, c, kinematics.CouplingMismatch(c), &now.rotation);
      Keep(&coupling_max_[c], by);
      if (by <= now.shift) continue;
      now.shift = by;
      worst = &mechanism.couplings()[c].name;
    }
    if (now.shift > shift_) worst_loop_ = *worst;
    Keep(&shift_, now.shift);
    Keep(&rotation_, now.rotation);
    series_.Add(sample.t, now.shift);
    if (rest_) ObserveRest(sample);
  }

  void Write(Record& record) const override {
    if (series_.t.empty()) return;
    record.Set("drift_position_max", shift_);
    record.Set("drift_rotation_max", rotation_);
    if (!rest_) return;
    record.Set("drift_velocity_max", rest_->velocity);
    record.Set("drift_acceleration_max", rest_->acceleration);
    record.Set("loop_closure_max", rest_->closure);
    record.Set("worst_loop", worst_loop_);
    const Mechanism<Space, double>& loops = rest_->view.mechanism();
    for (const int index : loops.constraints()) {
      record.Set("drift.loop." + loops.joint_names()[index], rest_->loop_max[index]);
    }
    for (std::size_t c = 0; c < coupling_max_.size(); ++c) {
      record.Set("drift.loop." + loops.couplings()[c].name, coupling_max_[c]);
    }
  }

  void Trace(Traces& traces) const override { traces.drift = series_; }

 private:
  /// Measured quantities besides positions.
  struct Rest {
    Rest(const MechanismDescription& description, const Mechanism<Space, double>& mechanism)
        : dynamics(mechanism),
          A(mechanism.num_bodies()),
          view(description, mechanism, true),
          loop_max(mechanism.joints().size(), 0.0) {}

    TreeDynamics<Space, double> dynamics;
    std::vector<Acceleration<Space, double>> A;
    JointView<Space> view;
    std::vector<double> loop_max;
    double velocity = 0.0, acceleration = 0.0, closure = 0.0;
  };

  void ObserveRest(const Sample<Space>& sample) {
    Rest& rest = *rest_;
    const Kinematics<Space, double>& kinematics = sample.formulation.kinematics();
    rest.dynamics.BodyAccelerations(kinematics, sample.formulation.udot(), rest.A);
    for (int index : kinematics.mechanism().constraints()) {
      const auto shift_of = [&](const auto& V) {
        return kinematics.Constrained(index, V).linear.norm();
      };
      Keep(&rest.velocity, shift_of(kinematics.joints()[index].V_rel));
      Keep(&rest.acceleration,
           shift_of(RelativeAcceleration<Space, double>(kinematics, index, rest.A)));
    }
    for (int c = 0; c < kinematics.mechanism().num_coordinate_couplings(); ++c) {
      double rotation = 0.0;
      Keep(&rest.velocity, ShiftOf(kinematics, c, kinematics.CouplingSpeed(c), &rotation));
      const double acceleration =
          CouplingAcceleration<Space, double>(kinematics, c, &sample.formulation.udot(), rest.A);
      Keep(&rest.acceleration, ShiftOf(kinematics, c, acceleration, &rotation));
      Keep(&rest.closure, coupling_max_[c]);
    }
    const Kinematics<Space, double>& closure = rest.view.At(kinematics);
    for (const int index : rest.view.mechanism().constraints()) {
      Largest loop;
      loop.Add(closure, index);
      Keep(&rest.loop_max[index], loop.shift);
      Keep(&rest.closure, loop.shift);
    }
  }

  double shift_ = 0.0, rotation_ = 0.0;
  std::string worst_loop_;
  std::vector<double> coupling_max_;
  TimeSeries series_;
  std::optional<Rest> rest_;  ///< nothing for position drift alone
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
  explicit EnergyObserver(const Watched<Space>& run)
      : points_(run.points), has_power_(run.mechanism.has_power()) {}

  void Observe(const Sample<Space>& sample) override {
    if (!sample.knows_work) return;  // and no balance
    supplied_ = sample.supplied;
    dissipated_ = sample.dissipated;
    const Kinematics<Space, double>& kinematics = sample.formulation.kinematics();
    const auto parts = ComputeEnergy(kinematics);
    const double energy = parts.total() - supplied_ + dissipated_;
    kinetic_ = std::max(kinetic_, parts.kinetic);
    work_ = std::max({work_, std::abs(supplied_), std::abs(dissipated_)});
    if (series_.t.empty()) {
      first_ = energy;
      potential_low_ = potential_high_ = parts.potential;
    }
    potential_low_ = std::min(potential_low_, parts.potential);
    potential_high_ = std::max(potential_high_, parts.potential);
    const Mechanism<Space, double>& mechanism = kinematics.mechanism();
    wrenches_.resize(static_cast<std::size_t>(mechanism.num_bodies()));
    AppliedForces<Space, double>(kinematics, wrenches_);
    double forces = 0.0, momenta = 0.0;
    for (int body = 1; body < mechanism.num_bodies(); ++body) {
      const auto& inertia = mechanism.bodies()[body];
      const auto& V = kinematics.motions()[body];
      forces += wrenches_[static_cast<std::size_t>(body)].norm();
      momenta += inertia.mass * V.linear.norm() +
                 (kinematics.RotationalInertia(inertia, body) * V.angular).norm();
    }
    sensitivity_ = std::max({sensitivity_, forces, momenta});
    Keep(&largest_, std::abs(energy - first_));
    series_.Add(sample.t, energy - first_);
  }

  void Write(Record& record) const override {
    if (series_.t.empty()) return;
    record.Set("energy_error_max", largest_);
    if (kinetic_ > 0.0) record.Set("energy_error_relative", largest_ / kinetic_);
    // an error of a hundredth of the scale is then a thousand round-offs of the potential
    constexpr double kLeast = 1e5 * std::numeric_limits<double>::epsilon();
    record.Set("energy_scale",
               std::max({kinetic_, work_, potential_high_ - potential_low_,
                         kLeast * std::max(std::abs(potential_low_), std::abs(potential_high_))}));
    record.Set("energy_sensitivity", sensitivity_);
    if (has_power_) {
      record.Set("energy_supplied", supplied_);
      record.Set("energy_dissipated", dissipated_);
    }
    const TimeSeries thin = Thin(series_, points_);
    record.Set("series.energy_t", thin.t);
    record.Set("series.energy_error", thin.value);
  }

  void Trace(Traces& traces) const override {
    traces.energy = series_;
    traces.kinetic = kinetic_;
  }

 private:
  int points_;
  bool has_power_;
  double first_ = 0.0, largest_ = 0.0, kinetic_ = 0.0;
  double supplied_ = 0.0, dissipated_ = 0.0, work_ = 0.0;
  double potential_low_ = 0.0, potential_high_ = 0.0, sensitivity_ = 0.0;
  std::vector<Wrench<Space, double>> wrenches_;
  TimeSeries series_;
};

/// Smallest rank, reciprocal condition and weight at accepted steps with their times; numbers of
/// regularized steps and evaluations and of mode changes. `rank_min` is the rank of the loops, in
/// joint coordinates for either set. `rank_constraints_min` is the rank of all constraints of the
/// set, larger by its additional speeds.
template <class Space>
class ConditionObserver final : public Observer<Space> {
 public:
  void Observe(const Sample<Space>& sample) override {
    const Diagnostics diagnostics = sample.formulation.diagnostics();
    rank_min_ = started_ ? std::min(rank_min_, diagnostics.rank) : diagnostics.rank;
    const Mechanism<Space, double>& mechanism = sample.formulation.kinematics().mechanism();
    beyond_joint_speeds_ = mechanism.num_u() - mechanism.num_joint_speeds();
    if (!started_ || diagnostics.rcond < rcond_min_) {
      rcond_min_ = diagnostics.rcond;
      rcond_t_ = sample.t;
    }
    if (diagnostics.smallest_weight < 1.0) ++regularized_steps_;
    regularized_evaluations_ = diagnostics.regularized_evaluations;
    mode_changes_ = diagnostics.mode_changes;
    started_ = true;
  }

  void ObserveSingular(const Sample<Space>& sample) override { Observe(sample); }

  void Write(Record& record) const override {
    if (!started_) return;
    record.Set("rank_min", std::int64_t{rank_min_});
    record.Set("rank_constraints_min", std::int64_t{rank_min_ + beyond_joint_speeds_});
    record.Set("rcond_min", rcond_min_);
    record.Set("rcond_min_t", rcond_t_);
    record.Set("regularized_steps", regularized_steps_);
    record.Set("regularized_evaluations", regularized_evaluations_);
    record.Set("mode_changes", mode_changes_);
  }

 private:
  bool started_ = false;
  int rank_min_ = 0, beyond_joint_speeds_ = 0;
  double rcond_min_ = 1.0, rcond_t_ = 0.0;
  std::int64_t regularized_steps_ = 0, regularized_evaluations_ = 0, mode_changes_ = 0;
};

/// Rows and speeds up to which every accepted step affords a dense decomposition (about 0.1 ms).
constexpr int kMaxRows = 24, kMaxSpeeds = 64;

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
  explicit SingularityObserver(const Watched<Space>& run)
      : view_(run.description, run.mechanism, false) {}  // released rows gain rank as they drift

  void Observe(const Sample<Space>& sample) override {
    const int rows = view_.mechanism().num_equations(), speeds = view_.mechanism().num_u();
    if (rows == 0 || rows > kMaxRows || speeds == 0 || speeds > kMaxSpeeds) return;
    const LoopSpectrum now = SpectrumOfLoops(view_.At(sample.formulation.kinematics()));
    const std::size_t count = static_cast<std::size_t>(now.singular_values.size());
    if (smallest_.empty()) smallest_.assign(count, {1.0, sample.t});
    for (std::size_t i = 0; i < count; ++i) {
      const double ratio = now.singular_values[i] / now.largest;
      if (!(ratio >= smallest_[i].first)) smallest_[i] = {ratio, sample.t};  // NaN too
    }
    if (now.rank > generic_rank_) crossings_ = 0, num_ = 0;  // another quantity from here on
    generic_rank_ = std::max(generic_rank_, now.rank);
    const std::vector<Released>& released = sample.formulation.kinematics().released();
    if (released_ != released) num_ = 0;
    released_ = released;
    if (generic_rank_ == 0) return;
    AddPassage(sample.t, now.singular_values[generic_rank_ - 1] / now.largest);
  }

  void Write(Record& record) const override {
    if (generic_rank_ == 0) return;
    const auto& [ratio, t] = smallest_[static_cast<std::size_t>(generic_rank_) - 1];
    record.Set("singularity_distance_min", ratio);
    record.Set("singularity_distance_min_t", t);
    record.Set("singularity_crossings", crossings_);
  }

 private:
  /// Counts zero crossings of a quantity of which only the absolute value is known.
  void AddPassage(double t, double size) {
    // at the position itself once, however long the run stays
    if (size < kRankRatio) {
      if (num_ == 0 || size_[num_ - 1] >= kRankRatio) ++crossings_;
      num_ = 0;
    } else if (num_ == 2 && t > t_[1]) {
      const double a = (size_[1] - size_[0]) / (t_[1] - t_[0]), b = (size - size_[1]) / (t - t_[1]);
      // slopes with the sign changed behind the first sample, or behind the second
      const double a_turned = -(size_[1] + size_[0]) / (t_[1] - t_[0]);
      const double b_turned = -(size + size_[1]) / (t - t_[1]);
      const double bend = std::min(std::abs(-b - a_turned), std::abs(b_turned - a));
      if (a <= 0.0 && b >= 0.0 && bend < std::abs(b - a)) ++crossings_;
    }
    if (num_ == 2) {
      t_[0] = t_[1];
      size_[0] = size_[1];
      num_ = 1;
    }
    t_[num_] = t;
    size_[num_++] = size;
  }

  JointView<Space> view_;
  /// Per singular value, the largest first: smallest ratio to the largest, and its time.
  std::vector<std::pair<double, double>> smallest_;
  int generic_rank_ = 0;
  std::vector<Released> released_;            ///< of the last sample
  std::array<double, 2> t_ = {}, size_ = {};  ///< the last samples of the quantity
  std::size_t num_ = 0;                       ///< number of them
  std::int64_t crossings_ = 0;
};

/// Angle of a body of a planar problem, in space about z up to whole turns.
template <class Space>
double AngleOf(const Kinematics<Space, double>& kinematics, int body) {
  const Pose<Space, double>& X = kinematics.poses()[body];
  if constexpr (Space::kRot == 1) {
    return X.angle;
  } else {
    return std::atan2(X.R(1, 0), X.R(0, 0));
  }
}

template <class Space>
int BodyNamed(const Mechanism<Space, double>& mechanism, const std::string& name) {
  const auto it = std::ranges::find(mechanism.body_names(), name);
  return static_cast<int>(it - mechanism.body_names().begin());
}

/// Distance from a problem's known solution: branch invariants, closed form (mechanism_reader.h).
template <class Space>
class ExactObserver final : public Observer<Space> {
 public:
  explicit ExactObserver(const Watched<Space>& run)
      : problem_(run.problem), last_angle_(run.mechanism.num_bodies(), 0.0) {
    for (const AngleCombination& combination : problem_.branch_invariants) {
      combinations_.emplace_back();
      for (const auto& [name, factor] : combination) {
        combinations_.back().emplace_back(BodyNamed(run.mechanism, name), factor);
      }
    }
    if (problem_.closed_form) {
      pendulum_body_ = BodyNamed(run.mechanism, problem_.closed_form->body);
    }
  }

  void Observe(const Sample<Space>& sample) override {
    double worst = 0.0;
    for (std::size_t c = 0; c < combinations_.size(); ++c) {
      double value = 0.0;
      for (const auto& [body, factor] : combinations_[c]) value += factor * BodyAngle(sample, body);
      if (!started_) first_.push_back(value);
      worst = std::max(worst, std::abs(value - first_[c]));
    }
    branch_error_ = std::max(branch_error_, worst);
    if (!combinations_.empty()) branch_.Add(sample.t, worst);
    if (pendulum_body_ >= 0) {
      const PendulumForm& form = *problem_.closed_form;
      const double theta = BodyAngle(sample, pendulum_body_) - form.down_angle;
      if (!started_) {
        theta0_ = theta;
        omega0_ = sample.formulation.kinematics().motions()[pendulum_body_][Space::kRot - 1];
      }
      // the closed form takes an angle within half a turn; whole turns go along unchanged
      const double within = std::remainder(theta0_, 2 * std::numbers::pi);
      const double exact =
          theta0_ - within + PendulumAngle(form.frequency_squared, within, omega0_, sample.t);
      closed_form_error_ = std::max(closed_form_error_, std::abs(theta - exact));
    }
    started_ = true;
  }

  void Write(Record& record) const override {
    if (!started_) return;
    if (!combinations_.empty()) {
      record.Set("branch_error_max", branch_error_);
      const TimeSeries thin = Thin(branch_, 200);
      record.Set("series.branch_t", thin.t);
      record.Set("series.branch", thin.value);
    }
    if (pendulum_body_ >= 0) record.Set("closed_form_error_max", closed_form_error_);
  }

 private:
  double BodyAngle(const Sample<Space>& sample, int body) {
    const double angle = AngleOf(sample.formulation.kinematics(), body);
    if (Space::kRot == 1) return angle;
    // continued from step to step
    last_angle_[body] += std::remainder(angle - last_angle_[body], 2 * std::numbers::pi);
    return last_angle_[body];
  }

  const ObservedQuantities& problem_;
  std::vector<std::vector<std::pair<int, double>>> combinations_;  ///< by body index
  int pendulum_body_ = -1;
  std::vector<double> first_, last_angle_;
  double branch_error_ = 0.0, closed_form_error_ = 0.0;
  double theta0_ = 0.0, omega0_ = 0.0;
  bool started_ = false;
  TimeSeries branch_;
};

}  // namespace

template <class Space>
std::vector<double> BranchAt(const ObservedQuantities& problem,
                             const Kinematics<Space, double>& kinematics) {
  std::vector<double> branch;
  for (const AngleCombination& combination : problem.branch_invariants) {
    double& value = branch.emplace_back(0.0);
    for (const auto& [name, factor] : combination) {
      value += factor * AngleOf(kinematics, BodyNamed(kinematics.mechanism(), name));
    }
  }
  return branch;
}

template <class Space>
std::vector<std::unique_ptr<Observer<Space>>> MakeObservers(const Watched<Space>& run,
                                                            bool is_member) {
  std::vector<std::unique_ptr<Observer<Space>>> all;
  all.push_back(std::make_unique<DriftObserver<Space>>(run.mechanism,
                                                       is_member ? nullptr : &run.description));
  all.push_back(std::make_unique<EnergyObserver<Space>>(run));
  if (!is_member) {
    all.push_back(std::make_unique<ConditionObserver<Space>>());
    all.push_back(std::make_unique<SingularityObserver<Space>>(run));
  }
  all.push_back(std::make_unique<ExactObserver<Space>>(run));
  if (is_member) return all;
  AddSeriesObservers(run, &all);
  for (const ObserverRow& row : RegisteredObservers()) all.push_back(row.Make(run));
  return all;
}

#define LOOPBENCH_INSTANTIATE(Space)                                       \
  template std::vector<double> BranchAt(const ObservedQuantities&,         \
                                        const Kinematics<Space, double>&); \
  template std::vector<std::unique_ptr<Observer<Space>>> MakeObservers(const Watched<Space>&, bool);
LOOPBENCH_INSTANTIATE(Planar)
LOOPBENCH_INSTANTIATE(Spatial)
#undef LOOPBENCH_INSTANTIATE

// With k^2 = sin^2(theta0/2) + omega0^2 / (4 w^2), w^2 = frequency_squared:
//   swinging (k < 1)   sin(theta/2) = k sn(w t + a, k),     sin(theta0/2) = k sn(a, k)
//   turning  (k > 1)   theta/2 = am(k w t + a, 1/k),        theta0/2 = am(a, 1/k)
// (Whittaker, Analytical Dynamics, section 44), and on the separatrix, where sn is tanh and am its
// arcsine,
//   k = 1              sin(theta/2) = tanh(w t + a),        sin(theta0/2) = tanh(a).
// Motions with omega0 < 0 are mirrored, so that no quarter period enters `a`: near the separatrix
// it grows without bound and is poorly known.
double PendulumAngle(double frequency_squared, double theta0, double omega0, double t) {
  if (omega0 < 0) return -PendulumAngle(frequency_squared, -theta0, -omega0, t);
  const double w = std::sqrt(frequency_squared);
  const double s0 = std::sin(theta0 / 2), v0 = omega0 / (2 * w);
  const double k = std::hypot(s0, v0);
  if (k == 0.0) return 0.0;
  if (k == 1.0) return 2 * std::asin(std::tanh(w * t + std::atanh(s0)));
  if (k < 1.0) {
    // sn(a) = s0 / k, and cn(a) has the sign of the speed
    const double a = boost::math::ellint_1(k, std::atan2(s0 / k, v0 / k));
    return 2 * std::asin(k * boost::math::jacobi_sn(k, w * t + a));
  }
  const double modulus = 1 / k;
  const double a = boost::math::ellint_1(modulus, theta0 / 2);
  const double x = k * w * t + a;
  double cn, dn;
  const double sn = boost::math::jacobi_elliptic(modulus, x, &cn, &dn);
  // am(x) grows by pi with every 2 K; sn and cn give it modulo 2 pi
  const double turns = std::round(x / (4 * boost::math::ellint_1(modulus)));
  return 2 * (std::atan2(sn, cn) + 2 * std::numbers::pi * turns);
}

}  // namespace loopbench::harness
