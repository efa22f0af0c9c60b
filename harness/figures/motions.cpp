#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "harness/figures/view.h"
#include "mechanism/algebra/decompositions.h"
#include "mechanism/algebra/factors.h"
#include "mechanism/algebra/singular_values.h"
#include "mechanism/loops/scaled_loops.h"

namespace loopbench::harness {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Limit of the largest coordinate along a swing, in rad or lengths of the mechanism; and number of
/// frames to either side.
constexpr double kSwing = 0.7;
constexpr int kFramesAside = 14, kFramesOfPass = 49;
/// Amplitude of a motion without a finite path.
constexpr double kSmall = 0.05;

/// Moves a mechanism through its positions.
template <class Space>
class Follower {
 public:
  Follower(const Mechanism<Space, double>& mechanism, const VectorX<double>& q)
      : mechanism_(mechanism), kinematics_(mechanism), q_(q), units_(mechanism.num_u()) {
    kinematics_.UpdatePosition(q_);
    kinematics_.AcceptStep();
    kinematics_.CountTurns();
    units_.setOnes();
    for (const TreeStep& step : mechanism.tree()) {
      const JointState<Space, double>& state = kinematics_.joints()[step.joint];
      const int offset = mechanism.joints()[step.joint].u_offset;
      for (int i = 0; i < state.num_u; ++i) {
        if (state.H(i).angular.isZero()) units_[offset + i] = mechanism.length();
      }
    }
  }

  const VectorX<double>& q() const { return q_; }
  const VectorXd& units() const { return units_; }
  const Kinematics<Space, double>& kinematics() const { return kinematics_; }

  void Place(const VectorX<double>& q) {
    q_ = q;
    kinematics_.UpdatePosition(q_);
  }

  /// Sets the time of the prescribed motions, from the present coordinates; returns true if closed.
  bool SetTime(double t) {
    kinematics_.SetTime(t);
    kinematics_.UpdatePosition(q_);
    return Close();
  }

  /// Moves along u, ignoring the loops.
  void Shift(const VectorXd& u) { Place(Moved(u)); }

  /// Moves along the projection of `u` onto the constraints, which becomes the new direction.
  /// Returns true if the loops close at a different position.
  bool Step(double distance, VectorXd* u) {
    if (mechanism_.num_equations() == 0) {
      Shift(*u * (distance / Size(*u)));
      return true;
    }
    const VectorX<double> before = q_;
    const DirectionRows here = RowsOfDirections(kinematics_);
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver;
    solver.setThreshold(kRankRatio);
    solver.compute(here.rows);
    VectorXd y = here.mass.matrixU() * *u;
    y -= solver.solve(VectorXd(here.rows * y));
    *u = here.mass.matrixU().solve(y);
    *u *= distance / Size(*u);
    Shift(*u);
    // a step that returns to its start leads nowhere
    const bool moved = Close() && (q_ - before).norm() > 0.3 * (Moved(*u, before) - before).norm();
    if (moved) {
      kinematics_.AcceptStep();
    } else {
      Place(before);
    }
    return moved;
  }

 private:
  double Size(const VectorXd& u) const {
    return u.cwiseQuotient(units_).template lpNorm<Eigen::Infinity>();
  }
  VectorX<double> Moved(const VectorXd& u, const VectorX<double>& from) const {
    VectorX<double> rate(from.size());
    mechanism_.Rates(from, u, rate);
    VectorX<double> moved = from + rate;
    mechanism_.Normalise(moved);
    return moved;
  }
  VectorX<double> Moved(const VectorXd& u) const { return Moved(u, q_); }

  /// Runs Newton's method to the nearest closed position.
  bool Close() {
    constexpr int kMaxIterations = 12;
    const double goal = 1e-10 * mechanism_.length();
    for (int i = 0; i < kMaxIterations; ++i) {
      const DirectionRows here = RowsOfDirections(kinematics_);
      if (!here.mismatch.allFinite()) return false;
      if (here.mismatch.size() == 0 || here.mismatch.norm() < goal) return true;
      Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver;
      solver.setThreshold(1e-9);
      solver.compute(here.rows);
      const VectorXd back =
          here.mass.matrixU().solve(VectorXd(solver.solve(VectorXd(-here.mismatch))));
      if (!(Size(back) < 1.0)) return false;
      Shift(back);
    }
    return false;
  }

  const Mechanism<Space, double>& mechanism_;
  Kinematics<Space, double> kinematics_;
  VectorX<double> q_;
  VectorXd units_;
};

/// Direction of an initially possible motion.
struct MotionStart {
  int speed = 0;  ///< its leading speed: 1 here, 0 in the other directions
  VectorXd u;
};

/// Returns weights by speed: 1 for joints with one speed, less for others.
template <class Space>
VectorXd Clearness(const Mechanism<Space, double>& mechanism) {
  VectorXd clearness(mechanism.num_u());
  for (const TreeStep& step : mechanism.tree()) {
    const Joint<Space, double>& joint = mechanism.joints()[static_cast<std::size_t>(step.joint)];
    if (joint.num_u() > 0) {
      clearness.segment(joint.u_offset, joint.num_u()).setConstant(joint.num_u() == 1 ? 1.0 : 0.1);
    }
  }
  return clearness;
}

/// Returns the first `most` admissible directions, each with its leading speed.
template <class Space>
std::vector<MotionStart> MotionStarts(const Follower<Space>& start, std::size_t most) {
  const Mechanism<Space, double>& mechanism = start.kinematics().mechanism();
  const Eigen::Index n = mechanism.num_u();
  std::vector<MotionStart> all;
  if (mechanism.num_equations() == 0) {
    for (int i = 0; i < n && all.size() < most; ++i) all.push_back({i, VectorXd::Unit(n, i)});
    return all;
  }
  const MatrixXd permitted = ScaleLoops(start.kinematics()).to_u;
  const Eigen::Index count = permitted.cols();
  if (count == 0) return all;
  const MatrixXd scaled = start.units().cwiseInverse().asDiagonal() * permitted;
  // use the user's independent speeds if they are independent, else the most independent ones
  std::vector<int> chosen = mechanism.independent();
  MatrixXd own(count, count);
  const auto take = [&] {
    for (Eigen::Index i = 0; i < count; ++i) own.row(i) = scaled.row(chosen[i]);
  };
  constexpr double kIndependent = 1e-2;
  bool good = static_cast<Eigen::Index>(chosen.size()) == count;
  if (good) {
    take();
    SingularValues<double> values;
    values.ComputeValues(own);
    good = values.sigma()[count - 1] > kIndependent * values.sigma()[0];
  }
  if (!good) {
    // prefer the name of a pin to one of the three speeds of a ball
    const MatrixXd clear = scaled.transpose() * Clearness(mechanism).asDiagonal();
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(clear);
    const auto& order = qr.colsPermutation().indices();
    chosen.assign(order.data(), order.data() + count);
    std::ranges::sort(chosen);
    take();
  }
  const MatrixXd basis = permitted * Eigen::PartialPivLU<MatrixXd>(own).inverse();
  for (Eigen::Index i = 0; i < count && all.size() < most; ++i) {
    all.push_back({chosen[static_cast<std::size_t>(i)], basis.col(i)});
  }
  return all;
}

/// Returns the range of a swing in its leading speed.
std::string SwingText(double from, double to, bool is_length, bool whole) {
  return fmt::format("{:+.3g} to {:+.3g} {}{}; loops closed again in every frame", from, to,
                     is_length ? "m" : "rad", whole ? "" : ", where it cannot be followed further");
}

template <class Space>
PictureMotion Swing(const MechanismDescription& description, Follower<Space>* follower,
                    const MotionStart& beginning, int frames) {
  const Mechanism<Space, double>& mechanism = follower->kinematics().mechanism();
  const VectorX<double> start = follower->q();
  const Poses at_start = PosesOf(description, follower->kinematics());
  const auto step = std::ranges::find_if(mechanism.tree(), [&](const TreeStep& one) {
    const Joint<Space, double>& joint = mechanism.joints()[one.joint];
    return joint.u_offset <= beginning.speed && beginning.speed < joint.u_offset + joint.num_u();
  });
  const int column = beginning.speed - mechanism.joints()[step->joint].u_offset;
  const bool is_length = follower->kinematics().joints()[step->joint].H(column).angular.isZero();
  PictureMotion motion;
  motion.name = mechanism.speed_names()[static_cast<std::size_t>(beginning.speed)];
  const JointDescription& joint = description.joints[step->joint];
  const auto words = ValueWords(joint.type, description.space, true);
  if (words.size() > 1 && joint.motions.empty()) {
    motion.name = fmt::format("{}.{}", joint.name, words[column].name);
  }
  double reach[2] = {0.0, 0.0};
  std::vector<Poses> sides[2];
  for (const int side : {0, 1}) {
    follower->Place(start);
    VectorXd u = side == 0 ? VectorXd(-beginning.u) : beginning.u;
    while (static_cast<int>(sides[side].size()) < frames && follower->Step(kSwing / frames, &u)) {
      reach[side] += u[beginning.speed];
      sides[side].push_back(PosesOf(description, follower->kinematics()));
    }
  }
  follower->Place(start);
  const bool whole = std::ssize(sides[0]) == frames && std::ssize(sides[1]) == frames;
  motion.text = SwingText(reach[0], reach[1], is_length, whole);
  if (sides[0].empty() && sides[1].empty()) {
    const double size =
        beginning.u.cwiseQuotient(follower->units()).template lpNorm<Eigen::Infinity>();
    for (const int side : {0, 1}) {
      follower->Shift(beginning.u * ((side == 0 ? -kSmall : kSmall) / size));
      sides[side].push_back(PosesOf(description, follower->kinematics()));
      follower->Place(start);
    }
    motion.text = fmt::format(
        "to first order only, by {:g} rad or lengths: no position that closes the "
        "loops follows",
        kSmall);
  }
  motion.frames.assign(sides[0].rbegin(), sides[0].rend());
  motion.start = static_cast<int>(motion.frames.size());
  motion.frames.push_back(at_start);
  motion.frames.insert(motion.frames.end(), sides[1].begin(), sides[1].end());
  return motion;
}

/// Returns a time that shows a prescribed motion: a period, a whole table, a turn or a length.
double TimeToShow(const TimeFunctionDescription& function, double unit) {
  constexpr double kTurn = 2 * std::numbers::pi;
  if (const auto* harmonic = std::get_if<Harmonic>(&function)) {
    return harmonic->omega != 0.0 ? kTurn / std::abs(harmonic->omega) : 0.0;
  }
  if (const auto* table = std::get_if<TimeTable>(&function)) return table->times.back();
  const Polynomial& polynomial = std::get<Polynomial>(function);
  const auto& c = polynomial.coefficients;
  if (c.size() > 1 && c[1] != 0.0) return kTurn * unit / std::abs(c[1]);
  return c.size() > 2 && c[2] != 0.0 ? std::sqrt(kTurn * unit / std::abs(c[2])) : 0.0;
}

template <class Space>
PictureMotion Pass(const MechanismDescription& description, const VectorX<double>& q,
                   Follower<Space>* follower, int frames) {
  double horizon = 0.0;
  for (const JointDescription& joint : description.joints) {
    const auto words = ValueWords(joint.type, description.space, false);
    for (const PrescribedMotion& motion : joint.motions) {
      const bool length = words.at(static_cast<std::size_t>(motion.coordinate)).is_length();
      const double unit = length ? follower->kinematics().mechanism().length() / 8 : 1.0;
      horizon = std::max(horizon, TimeToShow(motion.value, unit));
    }
  }
  PictureMotion motion{.name = "prescribed motions", .returns = false};
  double t = 0.0;
  for (int i = 0; i < frames; ++i) {
    t = horizon * i / (frames - 1);
    if (!follower->SetTime(t)) break;
    motion.frames.push_back(PosesOf(description, follower->kinematics()));
  }
  const bool whole = std::ssize(motion.frames) == frames;
  motion.text = fmt::format("t = 0 to {:.3g} s, all else as the loops carry it{}", t,
                            whole ? "" : "; they close no further");
  follower->Place(q);
  follower->SetTime(0.0);
  follower->Place(q);
  return motion;
}

}  // namespace

template <class Space>
Poses PosesOf(const MechanismDescription& description,
              const Kinematics<Space, double>& kinematics) {
  Poses poses(description.bodies.size());
  for (std::size_t b = 0; b < poses.size(); ++b) {
    const Pose<Space, double>& X = kinematics.poses()[b];
    for (int i = 0; i < Space::kLin; ++i) {
      poses[b].p[i] = X.p[i];
      for (int j = 0; j < Space::kLin; ++j) poses[b].R(i, j) = X.R(i, j);
    }
    if (b == kGround) continue;
    Eigen::Vector3d com = description.bodies[b].com;
    if (Space::kLin == 2) com.z() = 0.0;
    poses[b].p -= poses[b].R * com;
  }
  return poses;
}

template <class Space>
std::vector<PictureMotion> FindMotions(const MechanismDescription& description,
                                       const Mechanism<Space, double>& mechanism,
                                       const VectorX<double>& q, std::string* left_out) {
  std::vector<PictureMotion> motions;
  if (mechanism.num_equations() > 0 && mechanism.num_u() > kMaxFollowed) {
    *left_out = fmt::format("motions: the loops have {} speeds, followed are up to {}",
                            mechanism.num_u(), kMaxFollowed);
    return motions;
  }
  Follower<Space> follower(mechanism, q);
  // reduce frames rather than motions
  const auto bodies = description.bodies.size();
  const std::size_t fit = kMaxFrames / bodies;
  const auto frames_of = [&](std::size_t count, int wanted) {
    return std::min(wanted, static_cast<int>(fit / count));
  };
  if (!mechanism.drives().empty() && fit >= 2) {
    motions.push_back(Pass(description, q, &follower, frames_of(2, kFramesOfPass)));
  }
  constexpr int kFewest = 3;
  const std::size_t most =
      std::clamp<std::size_t>(fit / (2 * (2 * kFewest + 1)), fit >= 7 ? 1 : 0, kMaxMotions);
  if (most == 0) {
    *left_out = fmt::format("motions: {} bodies have no room in the {} places of all frames",
                            bodies - 1, kMaxFrames);
    return motions;
  }
  const std::vector<MotionStart> beginnings = MotionStarts(follower, most);
  for (const MotionStart& beginning : beginnings) {
    const int aside =
        std::clamp(frames_of(4 * beginnings.size(), kFramesAside), kFewest, kFramesAside);
    motions.push_back(Swing(description, &follower, beginning, aside));
  }
  return motions;
}

#define LOOPBENCH_INSTANTIATE(Space)                                                     \
  template Poses PosesOf(const MechanismDescription&, const Kinematics<Space, double>&); \
  template std::vector<PictureMotion> FindMotions(const MechanismDescription&,           \
                                                  const Mechanism<Space, double>&,       \
                                                  const VectorX<double>&, std::string*);
LOOPBENCH_INSTANTIATE(Planar)
LOOPBENCH_INSTANTIATE(Spatial)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::harness
