#include "mechanism/start/assembly.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "mechanism/loops/loop_speeds.h"
#include "mechanism/loops/tree_dynamics.h"
#include "mechanism/start/assembly_units.h"
#include "mechanism/start/conflict.h"
#include "mechanism/start/least_squares.h"
#include "mechanism/start/mobility.h"

namespace loopbench {

namespace {

constexpr int kMaxIterations = 200;

/// The assembly problem of one mechanism in joint coordinates. Lengths count in units of the
/// mechanism's own, so that its size decides nothing; a power of two, so that they round nothing.
template <class Space>
class Assembler {
 public:
  Assembler(const MechanismDescription& description, const Mechanism<Space, double>& mechanism)
      : description_(description),
        mechanism_(mechanism),
        kinematics_(mechanism),
        held_q_(mechanism.num_u(), false),
        given_u_(mechanism.num_u(), false) {
    start_.q.setZero(mechanism.num_q());
    start_.u.setZero(mechanism.num_u());
    ReadInitialData();
    kinematics_.UpdatePosition(start_.q);
    units_ = AssemblyUnits<Space>(kinematics_);
  }

  Start<double> Run() {
    if (start_.outcome == Outcome::kFinished) ClosePositions();
    if (start_.outcome == Outcome::kFinished) CloseSpeeds();
    if (start_.outcome != Outcome::kFinished) return start_;
    if (const std::string why = WhyLocked(description_, mechanism_, start_.q); !why.empty()) {
      start_.outcome = Outcome::kLocked;
      start_.message = mechanism_.name() + ": " + why;
    }
    return start_;
  }

 private:
  void ReadInitialData() {
    for (const TreeStep& step : mechanism_.tree()) {
      const Joint<Space, double>& joint = mechanism_.joints()[step.joint];
      if (joint.kind->has_quaternion()) start_.q[joint.q_offset] = 1.0;  // the unit quaternion
    }
    const auto is_held = [&](int joint) {
      return std::ranges::find(description_.initial.held, joint) != description_.initial.held.end();
    };
    for (const JointValues& values : description_.initial.coordinates) {
      const Joint<Space, double>& joint = mechanism_.joints()[values.joint];
      if (joint.in_tree()) {
        for (int i = 0, next = joint.q_offset; i < joint.kind->num_q; ++i) {
          if (mechanism_.DriveOf(joint, i) < 0) start_.q[next++] = values.values[i];
        }
      } else if (joint.num_u() == 0) {
        continue;  // prescribed
      } else if (is_held(values.joint) && joint.kind->num_u == 1) {
        held_cut_.push_back({values.joint, 0, values.values[0]});
      } else {
        Fail("joint \"" + mechanism_.joint_names()[&joint - mechanism_.joints().data()] +
             "\" closes a loop and carries only a guess: hold it, or mark "
             "another joint of the loop with \"cut\"");
      }
    }
    for (int index : description_.initial.held) {
      const Joint<Space, double>& joint = mechanism_.joints()[index];
      for (int i = 0; joint.in_tree() && i < joint.num_u(); ++i) {
        held_q_[joint.u_offset + i] = true;
      }
    }
    for (const JointValues& values : description_.initial.speeds) {
      const Joint<Space, double>& joint = mechanism_.joints()[values.joint];
      for (int i = 0, free = 0; i < joint.kind->num_u; ++i) {
        if (mechanism_.DriveOf(joint, i) >= 0) continue;
        if (!joint.in_tree()) {
          given_cut_.push_back({values.joint, free, values.values[i]});
        } else {
          start_.u[joint.u_offset + free] = values.values[i];
          given_u_[joint.u_offset + free] = true;
        }
        ++free;
      }
    }
  }

  /// Units of all constraint rows and, below them, of free coordinates of cut joints.
  template <class List>
  VectorX<double> UnitsWith(const List& cut_joints) const {
    VectorX<double> units = units_.rows;
    units.conservativeResize(units.size() + static_cast<Eigen::Index>(cut_joints.size()));
    Eigen::Index row = units_.rows.size();
    for (const auto& given : cut_joints) {
      units[row++] = units_.Of(kinematics_.joints()[given.joint].H(given.component));
    }
    return units;
  }

  void Fail(const std::string& message) {
    if (start_.outcome != Outcome::kFinished) return;
    start_.outcome = Outcome::kInconsistentStart;
    start_.message = mechanism_.name() + ": " + message;
  }

  /// e in units, with a row per held cut joint.
  VectorX<double> Residual(const VectorX<double>& q) {
    kinematics_.UpdatePosition(q);
    VectorX<double> e(mechanism_.num_rows() + static_cast<int>(held_cut_.size()));
    for (int index : mechanism_.constraints()) {
      const Joint<Space, double>& joint = mechanism_.joints()[index];
      const int rows = joint.num_constraints();
      const Velocity<Space, double> mismatch = kinematics_.ConstraintMismatch(index);
      e.segment(joint.row, rows) = kinematics_.joints()[index].Along(mismatch, rows).head(rows);
    }
    for (std::size_t k = 0; k < held_cut_.size(); ++k) {
      const auto& [joint, component, value] = held_cut_[k];
      e[mechanism_.num_rows() + static_cast<int>(k)] = kinematics_.JointCoordinate(joint) - value;
    }
    return e.cwiseQuotient(UnitsWith(held_cut_));
  }

  /// Speed of the free coordinate `component` of a cut joint.
  double CutJointSpeed(int index, int component) const {
    const JointState<Space, double>& state = kinematics_.joints()[index];
    return mechanism_.joints()[index].kind->inverse_H_squared * state.H(component).dot(state.V_rel);
  }

  /// J, a row per constraint and below them one per free coordinate of `cut_joints`, in units.
  template <class List>
  SparseRows Rows(const List& cut_joints, const VectorX<double>& units) const {
    std::vector<Eigen::Triplet<double>> entries;
    const auto add = [&](int row, int column, double value) {
      entries.emplace_back(row, column, value * units_.columns[column] / units[row]);
    };
    for (int index : mechanism_.constraints()) {
      const Joint<Space, double>& joint = mechanism_.joints()[index];
      const JointState<Space, double>& state = kinematics_.joints()[index];
      ForEachSpeedOfLoop(kinematics_, index, [&](int column, const Velocity<Space, double>& V) {
        for (int r = 0; r < joint.num_constraints(); ++r) {
          add(joint.row + r, column, state.D(r).dot(V));
        }
      });
    }
    int row = mechanism_.num_rows();
    for (const auto& [index, component, value] : cut_joints) {
      const double inverse = mechanism_.joints()[index].kind->inverse_H_squared;
      const Direction<Space, double> H = kinematics_.joints()[index].H(component);
      ForEachSpeedOfLoop(kinematics_, index, [&](int column, const Velocity<Space, double>& V) {
        add(row, column, inverse * H.dot(V));
      });
      ++row;
    }
    SparseRows J(units.size(), mechanism_.num_u());
    J.setFromTriplets(entries.begin(), entries.end());
    return J;
  }

  /// J over the speeds that may change.
  static SparseRows Without(const std::vector<bool>& fixed, SparseRows J) {
    J.prune([&](Eigen::Index, Eigen::Index column, double) { return !fixed[column]; });
    return J;
  }

  void ClosePositions() {
    VectorX<double> e = Residual(start_.q);
    if (e.size() == 0) return;
    double damping = 1e-3;
    // what rounding leaves of a closure that passes through every body
    const double goal = 16 * std::numeric_limits<double>::epsilon() * Extent();
    const VectorX<double> units = UnitsWith(held_cut_);
    // where every coordinate is prescribed there is nothing to move
    const int iterations = mechanism_.num_u() > 0 ? kMaxIterations : 0;
    for (int i = 0; i < iterations && e.template lpNorm<Eigen::Infinity>() > goal; ++i) {
      kinematics_.UpdatePosition(start_.q);
      LeastSquares steps(Without(held_q_, Rows(held_cut_, units)), mechanism_.name());
      bool improved = false;
      for (; damping < 1e8 && !improved; damping *= 10) {
        const VectorX<double> trial =
            Move(start_.q, -steps.Damped(e, damping).cwiseProduct(units_.columns));
        const VectorX<double> e_trial = Residual(trial);
        if (!(e_trial.norm() < e.norm())) continue;
        improved = true;
        start_.q = trial;
        e = e_trial;
        damping *= 1e-3;  // the loop's own step multiplies by ten
      }
      if (!improved) break;
      damping = std::max(damping, 1e-16);
    }
    start_.position_residual = InSi(e, units);
    // A thousand times the goal is far below any drift worth measuring. Along many joints angles up
    // to pi add up with eps pi / 2 each, which turns all that is outward: no closure is known
    // better.
    const double known = std::numbers::pi * std::numeric_limits<double>::epsilon() * Depth();
    if (e.template lpNorm<Eigen::Infinity>() <= std::max(1e3 * goal, known * Extent())) return;
    Fail(DescribeConflict(description_, kinematics_, {e, units, false, Extra(held_cut_)}));
  }

  /// The worst number of a list in units, without them.
  static double InSi(const VectorX<double>& e, const VectorX<double>& units) {
    Eigen::Index worst = 0;
    e.cwiseAbs().maxCoeff(&worst);
    return std::abs(e[worst]) * units[worst];
  }

  /// q moved by the speeds d for unit time (quaternions renormalised).
  VectorX<double> Move(const VectorX<double>& q, const VectorX<double>& d) const {
    VectorX<double> step(q.size());
    mechanism_.Rates(q, d, step);
    VectorX<double> moved = q + step;
    for (const TreeStep& tree_step : mechanism_.tree()) {
      const Joint<Space, double>& joint = mechanism_.joints()[tree_step.joint];
      if (joint.kind->has_quaternion()) moved.segment<4>(joint.q_offset).normalize();
    }
    return moved;
  }

  void CloseSpeeds() {
    kinematics_.UpdatePosition(start_.q);
    const int rows = mechanism_.num_rows(), extra = static_cast<int>(given_cut_.size());
    if (rows + extra == 0) return;
    const VectorX<double> at_rest = VectorX<double>::Zero(mechanism_.num_u());
    VectorX<double> target, bias;
    SpeedBias(kinematics_, at_rest, bias);
    target = -bias;
    target.conservativeResize(rows + extra);
    const VectorX<double> units = UnitsWith(given_cut_);
    kinematics_.UpdateVelocity(at_rest);
    for (int k = 0; k < extra; ++k) {
      const auto& [joint, component, value] = given_cut_[k];
      target[rows + k] = value - CutJointSpeed(joint, component);
    }
    const SparseRows J = Rows(given_cut_, units);
    target = target.cwiseQuotient(units);
    start_.u = start_.u.cwiseQuotient(units_.columns);
    const VectorX<double> miss = target - J * start_.u;
    const double size = 1.0 + target.norm() + start_.u.norm() * Extent();
    const bool off = miss.norm() > 64 * std::numeric_limits<double>::epsilon() * size;
    if (off && mechanism_.num_u() > 0) {
      start_.u += LeastSquares(Without(given_u_, J), mechanism_.name()).Smallest(miss);
    }
    const VectorX<double> left = target - J * start_.u;
    start_.u = start_.u.cwiseProduct(units_.columns);
    start_.speed_residual = InSi(left, units);
    if (left.template lpNorm<Eigen::Infinity>() <= 1e-10 * size) return;
    Fail(DescribeConflict(description_, kinematics_, {left, units, true, Extra(given_cut_)}));
  }

  /// A length that no position exceeds much, in units: all arms of the longest way through the
  /// tree, each at least as long as the mechanism's own length, and those of cut joints.
  double Extent() const {
    const auto longer = [&](int index) {
      const Joint<Space, double>& joint = mechanism_.joints()[index];
      return std::max({mechanism_.length(), joint.X_PF.p.norm(), joint.X_QM.p.norm()});
    };
    double farthest = mechanism_.length(), last = 0.0;
    std::vector<double> reach(static_cast<std::size_t>(mechanism_.num_bodies()), 0.0);
    for (const TreeStep& step : mechanism_.tree()) {
      reach[step.child] = reach[step.parent] + longer(step.joint);
      farthest = std::max(farthest, reach[step.child]);
    }
    for (int index : mechanism_.constraints()) last = std::max(last, longer(index));
    return (farthest + last) / units_.length;
  }

  /// Joints of the longest way through the tree.
  double Depth() const {
    int deepest = 0;
    std::vector<int> depth(static_cast<std::size_t>(mechanism_.num_bodies()), 0);
    for (const TreeStep& step : mechanism_.tree()) {
      depth[step.child] = depth[step.parent] + 1;
      deepest = std::max(deepest, depth[step.child]);
    }
    return deepest;
  }

  /// A coordinate or speed of a joint that is not in the tree.
  struct OfCutJoint {
    int joint, component;
    double value;
  };
  static std::vector<std::pair<int, int>> Extra(const std::vector<OfCutJoint>& cut_joints) {
    std::vector<std::pair<int, int>> extra;
    for (const OfCutJoint& one : cut_joints) extra.emplace_back(one.joint, one.component);
    return extra;
  }
  const MechanismDescription& description_;
  const Mechanism<Space, double>& mechanism_;
  Kinematics<Space, double> kinematics_;
  Start<double> start_;
  std::vector<bool> held_q_, given_u_;
  AssemblyUnits<Space> units_;
  std::vector<OfCutJoint> held_cut_, given_cut_;
};

}  // namespace

template <class Space>
Start<double> Assemble(const MechanismDescription& description,
                       const Mechanism<Space, double>& mechanism) {
  if (mechanism.coordinates() == Coordinates::kJoint && mechanism.released().empty()) {
    return Assembler<Space>(description, mechanism).Run();
  }
  // released directions hold, too
  const Mechanism<Space, double> joints(Unreleased(description), Coordinates::kJoint);
  Start<double> start = Assembler<Space>(description, joints).Run();
  if (start.outcome != Outcome::kFinished) return start;
  if (mechanism.coordinates() == Coordinates::kJoint) return start;
  Kinematics<Space, double> from(joints), to(mechanism);
  from.UpdatePosition(start.q);
  from.UpdateVelocity(start.u);
  start.q = from.CoordinatesIn(mechanism);
  to.UpdatePosition(start.q);
  start.u = from.SpeedsIn(to);
  return start;
}

template Start<double> Assemble(const MechanismDescription&, const Mechanism<Planar, double>&);
template Start<double> Assemble(const MechanismDescription&, const Mechanism<Spatial, double>&);

}  // namespace loopbench
