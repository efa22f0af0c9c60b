#include "mechanism/simplify/restart.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "mechanism/model/kinematics.h"
#include "mechanism/start/assembly.h"

namespace loopbench {

namespace {

std::string NameOf(const MechanismDescription& description, int body) {
  return body == kGround ? "" : description.bodies[body].name;
}

template <class Space>
BodyStart StartOf(const Kinematics<Space, double>& kinematics, int body,
                  const Eigen::Vector3d& com) {
  BodyStart start;
  const Pose<Space, double>& pose = kinematics.poses()[body];
  const Velocity<Space, double>& V = kinematics.motions()[body];
  start.X.R.topLeftCorner<Space::kLin, Space::kLin>() = pose.R.eigen();
  start.X.p.head<Space::kLin>() = pose.p.eigen();
  start.w.tail<Space::kRot>() = V.angular.eigen();
  start.v.head<Space::kLin>() = V.linear.eigen();
  if constexpr (Space::kRot == 1) start.angle = pose.angle;
  const Eigen::Vector3d to_origin = start.X.R * -com;
  start.X.p += to_origin;
  start.v += start.w.cross(to_origin);
  return start;
}

template <class Space>
BodyStarts AssembledIn(const MechanismDescription& description, std::string* why) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  BodyStarts starts;
  if (start.outcome != Outcome::kFinished) {
    *why = start.message;
    return starts;
  }
  Kinematics<Space, double> kinematics(mechanism);
  kinematics.UpdatePosition(start.q);
  kinematics.UpdateVelocity(start.u);
  for (int body = 0; body < mechanism.num_bodies(); ++body) {
    const Eigen::Vector3d com =
        body == kGround ? Eigen::Vector3d::Zero() : description.bodies[body].com;
    starts[NameOf(description, body)] = StartOf<Space>(kinematics, body, com);
  }
  starts[""] = {};
  return starts;
}

/// Positions and speeds of bodies on free joints of their own.
template <class Space>
void SetAbsolute(const MechanismDescription& description, const BodyStarts& starts,
                 const Mechanism<Space, double>& absolute, VectorX<double>* q, VectorX<double>* u) {
  q->setZero(absolute.num_q());
  u->setZero(absolute.num_u());
  for (const TreeStep& step : absolute.tree()) {
    const Joint<Space, double>& joint = absolute.joints()[step.joint];
    const BodyStart& start = starts.at(NameOf(description, step.child));
    const Eigen::Vector3d arm = start.X.R * description.bodies[step.child].com;
    const Eigen::Vector3d p = start.X.p + arm, v = start.v + start.w.cross(arm);
    double* to_q = q->data() + joint.q_offset;
    double* to_u = u->data() + joint.u_offset;
    if constexpr (Space::kRot == 1) {
      to_q[0] = start.angle;
    } else {
      Rotation<Spatial, double> R;
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) R(i, k) = start.X.R(i, k);
      }
      ToQuaternion(R, to_q);
    }
    for (int i = 0; i < Space::kLin; ++i) {
      to_q[joint.kind->num_q - Space::kLin + i] = p[i];
      to_u[Space::kRot + i] = v[i];
    }
    for (int i = 0; i < Space::kRot; ++i) to_u[i] = start.w[3 - Space::kRot + i];
  }
}

/// An explicit free joint, to the body's origin, for each part that floats.
void AddFreeJoints(MechanismDescription* description) {
  for (const TreeEdge& edge : BuildTopology(*description, Coordinates::kJoint).edges) {
    if (edge.joint >= 0) continue;
    JointDescription free;
    free.name = description->bodies[edge.child].name;
    const auto taken = [&](const JointDescription& joint) { return joint.name == free.name; };
    while (std::ranges::any_of(description->joints, taken)) free.name += " (free)";
    free.type = JointType::kFree;
    free.to.body = edge.child;
    description->joints.push_back(free);
  }
}

/// All followed joints, with their coordinates and speeds.
template <class Space>
InitialDescription InitialIn(const MechanismDescription& description, const BodyStarts& starts) {
  const Mechanism<Space, double> absolute(description, Coordinates::kAbsolute);
  const Mechanism<Space, double> joints(description, Coordinates::kJoint);
  VectorX<double> q, u;
  SetAbsolute<Space>(description, starts, absolute, &q, &u);
  Kinematics<Space, double> from(absolute), to(joints);
  from.UpdatePosition(q);
  from.UpdateVelocity(u);
  const VectorX<double> joint_q = from.CoordinatesIn(joints);
  to.UpdatePosition(joint_q);
  const VectorX<double> joint_u = from.SpeedsIn(to);
  InitialDescription initial;
  for (const TreeStep& step : joints.tree()) {
    const Joint<Space, double>& joint = joints.joints()[step.joint];
    if (joint.description < 0 || joint.num_u() == 0) continue;
    // coordinates that follow a given motion have a place, and any value
    const auto values = [&](const double* numbers, int count) {
      std::vector<double> all;
      for (int i = 0, next = 0; i < count; ++i) {
        all.push_back(joints.DriveOf(joint, i) >= 0 ? 0.0 : numbers[next++]);
      }
      return all;
    };
    initial.coordinates.push_back(
        {joint.description, values(joint_q.data() + joint.q_offset, joint.kind->num_q)});
    initial.speeds.push_back(
        {joint.description, values(joint_u.data() + joint.u_offset, joint.kind->num_u)});
  }
  return initial;
}

template <class Space>
std::string AssemblyFault(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  if (start.outcome != Outcome::kFinished) return start.message;
  return start.has_given_speeds ? "" : "the given speeds contradict each other";
}

template <class Space>
std::string StartIn(const BodyStarts& starts, MechanismDescription* changed) {
  const InitialDescription given = changed->initial;
  changed->initial = {};
  AddFreeJoints(changed);
  const InitialDescription all = InitialIn<Space>(*changed, starts);
  const auto followed = [&](int joint) {
    return std::ranges::find(all.coordinates, joint, &JointValues::joint) != all.coordinates.end();
  };
  std::vector<int> held = given.held;
  std::erase_if(held, [&](int joint) { return !followed(joint); });
  std::vector<JointValues> given_speeds = given.speeds;
  std::erase_if(given_speeds, [&](const JointValues& speed) { return !followed(speed.joint); });
  std::string fault;
  for (const InitialDescription& tried : {InitialDescription{all.coordinates, all.speeds, held},
                                          InitialDescription{all.coordinates, given_speeds, held},
                                          InitialDescription{all.coordinates, given_speeds, {}},
                                          InitialDescription{all.coordinates, {}, {}}}) {
    changed->initial = tried;
    const std::string message = AssemblyFault<Space>(*changed);
    if (message.empty()) return "";
    if (fault.empty()) fault = message;
  }
  return fault;
}

}  // namespace

BodyStarts AssembledStart(const MechanismDescription& description, std::string* why) {
  why->clear();
  return description.space == SpaceKind::kPlanar ? AssembledIn<Planar>(description, why)
                                                 : AssembledIn<Spatial>(description, why);
}

std::string StartAt(const BodyStarts& starts, MechanismDescription* changed) {
  return changed->space == SpaceKind::kPlanar ? StartIn<Planar>(starts, changed)
                                              : StartIn<Spatial>(starts, changed);
}

MechanismDescription WithAssembledStart(const MechanismDescription& description, std::string* why) {
  const BodyStarts starts = AssembledStart(description, why);
  if (!why->empty()) return description;
  MechanismDescription whole = description;
  *why = StartAt(starts, &whole);
  return why->empty() ? whole : description;
}

}  // namespace loopbench
