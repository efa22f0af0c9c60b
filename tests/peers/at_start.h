// A mechanism at its start by Loopbench: what exported files are held to.
#pragma once

#include <Eigen/Cholesky>
#include <map>
#include <string>
#include <vector>

#include "harness/config/formulations.h"
#include "mechanism/loops/tree_dynamics.h"
#include "mechanism/start/assembly.h"
#include "tests/peers/shared.h"

namespace loopbench::harness::peers_test {

/// Values of one tree joint, in the order of files.
struct JointAtStart {
  std::vector<double> q, u, udot;
};

struct AtStart {
  std::vector<double> q, u, udot;
  /// Accelerations of the tree without its closures, and with closures whose accelerations leave
  /// out what comes with speed: J udot = 0 in place of J udot = gamma.
  std::vector<double> udot_open, udot_without_bias;
  double bound = 0.0, bound_open = 0.0;  ///< of the round-off of udot and udot_open

  /// Scale of accelerations, also of those that the open loops would have.
  double Scale() const { return std::max(Largest(udot), Largest(udot_open)); }

  double position_residual = 0.0, speed_residual = 0.0, length = 0.0;
  std::map<std::string, JointAtStart> joints;      ///< of the tree, by name
  std::map<std::string, Eigen::Vector3d> origins;  ///< of bodies [m]
};

template <class Space>
class StartOfOurs {
 public:
  explicit StartOfOurs(const MechanismDescription& description)
      : mechanism_(description, Coordinates::kJoint),
        dynamics_(mechanism_),
        kinematics_(mechanism_),
        start_(Assemble<Space>(description, mechanism_)),
        system_(MakeFormulation<Space>("odca", mechanism_, {Enforcement::kPosition})) {
    EXPECT_EQ(start_.outcome, Outcome::kFinished) << start_.message;
    EXPECT_EQ(system_->Start(0.0, start_.q, start_.u), Outcome::kFinished);
    made_.q = ToVector(start_.q);
    made_.u = ToVector(start_.u);
    made_.position_residual = start_.position_residual;
    made_.speed_residual = start_.speed_residual;
    made_.length = mechanism_.length();
    Accelerate();
    AddJoints();
    AddOrigins(description);
  }

  const AtStart& Result() const { return made_; }

 private:
  static std::vector<double> ToVector(const VectorX<double>& v) { return {v.begin(), v.end()}; }

  /// Returns udot of a state (q, u).
  std::vector<double> Closed(const std::vector<double>& y) {
    std::vector<double> ydot(y.size());
    EXPECT_EQ(system_->Examine(0.0, y, ydot), Outcome::kFinished);
    return {ydot.begin() + mechanism_.num_q(), ydot.end()};
  }
  std::vector<double> Open(const std::vector<double>& y) {
    VectorX<double> q = Eigen::Map<const VectorX<double>>(y.data(), mechanism_.num_q());
    mechanism_.Normalise(q);
    kinematics_.UpdatePosition(q);
    kinematics_.UpdateVelocity(
        Eigen::Map<const VectorX<double>>(y.data() + mechanism_.num_q(), mechanism_.num_u()));
    MatrixX<double> M(mechanism_.num_u(), mechanism_.num_u());
    dynamics_.MassMatrix(kinematics_, Masses::kPhysical, M);
    h_.resize(mechanism_.num_u());
    dynamics_.Bias(kinematics_, h_);
    return ToVector(M.llt().solve(-h_));
  }

  void Accelerate() {
    std::vector<double> y = made_.q;
    y.insert(y.end(), made_.u.begin(), made_.u.end());
    made_.udot_open = Open(y);
    made_.udot = Closed(y);
    VectorX<double> udot;
    udot.resize(mechanism_.num_u());
    system_->solver().Solve(-h_, VectorX<double>::Zero(mechanism_.num_rows()), udot, nullptr);
    made_.udot_without_bias = ToVector(udot);
    // Both sum some 100 rounded terms in another order, and solve for the loops' forces, which
    // magnifies that by the condition of the loops; in singular positions, where nothing is known
    // of it, the shipped mechanisms have one lost direction and all others well conditioned.
    const double rcond = system_->diagnostics().rcond;
    const double condition = rcond > kEps ? 1.0 / rcond : 1.0;
    made_.bound =
        100 * (kEps * condition * Largest(made_.udot) +
               Sensitivity(y, made_.udot, [&](const auto& near) { return Closed(near); }));
    made_.bound_open =
        100 * (kEps * Largest(made_.udot_open) +
               Sensitivity(y, made_.udot_open, [&](const auto& near) { return Open(near); }));
  }

  void AddJoints() {
    for (const TreeStep& step : mechanism_.tree()) {
      const auto& joint = mechanism_.joints()[step.joint];
      const auto part = [](const std::vector<double>& all, int first, int count) {
        return std::vector<double>(all.begin() + first, all.begin() + first + count);
      };
      made_.joints[mechanism_.joint_names()[step.joint]] = {
          part(made_.q, joint.q_offset, joint.num_q()),
          part(made_.u, joint.u_offset, joint.num_u()),
          part(made_.udot, joint.u_offset, joint.num_u())};
    }
  }

  void AddOrigins(const MechanismDescription& description) {
    kinematics_.UpdatePosition(start_.q);
    for (std::size_t b = 1; b < description.bodies.size(); ++b) {
      const auto& pose = kinematics_.poses()[b];
      Eigen::Vector3d origin = Eigen::Vector3d::Zero();
      for (int i = 0; i < Space::kLin; ++i) {
        origin[i] = pose.p[i];
        for (int j = 0; j < Space::kLin; ++j) {
          origin[i] -= pose.R(i, j) * description.bodies[b].com[j];
        }
      }
      made_.origins[description.bodies[b].name] = origin;
    }
  }

  const Mechanism<Space, double> mechanism_;
  TreeDynamics<Space, double> dynamics_;
  Kinematics<Space, double> kinematics_;
  Start<double> start_;
  std::unique_ptr<System<Space, double>> system_;
  VectorX<double> h_;
  AtStart made_;
};

inline AtStart LoopbenchInitialState(const MechanismDescription& description) {
  return description.space == SpaceKind::kPlanar ? StartOfOurs<Planar>(description).Result()
                                                 : StartOfOurs<Spatial>(description).Result();
}

}  // namespace loopbench::harness::peers_test
