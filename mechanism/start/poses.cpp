#include "mechanism/start/poses.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mechanism/start/closure.h"

namespace loopbench {

namespace {

/// Share of a link, or of a radian, from which a target counts as missed.
constexpr double kMissed = 0.01;

JointDescription JointOf(const PoseTarget& target, const MechanismDescription& description) {
  JointDescription joint;
  joint.name = "target of " + description.bodies[target.body].name;
  joint.type = JointType::kFree;
  joint.cut = true;
  joint.from.position = target.at.value_or(Eigen::Vector3d::Zero());
  joint.from.rotation = target.rotation.value_or(Eigen::Vector3d::Zero());
  joint.to.body = target.body;
  joint.to.position = target.point;
  return joint;
}

/// The coordinates of the joint that are given, 0 there; NaN for others.
std::vector<double> ValuesOf(const PoseTarget& target, SpaceKind space) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const bool planar = space == SpaceKind::kPlanar;
  std::vector<double> values(planar ? 1 : 4, target.rotation ? 0.0 : kNone);
  if (!planar && target.rotation) values[0] = 1.0;
  values.insert(values.end(), planar ? 2 : 3, target.at ? 0.0 : kNone);
  return values;
}

}  // namespace

MechanismDescription WithTargets(const MechanismDescription& description) {
  MechanismDescription result = description;
  result.initial.poses.clear();
  for (const PoseTarget& target : description.initial.poses) {
    const int joint = static_cast<int>(result.joints.size());
    result.joints.push_back(JointOf(target, description));
    result.initial.coordinates.push_back(
        {joint, ValuesOf(target, description.space), target.weight});
    if (target.fixed) result.initial.held.push_back(joint);
  }
  return result;
}

namespace {

/// Coordinates of a joint that closes a loop; angles within half a turn of the guess.
template <class Space>
void Measure(const Kinematics<Space, double>& kinematics, JointValues* guess) {
  const Joint<Space, double>& joint = kinematics.mechanism().joints()[guess->joint];
  double q[7] = {};
  joint.kind->coordinates(kinematics.MeasuredPose(joint), q, joint.kind->parameter);
  for (std::size_t i = 0; i < guess->values.size(); ++i) {
    double& value = guess->values[i];
    value = joint.kind->IsAngle(static_cast<int>(i)) ? value + std::remainder(q[i] - value, kTurn)
                                                     : q[i];
  }
}

}  // namespace

std::string ResolvePoses(MechanismDescription* description) {
  if (description->initial.poses.empty()) return "";
  return ForSpace(description->space, [&]<class Space>(Space) -> std::string {
    const MechanismDescription whole = WithTargets(Unreleased(*description));
    const Mechanism<Space, double> mechanism(whole, Coordinates::kJoint);
    for (std::size_t j = description->joints.size(); j < whole.joints.size(); ++j) {
      if (!mechanism.joints()[j].in_tree()) continue;
      return "no joint connects body \"" + whole.bodies[whole.joints[j].to.body].name +
             "\" to ground, not even a free one";
    }
    const Start<double> start = Assemble<Space>(whole, mechanism);
    if (start.outcome == Outcome::kInconsistentStart) return start.message;
    Kinematics<Space, double> kinematics(mechanism);
    kinematics.UpdatePosition(start.q);
    InitialDescription& initial = description->initial;
    for (JointValues& values : TreeValues(mechanism, start.q)) {
      const auto given = std::ranges::find(initial.coordinates, values.joint, &JointValues::joint);
      if (given == initial.coordinates.end()) {
        initial.coordinates.push_back(std::move(values));
      } else {
        given->values = std::move(values.values);
      }
    }
    for (JointValues& values : initial.coordinates) {
      const bool in_tree = mechanism.joints()[values.joint].in_tree();
      if (!in_tree && !initial.IsHeld(values.joint)) Measure(kinematics, &values);
    }
    return "";
  });
}

std::vector<MissedPose> FindMissedPoses(const MechanismDescription& description,
                                        const VectorX<double>& q) {
  if (description.initial.poses.empty()) return {};
  return ForSpace(description.space, [&]<class Space>(Space) {
    const MechanismDescription whole = WithTargets(description);
    const Mechanism<Space, double> mechanism(whole, Coordinates::kJoint);
    Kinematics<Space, double> kinematics(mechanism);
    kinematics.UpdatePosition(q);
    std::vector<MissedPose> missed;
    for (std::size_t i = 0; i < description.initial.poses.size(); ++i) {
      const PoseTarget& target = description.initial.poses[i];
      const Pose<Space, double> apart =
          kinematics.MeasuredPose(mechanism.joints()[description.joints.size() + i]);
      const double turn = RotationVector(apart).norm();
      const MissedPose by{&target, target.at ? apart.p.norm() : 0.0,
                          target.rotation ? std::abs(std::remainder(turn, kTurn)) : 0.0};
      if (by.turn > kMissed || by.shift > kMissed * 2.0 * mechanism.length()) missed.push_back(by);
    }
    return missed;
  });
}

}  // namespace loopbench
