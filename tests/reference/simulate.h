// Runs a description and shows bodies at accepted steps, in space whatever its own: for tests that
// compare poses and speeds, not the columns of tables.
#pragma once

#include "harness/config/experiment.h"
#include "harness/integrator/arkode.h"
#include "tests/standard.h"

namespace loopbench::harness::reference {

/// Motion of a body, ground axes: of its centre of mass and its own axes.
struct BodyState {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  ///< body axes in ground axes
  Eigen::Vector3d p = Eigen::Vector3d::Zero();      ///< centre of mass [m]
  Eigen::Vector3d w = Eigen::Vector3d::Zero();      ///< angular velocity [rad/s]
  Eigen::Vector3d v = Eigen::Vector3d::Zero();      ///< velocity of the centre of mass [m/s]
};

/// An accepted step. Bodies in the order of the description, Ground first.
struct Snapshot {
  double t = 0.0;
  std::vector<BodyState> bodies;
  double kinetic = 0.0, potential = 0.0;  ///< [J], as ComputeEnergy() counts them
};

/// Whole run. `last` is the state at the horizon if the outcome is kFinished.
struct Simulation {
  IntegratorResult result;
  Snapshot last;
  /// Largest change of kinetic + potential energy - work of the forces without a potential [J].
  double energy_error = 0.0;
  double kinetic_integral = 0.0;  ///< of the kinetic energy over time [J s], integrated with it
};

using Watch = std::function<void(const Snapshot&)>;

/// Runs `description` from its consistent start; `watch` sees every accepted step and the start.
/// An assembly that fails gives its outcome and message.
Simulation Simulate(const MechanismDescription& description, const Method& method,
                    const IntegratorOptions& options, double horizon, const Watch& watch = {});

/// rtol = atol, ten minutes of CPU time: a test must not end by them, sanitizers or not.
IntegratorOptions Options(const std::string& profile, double tolerance);

/// Angle of a body's x axis in the plane [rad].
inline double AngleOf(const BodyState& body) { return std::atan2(body.R(1, 0), body.R(0, 0)); }

/// Index of a body by its name; throws std::invalid_argument when there is none.
int BodyNamed(const MechanismDescription& description, const std::string& name);

/// A point given in body axes from the body's origin, in ground axes [m], and its velocity [m/s].
Eigen::Vector3d PointOf(const MechanismDescription& description, const Snapshot& snapshot, int body,
                        const Eigen::Vector3d& at);
Eigen::Vector3d VelocityOf(const MechanismDescription& description, const Snapshot& snapshot,
                           int body, const Eigen::Vector3d& at);

/// A rotation about no particular axis, the same one for all, and its vector.
Eigen::Vector3d AnyTurn();
Eigen::Matrix3d AnyRotation();

/// The three formulations at the level of the paper with rank-revealing solvers, in both coordinate
/// sets.
const std::vector<Method>& RankRevealingMethods();
/// The same at level projection.
const std::vector<Method>& PositionMethods();

}  // namespace loopbench::harness::reference
