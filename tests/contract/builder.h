// Builds random descriptions for generators.cpp: bodies, tree joints in any frames, forces, and
// joints that close loops by construction.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/contract/generators.h"

namespace loopbench::testing {

/// A description under construction.
class Builder {
 public:
  Builder(const std::string& name, SpaceKind space, std::uint64_t seed)
      : random(seed), spatial(space == SpaceKind::kSpatial) {
    description.name = name + "-" + std::to_string(seed);
    description.space = space;
    description.gravity = random.Vector(10.0, spatial);
  }

  int AddBody(double size) {
    BodyDescription body;
    body.name = "b" + std::to_string(description.bodies.size());
    body.mass = std::exp(random.Uniform(-1.0, 1.0));
    body.com = random.Vector(0.5 * size, spatial);
    // radii of gyration near the paper's (1 m for bars of 1 m)
    const Eigen::Vector3d gyration(random.Uniform(0.5, 1.0), random.Uniform(0.5, 1.0),
                                   random.Uniform(0.5, 1.0));
    const Eigen::Matrix3d R = TurnMatrix(RandomTurn());
    const Eigen::Vector3d moments = body.mass * size * size * gyration.cwiseAbs2();
    body.inertia = R * moments.asDiagonal() * R.transpose();
    body.inertia = (0.5 * (body.inertia + body.inertia.transpose())).eval();
    description.bodies.push_back(body);
    parent_.push_back(0);
    dof_.push_back(0);
    return static_cast<int>(description.bodies.size()) - 1;
  }

  Eigen::Vector3d RandomTurn() {
    if (!spatial) return {0.0, 0.0, random.Uniform(-3.0, 3.0)};
    return random.Vector(1.5, true);
  }

  /// Where a bar of about a metre meets the next one.
  Eigen::Vector3d Tip() {
    const Eigen::Vector3d along = random.Uniform(0.6, 1.4) * Eigen::Vector3d::UnitX();
    return along + random.Vector(0.2, spatial);
  }

  /// Tree joint from `parent` to `child`; `turned`: in any frames, the other way round at times.
  int AddJoint(JointType type, int parent, const Eigen::Vector3d& at_parent, int child,
               const Eigen::Vector3d& at_child, double q, bool turned = true);

  /// A joint between bodies that already have poses: F is put where M is, less the joint's q.
  void Close(JointType type, int from, int to, const Eigen::Vector3d& at_to, double q) {
    JointDescription joint;
    joint.name = "c" + std::to_string(description.joints.size());
    joint.type = type;
    joint.to = {to, at_to, RandomTurn()};
    // `from` carries its frame in the ground for now; FinishClosures() turns it into body axes
    joint.from = {from, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    SetParameter(joint);
    // the others are cut for having no initial value, but helical joints like to be followed
    joint.cut = random.Chance(0.5) || type == JointType::kHelical;
    closures_.push_back({joint, Values(type, q)});
  }

  /// Free speeds of the tree path between two bodies.
  int PathFreedom(int a, int b) const {
    std::vector<int> up(parent_.size(), -1);
    int freedom = 0;
    for (int body = a, sum = 0; body >= 0; body = body == 0 ? -1 : parent_[body]) {
      up[body] = sum;
      sum += dof_[body];
    }
    for (int body = b; up[body] < 0; body = parent_[body]) freedom += dof_[body];
    int meet = b;
    while (up[meet] < 0) meet = parent_[meet];
    return freedom + up[meet];
  }

  /// Any kind of function of time, with kinks between -1 s and 2 s.
  TimeFunctionDescription RandomFunction();
  /// Forces of every kind.
  void AddForces(int count);

  /// Prescribes a coordinate of each of up to `count` tree joints, starting where it stands.
  void AddMotions(int count);

  /// Forces on the tree joints, then the loops.
  MechanismDescription Finish() {
    AddForces(1 + static_cast<int>(description.joints.size()) / 2);
    FinishClosures();
    return description;
  }

  Random random;
  bool spatial;
  MechanismDescription description;

 private:
  static Eigen::Matrix3d TurnMatrix(const Eigen::Vector3d& turn) {
    return Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  }

  void SetParameter(JointDescription& joint) {
    if (joint.type == JointType::kHelical) joint.parameter = random.Uniform(-0.5, 0.5);
  }

  /// Coordinates of a joint: `q` if it has one, else random; of a rod, its shift.
  std::vector<double> Values(JointType type, double q);

  std::vector<JetPose> Poses() const;
  void FinishClosures();

  std::vector<int> parent_ = {0}, dof_ = {0};
  std::vector<std::pair<JointDescription, std::vector<double>>> closures_;
};

/// The description's own coordinates; joints without one are at rest in the ground's frame.
template <class Space>
VectorX<double> DescribedCoordinates(const MechanismDescription& description,
                                     const Mechanism<Space, double>& mechanism) {
  VectorX<double> q = VectorX<double>::Zero(mechanism.num_q());
  for (const Joint<Space, double>& joint : mechanism.joints()) {
    if (joint.in_tree() && joint.kind->has_quaternion()) q[joint.q_offset] = 1.0;
  }
  for (const JointValues& values : description.initial.coordinates) {
    const Joint<Space, double>& joint = mechanism.joints()[values.joint];
    for (int i = 0, next = joint.q_offset; i < joint.kind->num_q; ++i) {
      if (mechanism.DriveOf(joint, i) < 0) q[next++] = values.values[i];
    }
  }
  return q;
}

}  // namespace loopbench::testing
