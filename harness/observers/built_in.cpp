// The built-in observers: drift, errors against closed forms, coordinates, nearness to singular
// positions, steps.
#include <algorithm>
#include <array>
#include <boost/math/special_functions/ellint_1.hpp>
#include <boost/math/special_functions/jacobi_elliptic.hpp>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "harness/observers/observer.h"
#include "mechanism/loops/scaled_loops.h"
#include "mechanism/loops/tree_dynamics.h"
#include "mechanism/model/kinematics.h"

namespace loopbench::harness {
// The loops of a mechanism in joint coordinates, whatever coordinates are integrated.

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

namespace {

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

/// A mismatch of a coupling or its rate as a shift of its first joint's coordinate; angles count as
/// arcs at the length of the mechanism.
template <class Space>
double ShiftOf(const Kinematics<Space, double>& kinematics, int coupling, double mismatch,
               double* rotation) {
  const double by = std::abs(kinematics.OfFirstJoint(coupling, mismatch));
  if (!kinematics.FirstTurns(coupling)) return by;
  Keep(rotation, by);
  return by * kinematics.mechanism().length();
}

}  // namespace

/// Measured quantities besides positions.
template <class Space>
struct DriftObserver<Space>::Rest {
  Rest(const MechanismDescription& description, const Mechanism<Space, double>& mechanism)
      : dynamics(mechanism),
        A(mechanism.num_bodies()),
        view(description, mechanism, true),
        loop_max(mechanism.joints().size(), 0.0) {
    for (int index : view.mechanism().constraints()) {
      loop_names.emplace_back(index, view.mechanism().joint_names()[index]);
    }
    coupling_max.assign(mechanism.num_coordinate_couplings(), 0.0);
  }

  TreeDynamics<Space, double> dynamics;
  std::vector<Acceleration<Space, double>> A;
  JointView<Space> view;
  std::vector<std::pair<int, std::string>> loop_names;
  std::vector<double> loop_max, coupling_max;
  double velocity = 0.0, acceleration = 0.0, closure = 0.0;
};

template <class Space>
DriftObserver<Space>::DriftObserver() = default;

template <class Space>
DriftObserver<Space>::DriftObserver(const MechanismDescription& description,
                                    const Mechanism<Space, double>& mechanism)
    : rest_(std::make_unique<Rest>(description, mechanism)) {}

template <class Space>
DriftObserver<Space>::~DriftObserver() = default;

template <class Space>
void DriftObserver<Space>::Observe(const Sample<Space>& sample) {
  const Kinematics<Space, double>& kinematics = sample.formulation.kinematics();
  Largest now;
  for (int index : kinematics.mechanism().constraints()) now.Add(kinematics, index);
  const std::string* worst =
      now.joint < 0 ? nullptr : &kinematics.mechanism().joint_names()[now.joint];
  for (int c = 0; c < kinematics.mechanism().num_coordinate_couplings(); ++c) {
    const double by = ShiftOf(kinematics, c, kinematics.CouplingMismatch(c), &now.rotation);
    if (rest_ != nullptr) Keep(&rest_->coupling_max[c], by);
    if (by <= now.shift) continue;
    now.shift = by;
    worst = &kinematics.mechanism().couplings()[c].name;
  }
  if (now.shift > shift_) worst_loop_ = *worst;
  Keep(&shift_, now.shift);
  Keep(&rotation_, now.rotation);
  series_.t.push_back(sample.t);
  series_.value.push_back(now.shift);
  if (rest_ != nullptr) ObserveRest(sample);
}

template <class Space>
void DriftObserver<Space>::ObserveRest(const Sample<Space>& sample) {
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
    Keep(&rest.closure, rest.coupling_max[c]);
  }
  const Kinematics<Space, double>& closure = rest.view.At(kinematics);
  for (const auto& [index, name] : rest.loop_names) {
    Largest loop;
    loop.Add(closure, index);
    Keep(&rest.loop_max[index], loop.shift);
    Keep(&rest.closure, loop.shift);
  }
}

template <class Space>
void DriftObserver<Space>::Write(Record& record) const {
  if (series_.t.empty()) return;
  record.Set("drift_position_max", shift_);
  record.Set("drift_rotation_max", rotation_);
  if (rest_ == nullptr) return;
  record.Set("drift_velocity_max", rest_->velocity);
  record.Set("drift_acceleration_max", rest_->acceleration);
  record.Set("loop_closure_max", rest_->closure);
  record.Set("worst_loop", worst_loop_);
  for (const auto& [index, name] : rest_->loop_names) {
    record.Set("drift.loop." + name, rest_->loop_max[index]);
  }
  for (std::size_t c = 0; c < rest_->coupling_max.size(); ++c) {
    record.Set("drift.loop." + rest_->view.mechanism().couplings()[c].name, rest_->coupling_max[c]);
  }
}

template class DriftObserver<Planar>;
template class DriftObserver<Spatial>;

template <class Space>
ExactObserver<Space>::ExactObserver(const ObservedQuantities& problem,
                                    const Mechanism<Space, double>& mechanism)
    : problem_(problem) {
  const auto find = [&](const std::string& name) {
    const auto it = std::ranges::find(mechanism.body_names(), name);
    return static_cast<int>(it - mechanism.body_names().begin());
  };
  for (const AngleCombination& combination : problem.branch_invariants) {
    combinations_.emplace_back();
    for (const auto& [name, factor] : combination) {
      combinations_.back().emplace_back(find(name), factor);
    }
  }
  if (problem.closed_form) pendulum_body_ = find(problem.closed_form->body);
  last_angle_.assign(mechanism.num_bodies(), 0.0);
}

namespace {

// For planar problems, in space the angle about z.
template <class Space>
double AngleOf(const Pose<Space, double>& X) {
  if constexpr (Space::kRot == 1) {
    return X.angle;
  } else {
    return std::atan2(X.R(1, 0), X.R(0, 0));
  }
}

}  // namespace

template <class Space>
std::vector<double> ExactObserver<Space>::BranchAt(
    const Kinematics<Space, double>& kinematics) const {
  std::vector<double> branch;
  for (const auto& combination : combinations_) {
    double value = 0.0;
    for (const auto& [body, factor] : combination) {
      value += factor * AngleOf<Space>(kinematics.poses()[body]);
    }
    branch.push_back(value);
  }
  return branch;
}

template <class Space>
double ExactObserver<Space>::BodyAngle(const Sample<Space>& sample, int body) {
  const double angle = AngleOf<Space>(sample.formulation.kinematics().poses()[body]);
  if constexpr (Space::kRot == 1) {
    return angle;
  } else {
    // continued from step to step
    const double turn = 2 * std::numbers::pi;
    last_angle_[body] += std::remainder(angle - last_angle_[body], turn);
    return last_angle_[body];
  }
}

template <class Space>
void ExactObserver<Space>::Observe(const Sample<Space>& sample) {
  double worst = 0.0;
  for (std::size_t c = 0; c < combinations_.size(); ++c) {
    double value = 0.0;
    for (const auto& [body, factor] : combinations_[c]) value += factor * BodyAngle(sample, body);
    if (!started_) first_.push_back(value);
    worst = std::max(worst, std::abs(value - first_[c]));
  }
  branch_error_ = std::max(branch_error_, worst);
  if (!combinations_.empty()) {
    branch_.t.push_back(sample.t);
    branch_.value.push_back(worst);
  }
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

template <class Space>
void ExactObserver<Space>::Write(Record& record) const {
  if (!started_) return;
  if (!combinations_.empty()) {
    record.Set("branch_error_max", branch_error_);
    const TimeSeries thin = Thin(branch_, 200);
    record.Set("series.branch_t", thin.t);
    record.Set("series.branch", thin.value);
  }
  if (pendulum_body_ >= 0) record.Set("closed_form_error_max", closed_form_error_);
}

template class ExactObserver<Planar>;
template class ExactObserver<Spatial>;

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

template <class Space>
void CoordinateObserver<Space>::Observe(const Sample<Space>& sample) {
  const Kinematics<Space, double>& kinematics = sample.formulation.kinematics();
  const auto& joints = kinematics.mechanism().joints();
  constexpr std::size_t kMaxJoints = 1000;
  if (joints.size() > kMaxJoints) return;
  const bool first = series_.empty();
  std::size_t s = 0;
  for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
    if (joints[j].description < 0 || joints[j].kind->num_u != 1) continue;
    if (first) {
      // motions have their rotations first; a helix is measured by its angle
      const bool shifts = joints[j].kind->axes[0] >= Space::kRot;
      keys_.push_back((shifts ? "displacement." : "angle.") +
                      kinematics.mechanism().joint_names()[j]);
      (shifts ? shifts_ : angles_).push_back(s);
      series_.emplace_back();
    }
    series_[s].t.push_back(sample.t);
    series_[s].value.push_back(kinematics.JointCoordinate(j));
    ++s;
  }
}

template <class Space>
void CoordinateObserver<Space>::WriteOpening(std::size_t samples, const std::string& prefix,
                                             const std::string& time, Record& record) const {
  for (std::size_t s = 0; s < series_.size(); ++s) {
    const TimeSeries thin = Thin(series_[s], points_, samples);
    if (s == 0) record.Set(time, thin.t);
    record.Set(prefix + keys_[s], thin.value);
  }
}

template <class Space>
bool CoordinateObserver<Space>::Shows(const std::vector<std::size_t>& group,
                                      std::size_t samples) const {
  if (samples <= static_cast<std::size_t>(points_)) return true;
  // a hundredth of the axis is four pixels of a figure
  constexpr double kVisible = 0.01;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const std::size_t s : group) {
    for (std::size_t i = 0; i < samples; ++i) {
      low = std::min(low, series_[s].value[i]);
      high = std::max(high, series_[s].value[i]);
    }
  }
  return std::ranges::all_of(group, [&](std::size_t s) {
    return LargestGap(series_[s], points_, samples) <= kVisible * (high - low);
  });
}

template <class Space>
void CoordinateObserver<Space>::Write(Record& record) const {
  if (series_.empty()) return;
  const std::size_t all = series_[0].t.size();
  WriteOpening(all, "series.", "series.t", record);
  std::size_t shown = all;
  while (!Shows(angles_, shown) || !Shows(shifts_, shown)) shown /= 2;
  if (shown < all) WriteOpening(shown, "series.opening.", "series.opening_t", record);
}

template class CoordinateObserver<Planar>;
template class CoordinateObserver<Spatial>;

namespace {

/// Rows and speeds up to which every accepted step affords a dense decomposition (about 0.1 ms).
constexpr int kMaxRows = 24, kMaxSpeeds = 64;

/// Counts the zeros that a quantity passed of which only the size is seen, sample by sample.
class Passages {
 public:
  void Add(double t, double size) {
    // at the position itself once, however long the run stays
    if (size < kRankRatio) {
      if (num_ == 0 || size_[num_ - 1] >= kRankRatio) ++count_;
      num_ = 0;
    } else if (num_ == 2 && t > t_[1]) {
      const double a = (size_[1] - size_[0]) / (t_[1] - t_[0]), b = (size - size_[1]) / (t - t_[1]);
      // slopes with the sign changed behind the first sample, or behind the second
      const double a_turned = -(size_[1] + size_[0]) / (t_[1] - t_[0]);
      const double b_turned = -(size + size_[1]) / (t - t_[1]);
      const double bend = std::min(std::abs(-b - a_turned), std::abs(b_turned - a));
      if (a <= 0.0 && b >= 0.0 && bend < std::abs(b - a)) ++count_;
    }
    if (num_ == 2) {
      t_[0] = t_[1];
      size_[0] = size_[1];
      num_ = 1;
    }
    t_[num_] = t;
    size_[num_++] = size;
  }
  /// The next value is of another quantity.
  void Forget() { num_ = 0; }
  std::int64_t count() const { return count_; }

 private:
  std::array<double, 2> t_ = {}, size_ = {};
  std::size_t num_ = 0;
  std::int64_t count_ = 0;
};

}  // namespace

template <class Space>
struct SingularityObserver<Space>::Work {
  Work(const MechanismDescription& description, const Mechanism<Space, double>& mechanism)
      : view(description, mechanism, false) {}  // released rows gain rank as they drift

  JointView<Space> view;
  /// per singular value, the largest first: smallest ratio to the largest, and its time
  std::vector<double> smallest, when;
  int generic_rank = 0;
  std::vector<Released> released;  ///< of the last sample
  Passages passages;
};

template <class Space>
SingularityObserver<Space>::SingularityObserver(const MechanismDescription& description,
                                                const Mechanism<Space, double>& mechanism)
    : work_(std::make_unique<Work>(description, mechanism)) {}

template <class Space>
SingularityObserver<Space>::~SingularityObserver() = default;

template <class Space>
void SingularityObserver<Space>::Observe(const Sample<Space>& sample) {
  Work& work = *work_;
  const int rows = work.view.mechanism().num_equations(), speeds = work.view.mechanism().num_u();
  if (rows == 0 || rows > kMaxRows || speeds == 0 || speeds > kMaxSpeeds) return;
  const LoopSpectrum now = SpectrumOfLoops(work.view.At(sample.formulation.kinematics()));
  const std::size_t count = static_cast<std::size_t>(now.singular_values.size());
  if (work.smallest.empty()) {
    work.smallest.assign(count, 1.0);
    work.when.assign(count, sample.t);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const double ratio = now.singular_values[i] / now.largest;
    if (ratio >= work.smallest[i]) continue;
    work.smallest[i] = ratio;
    work.when[i] = sample.t;
  }
  if (now.rank > work.generic_rank) work.passages = {};  // another quantity from here on
  work.generic_rank = std::max(work.generic_rank, now.rank);
  const std::vector<Released>& released = sample.formulation.kinematics().released();
  if (work.released != released) {
    work.passages.Forget();
    work.released = released;
  }
  if (work.generic_rank == 0) return;
  const auto last = static_cast<Eigen::Index>(work.generic_rank) - 1;
  work.passages.Add(sample.t, now.singular_values[last] / now.largest);
}

template <class Space>
void SingularityObserver<Space>::Write(Record& record) const {
  if (work_->generic_rank == 0) return;
  const std::size_t last = static_cast<std::size_t>(work_->generic_rank) - 1;
  record.Set("singularity_distance_min", work_->smallest[last]);
  record.Set("singularity_distance_min_t", work_->when[last]);
  record.Set("singularity_crossings", work_->passages.count());
}

template class SingularityObserver<Planar>;
template class SingularityObserver<Spatial>;

double FastestDrive(const MechanismDescription& description) {
  double fastest = 0.0;
  const auto look = [&](const TimeFunctionDescription& value) {
    const auto* harmonic = std::get_if<Harmonic>(&value);
    if (harmonic == nullptr || harmonic->amplitude == 0.0) return;
    fastest = std::max(fastest, std::abs(harmonic->omega));
  };
  for (const JointDescription& joint : description.joints) {
    for (const PrescribedMotion& motion : joint.motions) look(motion.value);
  }
  for (ForceDescription force : description.forces) {
    if (const TimeFunctionDescription* value = PartsOf(force).value) look(*value);
  }
  return fastest;
}

template <class Space>
StepLengthObserver<Space>::StepLengthObserver(const Watched<Space>& run)
    : stops_(run.stops.begin(), run.stops.end()), fastest_(FastestDrive(run.description)) {}

template <class Space>
void StepLengthObserver<Space>::Observe(const Sample<Space>& sample) {
  if (last_ > 0.0 && !std::ranges::binary_search(stops_, t_) &&
      (shortest_ == 0.0 || last_ < shortest_)) {
    shortest_ = last_;
    shortest_t_ = t_;
  }
  last_ = sample.t - t_;
  t_ = sample.t;
  longest_ = std::max(longest_, last_);
}

template <class Space>
void StepLengthObserver<Space>::Write(Record& record) const {
  if (longest_ == 0.0) return;
  record.Set("step_longest", longest_);
  if (shortest_ > 0.0) {
    record.Set("step_shortest", shortest_);
    record.Set("step_shortest_t", shortest_t_);
  }
  if (fastest_ > 0.0) record.Set("drive_frequency", fastest_);
}

template class StepLengthObserver<Planar>;
template class StepLengthObserver<Spatial>;

}  // namespace loopbench::harness
