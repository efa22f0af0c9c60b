// A random mechanism in the paper's terms: two-handle bodies, joints, and what O-DCA found.
#pragma once

#include "mechanism/loops/tree_dynamics.h"
#include "odca/odca.h"
#include "tests/contract/generators.h"
#include "tests/contract/system_with.h"
#include "tests/odca/paper_formulas.h"
#include "tests/standard.h"

namespace loopbench::odca::paper {

/// Answer of a dense system: forces as for Scene::ForceOn(), accelerations at centres of mass.
struct DenseAnswer {
  std::vector<RealVector> accelerations;  ///< by place in the list of bodies
  std::vector<RealVector> forces;         ///< on Q at Mo, by place in the list of joints
};

template <class Space>
class Scene {
 public:
  /// The description's own coordinates, closed, with random consistent speeds.
  Scene(const MechanismDescription& description, std::uint64_t seed)
      : mechanism_(description, Coordinates::kJoint),
        state_(testing::ConsistentState(description, mechanism_, seed)),
        kinematics_(mechanism_),
        wrenches_(mechanism_.num_bodies()) {
    kinematics_.UpdatePosition(state_.q);
    kinematics_.UpdateVelocity(state_.u);
    AppliedForces<Space, double>(kinematics_, wrenches_);
  }

  const Mechanism<Space, double>& mechanism() const { return mechanism_; }
  const Kinematics<Space, double>& kinematics() const { return kinematics_; }

  double coordinate(int i) const { return state_.q[i]; }
  double speed(int i) const { return state_.u[i]; }

  /// The place of the user's joint `description` in the mechanism.
  int JointIndex(int description) const {
    int j = 0;
    while (mechanism_.joints()[j].description != description) ++j;
    return j;
  }

  // What a body is, from its mass, pose, speed and applied forces.

  /// From a body's centre of mass to Mo of one of its joints.
  RealVector Arm(int body, int joint) const {
    const JointState<Space, double>& state = kinematics_.joints()[joint];
    return ToReal(mechanism_.joints()[joint].to == body ? state.r_Q : state.r_P);
  }
  /// Takes a motion from the centre of mass to r: [w; v + w x r].
  static RealMatrix Shift(const RealVector& r) {
    RealMatrix S = RealMatrix::Identity(Space::kDim, Space::kDim);
    if constexpr (Space::kRot == 1) {
      S(1, 0) = -r[1];
      S(2, 0) = r[0];
    } else {
      S.bottomLeftCorner(3, 3) << 0, r[2], -r[1], -r[2], 0, r[0], r[1], -r[0], 0;
    }
    return S;
  }
  RealMatrix Inertia(int body) const {
    const auto& inertia = mechanism_.bodies()[body];
    const auto rotational = kinematics_.RotationalInertia(inertia, body);
    RealMatrix M = RealMatrix::Identity(Space::kDim, Space::kDim) * testing::Real(inertia.mass);
    M.topLeftCorner(Space::kRot, Space::kRot) = ToReal(rotational);
    return M;
  }
  /// Wrench on the body without its joints, less w x I w.
  RealVector Wrench(int body) const {
    RealVector wrench = ToReal(wrenches_[body]);
    const RealVector w = AngularVelocity(body);
    const RealVector Iw = Inertia(body).topLeftCorner(Space::kRot, Space::kRot) * w;
    if constexpr (Space::kRot == 3) wrench.head(3) -= Cross(w, Iw);
    return wrench;
  }
  /// [0; w x (w x r)].
  RealVector Centripetal(int body, const RealVector& r) const {
    RealVector n = RealVector::Zero(Space::kDim);
    const RealVector w = AngularVelocity(body);
    if constexpr (Space::kRot == 1) {
      n.tail(2) = -w[0] * w[0] * r;
    } else {
      n.tail(3) = Cross(w, Cross(w, r));
    }
    return n;
  }

  // The paper's quantities. A body's two joints are its handles.

  TwoHandles Body(int body, int first, int second) const {
    const RealVector r1 = Arm(body, first), r2 = Arm(body, second);
    const RealMatrix S1 = Shift(r1), S2 = Shift(r2), Z = Inverse(Inertia(body));
    const RealVector b = Z * Wrench(body);
    return {S1 * Z * S1.transpose(),        S1 * Z * S2.transpose(),
            S2 * Z * S1.transpose(),        S2 * Z * S2.transpose(),
            S1 * b + Centripetal(body, r1), S2 * b + Centripetal(body, r2)};
  }
  /// The joint as one that leads to `outer`, whichever of its bodies that is.
  Cut JointTo(int outer, int joint) const {
    const JointState<Space, double>& state = kinematics_.joints()[joint];
    const RealVector g = ToReal(state.g);
    RealMatrix D(Space::kDim, state.rows());
    for (int i = 0; i < state.rows(); ++i) D.col(i) = ToReal(state.D(i));
    return {D, mechanism_.joints()[joint].to == outer ? g : RealVector(-g)};
  }

  // The same bodies and joints as one dense system, an answer of its own.

  /// Bodies that meet others only through `joints`, with a wrench at the centre of mass of the
  /// first body in addition.
  DenseAnswer Solve(std::span<const int> bodies, std::span<const int> joints,
                    const RealVector& on_first) const;

  /// Evaluates the code under test; its answers follow.
  Outcome Evaluate(SolverKind solver) {
    PlanOptions plan = PlanOptionsOf(solver);
    plan.basis = BoundaryBasis::kBodies;  // as the paper has it
    odca_.emplace(mechanism_, FormulationOptions{.solver = solver}, plan);
    VectorX<double> udot;
    const Outcome outcome = (*odca_)->Evaluate(0.0, state_.q, state_.u, udot);
    accelerations_.assign(mechanism_.num_bodies(), Acceleration<Space, double>::Zero());
    TreeDynamics<Space, double>(mechanism_)
        .BodyAccelerations((*odca_)->kinematics(), udot, accelerations_);
    return outcome;
  }
  const Odca<Space, double>& odca() const { return odca_->solver(); }
  /// Force of a joint on one of its bodies, at Mo.
  RealVector ForceOn(int body, int joint) const {
    const RealVector F = ToReal(odca().JointForce(joint));
    return mechanism_.joints()[joint].to == body ? F : RealVector(-F);
  }
  /// Acceleration of a body's point at Mo.
  RealVector AccelerationAt(int body, int joint) const {
    const RealVector r = Arm(body, joint);
    return Shift(r) * ToReal(accelerations_[body]) + Centripetal(body, r);
  }

 private:
  static RealMatrix ToReal(const auto& numbers) {
    return numbers.eigen().template cast<testing::Real>();
  }
  static RealVector Cross(const RealVector& a, const RealVector& b) {
    RealVector c(3);
    c << a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0];
    return c;
  }
  RealVector AngularVelocity(int body) const { return ToReal(kinematics_.motions()[body].angular); }

  const Mechanism<Space, double> mechanism_;
  const testing::State state_;
  Kinematics<Space, double> kinematics_;
  std::vector<loopbench::Wrench<Space, double>> wrenches_;
  std::vector<Acceleration<Space, double>> accelerations_;
  std::optional<testing::SystemWith<Odca, Space, double>> odca_;
};

/// M A - C^T phi = wrench, C A = -c0 with rows c_Q = S^T D, c_P = -S^T D.
template <class Space>
DenseAnswer Scene<Space>::Solve(std::span<const int> bodies, std::span<const int> joints,
                                const RealVector& on_first) const {
  constexpr int d = Space::kDim;
  const int n = d * static_cast<int>(bodies.size());
  int size = n;
  for (const int joint : joints) size += kinematics_.joints()[joint].rows();
  RealMatrix A = RealMatrix::Zero(size, size);
  RealVector b = RealVector::Zero(size);
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    A.block(d * k, d * k, d, d) = Inertia(bodies[k]);
    b.segment(d * k, d) = Wrench(bodies[k]);
  }
  b.head(d) += on_first;
  int row = n;
  for (const int joint : joints) {
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      const bool is_Q = mechanism_.joints()[joint].to == bodies[k];
      if (!is_Q && mechanism_.joints()[joint].from != bodies[k]) continue;
      const Cut cut = JointTo(bodies[k], joint);  // A_Q = .. + g, A_P = .. - g
      const RealVector r = Arm(bodies[k], joint);
      const RealMatrix C = (is_Q ? 1 : -1) * cut.D.transpose() * Shift(r);
      A.block(row, d * k, C.rows(), d) = C;
      A.block(d * k, row, d, C.rows()) = -C.transpose();
      b.segment(row, C.rows()) -= (is_Q ? 1 : -1) * cut.D.transpose() * Centripetal(bodies[k], r);
    }
    const Cut cut = JointTo(mechanism_.joints()[joint].to, joint);
    b.segment(row, cut.D.cols()) += cut.D.transpose() * cut.Hdot_u;
    row += static_cast<int>(cut.D.cols());
  }
  const RealVector x = testing::SolveFullPivot(A, b, 0);
  DenseAnswer answer;
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    answer.accelerations.push_back(x.segment(d * k, d));
  }
  row = n;
  for (const int joint : joints) {
    const RealMatrix D = JointTo(mechanism_.joints()[joint].to, joint).D;
    answer.forces.push_back(D * x.segment(row, D.cols()));
    row += static_cast<int>(D.cols());
  }
  return answer;
}

}  // namespace loopbench::odca::paper
