#include "mechanism/start/assembly.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mechanism/algebra/decompositions.h"
#include "mechanism/loops/tree_dynamics.h"
#include "mechanism/model/dense_memory.h"
#include "mechanism/start/assembly_units.h"
#include "mechanism/start/conflict.h"
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
        dynamics_(mechanism),
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

  /// Speed of the free coordinate `component` of a cut joint at u.
  double CutJointSpeed(int index, int component, const VectorX<double>& u) {
    kinematics_.UpdateVelocity(u);
    const JointState<Space, double>& state = kinematics_.joints()[index];
    return mechanism_.joints()[index].kind->inverse_H_squared * state.H(component).dot(state.V_rel);
  }

  /// Its derivatives by u.
  Eigen::RowVectorXd CutJointRow(int index, int component) {
    Eigen::RowVectorXd row(mechanism_.num_u());
    VectorX<double> u = VectorX<double>::Zero(mechanism_.num_u());
    const double at_rest = CutJointSpeed(index, component, u);
    for (int i = 0; i < mechanism_.num_u(); ++i) {
      u[i] = 1.0;
      row[i] = CutJointSpeed(index, component, u) - at_rest;
      u[i] = 0.0;
    }
    return row;
  }

  /// So many numbers at once in matrices of that many rows and a column per speed.
  void Require(double numbers, Eigen::Index rows) const {
    RequireDense(mechanism_.name() + ": the consistent start is dense: a matrix of " +
                     std::to_string(rows) + " constraints by " +
                     std::to_string(mechanism_.num_u()) + " speeds and its factors",
                 numbers);
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
    if (iterations > 0 && e.template lpNorm<Eigen::Infinity>() > goal) {
      // DampedStep: J, the factors of its transpose, Q, and the square problem with its factors
      const auto r = static_cast<double>(e.size()), c = static_cast<double>(mechanism_.num_u());
      const double m = std::min(r, c);
      Require(2 * r * c + c * m + 2 * (r + m) * m, e.size());
    }
    for (int i = 0; i < iterations && e.template lpNorm<Eigen::Infinity>() > goal; ++i) {
      kinematics_.UpdatePosition(start_.q);
      MatrixX<double> J;
      dynamics_.Jacobian(kinematics_, J);
      J.conservativeResize(e.size(), Eigen::NoChange);
      for (std::size_t k = 0; k < held_cut_.size(); ++k) {
        J.row(mechanism_.num_rows() + static_cast<int>(k)) = CutJointRow(held_cut_[k].joint, 0);
      }
      units_.Apply(units, J);
      for (int c = 0; c < mechanism_.num_u(); ++c) {
        if (held_q_[c]) J.col(c).setZero();
      }
      bool improved = false;
      for (; damping < 1e8 && !improved; damping *= 10) {
        const VectorX<double> trial =
            Move(start_.q, DampedStep(J, e, damping).cwiseProduct(units_.columns));
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
    // a thousand times the goal: round-off of a long chain, far below any drift worth measuring
    if (e.template lpNorm<Eigen::Infinity>() <= 1e3 * goal) return;
    Fail(DescribeConflict(description_, kinematics_, {e, units, false, Extra(held_cut_)}));
  }

  /// The worst number of a list in units, without them.
  static double InSi(const VectorX<double>& e, const VectorX<double>& units) {
    Eigen::Index worst = 0;
    e.cwiseAbs().maxCoeff(&worst);
    return std::abs(e[worst]) * units[worst];
  }

  /// argmin |J d + e|^2 + damping^2 |d|^2. Only the range of J^T can lessen it: with the thin
  /// J^T = Q R and d = Q y a problem as small as J has rows.
  static VectorX<double> DampedStep(const MatrixX<double>& J, const VectorX<double>& e,
                                    double damping) {
    const Eigen::Index r = std::min(J.rows(), J.cols());
    const Eigen::HouseholderQR<MatrixX<double>> qr(J.transpose());
    const MatrixX<double> Q = ThinQ(qr);
    MatrixX<double> A = MatrixX<double>::Zero(J.rows() + r, r);
    A.topRows(J.rows()).noalias() = J * Q;
    A.bottomRows(r).diagonal().setConstant(damping);
    VectorX<double> rhs = VectorX<double>::Zero(A.rows());
    rhs.head(J.rows()) = -e;
    const Eigen::HouseholderQR<MatrixX<double>> least(A);
    return Q * VectorX<double>(least.solve(rhs));
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
    const auto numbers =
        static_cast<double>(rows + extra) * static_cast<double>(mechanism_.num_u());
    Require(2 * numbers, rows + extra);  // J and J_free
    MatrixX<double> J;
    dynamics_.Jacobian(kinematics_, J);
    J.conservativeResize(rows + extra, Eigen::NoChange);
    const VectorX<double> at_rest = VectorX<double>::Zero(mechanism_.num_u());
    VectorX<double> target, bias;
    SpeedBias(kinematics_, at_rest, bias);
    target = -bias;
    target.conservativeResize(rows + extra);
    const VectorX<double> units = UnitsWith(given_cut_);
    for (int k = 0; k < extra; ++k) {
      const auto& [joint, component, value] = given_cut_[k];
      J.row(rows + k) = CutJointRow(joint, component);
      target[rows + k] = value - CutJointSpeed(joint, component, at_rest);
    }
    units_.Apply(units, J);
    target = target.cwiseQuotient(units);
    start_.u = start_.u.cwiseQuotient(units_.columns);
    MatrixX<double> J_free = J;
    for (int c = 0; c < mechanism_.num_u(); ++c) {
      if (given_u_[c]) J_free.col(c).setZero();
    }
    const VectorX<double> miss = target - J * start_.u;
    const double size = 1.0 + target.norm() + start_.u.norm() * Extent();
    const bool off = miss.norm() > 64 * std::numeric_limits<double>::epsilon() * size;
    if (off && mechanism_.num_u() > 0) {
      Require(numbers, rows + extra);
      Eigen::CompleteOrthogonalDecomposition<MatrixX<double>> solver(J_free);
      start_.u += solver.solve(miss);
    }
    const VectorX<double> left = target - J * start_.u;
    start_.u = start_.u.cwiseProduct(units_.columns);
    start_.speed_residual = InSi(left, units);
    if (left.template lpNorm<Eigen::Infinity>() <= 1e-10 * size) return;
    Fail(DescribeConflict(description_, kinematics_, {left, units, true, Extra(given_cut_)}));
  }

  /// A length that no position exceeds much, in units: the longest arm of a body or Ground, or the
  /// mechanism's own length, for every joint.
  double Extent() const {
    double longest = mechanism_.length();
    for (const Joint<Space, double>& joint : mechanism_.joints()) {
      longest = std::max({longest, joint.X_PF.p.norm(), joint.X_QM.p.norm()});
    }
    return longest / units_.length * static_cast<double>(mechanism_.joints().size() + 1);
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
  TreeDynamics<Space, double> dynamics_;
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
