// Springs much faster than the motion: rods, and fixed joints.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "mechanism/model/joint.h"
#include "mechanism/simplify/attach.h"
#include "mechanism/simplify/compile.h"
#include "mechanism/simplify/freedom.h"
#include "mechanism/simplify/model.h"
#include "mechanism/simplify/restart.h"

namespace loopbench {

namespace {

/// A spring, its natural frequency alone, and the rate of slower motions [rad/s].
struct Spring {
  int force = 0;
  double frequency = 0.0, rate = 0.0;

  double ratio() const { return frequency / rate; }
};

std::string Named(const MechanismDescription& description, const ForceDescription& force) {
  if (const auto* spring = std::get_if<JointSpring>(&force)) {
    return "spring in joint \"" + description.joints[spring->joint].name + "\"";
  }
  const auto& spring = std::get<SpringDamper>(force);
  const auto name = [&](const BodyPoint& point) {
    return point.body == kGround ? std::string("ground") : description.bodies[point.body].name;
  };
  return "spring between \"" + name(spring.from) + "\" and \"" + name(spring.to) + "\"";
}

std::vector<Spring> FindSprings(const MechanismDescription& description, const Freedom& freedom) {
  std::vector<Spring> springs;
  for (std::size_t i = 0; i < description.forces.size(); ++i) {
    double stiffness = 0.0;
    if (const auto* spring = std::get_if<JointSpring>(&description.forces[i])) {
      stiffness = spring->stiffness;
    } else if (const auto* between = std::get_if<SpringDamper>(&description.forces[i])) {
      stiffness = between->stiffness;
    }
    if (stiffness == 0.0) continue;
    springs.push_back({static_cast<int>(i), std::sqrt(stiffness * freedom.mobility[i]), 0.0});
  }
  return springs;
}

/// Sets the reference rate of each spring: the motion's rate, or the frequency of a slower spring
/// that is not stiff. Such a spring is part of the motion.
void SetRates(double rate, double limit, std::vector<Spring>* springs) {
  std::vector<Spring*> order;
  for (Spring& spring : *springs) order.push_back(&spring);
  std::ranges::stable_sort(order, {}, &Spring::frequency);
  for (Spring* spring : order) {
    spring->rate = rate;
    if (spring->ratio() < limit) rate = std::max(rate, spring->frequency);
  }
}

/// A weld in the joint's place, at the coordinate where its spring is free.
void Hold(const MechanismDescription& description, const JointSpring& spring,
          JointDescription* joint) {
  const double q = FreeCoordinate(spring);
  if (description.space == SpaceKind::kPlanar) {
    const auto X = PoseAt(KindWith<Planar, double>(joint->type, joint->parameter), &q);
    const Eigen::Vector3d shift(X.p[0], X.p[1], 0.0);
    joint->from.position += PoseOf(joint->from).R * AxisAlignment(*joint) * shift;
    joint->from.rotation.z() += X.angle;
  } else {
    const auto X = PoseAt(KindWith<Spatial, double>(joint->type, joint->parameter), &q);
    const Eigen::Matrix3d A = AxisAlignment(*joint), R_PF = PoseOf(joint->from).R;
    joint->from.position += R_PF * A * X.p.eigen();
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(R_PF * A * X.R.eigen() * A.transpose()));
    joint->from.rotation = turn.angle() * turn.axis();
  }
  joint->type = JointType::kWeld;
  joint->axis.setZero();
  joint->parameter = 0.0;
  joint->cut = false;
}

JointDescription RodFor(const MechanismDescription& description, const SpringDamper& spring) {
  JointDescription rod;
  const auto name = [&](const BodyPoint& point) {
    return point.body == kGround ? std::string("ground") : description.bodies[point.body].name;
  };
  rod.name = name(spring.from) + "-" + name(spring.to);
  const auto taken = [&](const JointDescription& joint) { return joint.name == rod.name; };
  while (std::ranges::any_of(description.joints, taken)) rod.name += "'";
  rod.type = JointType::kRod;
  rod.from = {spring.from.body, spring.from.at, Eigen::Vector3d::Zero()};
  rod.to = {spring.to.body, spring.to.at, Eigen::Vector3d::Zero()};
  rod.parameter = FreeCoordinate(spring);
  return rod;
}

/// Returns the description with the springs of these forces rigid: without these forces, and
/// without forces along a fixed joint. Bodies connected by fixed joints become one.
MechanismDescription Held(const MechanismDescription& description, const std::vector<int>& forces) {
  MechanismDescription changed = description;
  std::vector<bool> held(description.joints.size(), false), gone(description.forces.size(), false);
  for (const int index : forces) {
    gone[index] = true;
    if (const auto* spring = std::get_if<JointSpring>(&description.forces[index])) {
      if (!held[spring->joint]) Hold(description, *spring, &changed.joints[spring->joint]);
      held[spring->joint] = true;
    } else {
      changed.joints.push_back(RodFor(changed, std::get<SpringDamper>(description.forces[index])));
    }
  }
  changed.forces.clear();
  for (std::size_t i = 0; i < description.forces.size(); ++i) {
    ForceDescription force = description.forces[i];
    const int* joint = PartsOf(force).joint;
    if (!gone[i] && (joint == nullptr || !held[*joint])) changed.forces.push_back(force);
  }
  const auto is_held = [&](int joint) { return held[joint]; };
  for (auto* values : {&changed.initial.coordinates, &changed.initial.speeds}) {
    std::erase_if(*values, [&](const JointValues& one) { return is_held(one.joint); });
  }
  std::erase_if(changed.initial.held, is_held);
  held.resize(changed.joints.size(), false);
  const std::vector<Attachment> attachments = FindWelded(changed, held);
  if (std::ranges::none_of(attachments, &Attachment::attached)) return changed;
  Renumbering renumbering;
  return MergeRigidBodies(changed, attachments, &renumbering);
}

/// Returns the reason why a spring cannot become rigid, for any stiffness; "" if it can.
std::string Obstacle(const MechanismDescription& description, const ForceDescription& force) {
  if (const auto* spring = std::get_if<JointSpring>(&force)) {
    return description.joints[spring->joint].motions.empty() ? ""
                                                             : "its joint follows a given motion";
  }
  const double length = FreeCoordinate(std::get<SpringDamper>(force));
  return length > 0.0 ? "" : "it is free where its points meet, and a rod has a length";
}

void Say(const MechanismDescription& description, const Spring& spring, double off,
         Simplified* result) {
  const ForceDescription& force = description.forces[spring.force];
  const std::string name = Named(description, force);
  if (const auto* between = std::get_if<SpringDamper>(&force)) {
    result->done.push_back(name + " is a rod of " + NumberText(FreeCoordinate(*between), 4) + " m");
    if (between->damping > 0.0) result->dropped.push_back("the damper of the " + name);
  } else {
    result->done.push_back(name + " holds it at " +
                           NumberText(FreeCoordinate(std::get<JointSpring>(force)), 4));
  }
  result->dropped.push_back("the oscillation of the " + name + " at " +
                            NumberText(spring.frequency, 2) + " rad/s, where the motion has " +
                            NumberText(spring.rate, 2) + "; it starts off by " +
                            NumberText(off, 4));
}

}  // namespace

Simplified HoldStiffSprings(const MechanismDescription& description, const ShortRun& run,
                            const SimplifyOptions& options) {
  Simplified result;
  result.parts = {description};
  const Freedom freedom = MeasureFreedom(description);
  result.why_not = freedom.why;
  if (!result.applies()) return result;
  std::vector<Spring> springs = FindSprings(description, freedom);
  if (springs.empty()) result.why_not = kNothingOfTheKind;
  const double rate = std::max(freedom.rate, run.rate);
  if (result.applies() && !(rate > 0.0)) {
    result.why_not = "the rate of the motion is unknown: it starts at rest, without gravity";
  }
  if (!result.applies()) return result;
  SetRates(rate, options.stiff_springs, &springs);
  std::string why;
  const BodyStarts starts = AssembledStart(description, &why);
  std::vector<int> held;
  for (const Spring& spring : springs) {
    const ForceDescription& force = description.forces[spring.force];
    Candidate& candidate = result.candidates.emplace_back(
        Candidate{Named(description, force), spring.ratio(), false, ""});
    if (candidate.number < options.stiff_springs) continue;
    if (candidate.why = Obstacle(description, force); !candidate.why.empty()) continue;
    held.push_back(spring.force);
    MechanismDescription changed = Held(description, held);
    if (const std::string fault = StartAt(starts, &changed); !fault.empty()) {
      candidate.why = "there is no start with it held: " + fault;
      held.pop_back();
      continue;
    }
    candidate.taken = true;
    result.parts.front() = std::move(changed);
    Say(description, spring, freedom.travel[spring.force], &result);
  }
  if (result.done.empty()) result.why_not = "no spring is stiff enough";
  return result;
}

}  // namespace loopbench
