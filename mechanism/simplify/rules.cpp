// The approximate simplification rules; plane.cpp has the one for nearly planar mechanisms.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <ranges>

#include "mechanism/model/mechanism.h"
#include "mechanism/simplify/attach.h"
#include "mechanism/simplify/compile.h"
#include "mechanism/simplify/model.h"
#include "mechanism/simplify/restart.h"

namespace loopbench {

namespace {

std::string NameOf(const MechanismDescription& description, int body) {
  return body == kGround ? "ground" : description.bodies[body].name;
}

std::string Quoted(const MechanismDescription& description, int body) {
  return '"' + NameOf(description, body) + '"';
}

JointDescription Rod(const std::string& name, const BodyPoint& from, const BodyPoint& to,
                     double length) {
  JointDescription rod;
  rod.name = name;
  rod.type = JointType::kRod;
  rod.from = {from.body, from.at};
  rod.to = {to.body, to.at};
  rod.parameter = length;
  return rod;
}

// Bodies that hardly move against each other: one body.

/// Turn and shift as one number: rad, or lengths of the mechanism.
double SizeOf(const Travel& travel, double length) {
  return std::max(travel.turn, travel.shift / length);
}

std::string CandidateName(const JointDescription& joint) { return "joint \"" + joint.name + "\""; }

/// Attachments of bodies to the lowest body of their set.
std::vector<Attachment> Attachments(const MechanismDescription& description, DisjointSets& sets,
                                    const BodyStarts& starts) {
  const auto start_of = [&](int body) {
    return starts.at(body == kGround ? "" : description.bodies[body].name);
  };
  std::vector<Attachment> attachments(description.bodies.size());
  for (int body = 1; body < static_cast<int>(attachments.size()); ++body) {
    const int carrier = sets.Find(body);
    if (carrier == body) continue;
    const BodyStart on = start_of(carrier), it = start_of(body);
    attachments[body] = {carrier, on.X.Inverse() * it.X, it.angle - on.angle, true};
  }
  return attachments;
}

/// Trial model with the taken joints' bodies as one.
class Freezing {
 public:
  Freezing(const MechanismDescription& description, const BodyStarts& starts, Simplified* result)
      : d_(description), starts_(starts), result_(*result), was_still_(FindStill(description)) {}

  /// Returns "" or the reason why there is no model. Drops candidates with the largest travel
  /// first, until no joint stops that should move: one fixed by a loop of joints within one body.
  std::string Run() {
    for (;;) {
      if (std::string fault = Build(); !fault.empty()) return fault;
      const std::size_t stopped = Stopped().size();
      if (stopped == 0) return "";
      const std::string name = Stopped().front();
      Candidate* least = nullptr;  // helps, or else travels furthest
      for (Candidate* candidate : TakenFurthestFirst()) {
        if (least == nullptr) least = candidate;
        candidate->taken = false;
        const bool helps = Build().empty() && Stopped().size() < stopped;
        candidate->taken = true;
        if (!helps) continue;
        least = candidate;
        break;
      }
      if (least == nullptr) return "no joint is at rest";
      least->taken = false;
      least->why = "held, it would stop joint \"" + name + "\", which moves";
    }
  }

  const std::vector<Attachment>& attachments() const { return attachments_; }
  const Renumbering& renumbering() const { return renumbering_; }

 private:
  bool IsTaken(const JointDescription& joint) const {
    return std::ranges::any_of(result_.candidates, [&](const Candidate& candidate) {
      return candidate.taken && candidate.what == CandidateName(joint);
    });
  }

  std::vector<Candidate*> TakenFurthestFirst() {
    std::vector<Candidate*> taken;
    for (Candidate& candidate : result_.candidates) {
      if (candidate.taken) taken.push_back(&candidate);
    }
    std::ranges::stable_sort(taken, std::greater<>(), &Candidate::number);
    return taken;
  }

  std::string Build() {
    DisjointSets sets(static_cast<int>(d_.bodies.size()));
    bool any = false;
    for (const JointDescription& joint : d_.joints) {
      if (!IsTaken(joint)) continue;
      any = true;
      sets.Unite(joint.from.body, joint.to.body);
    }
    if (!any) return "no joint is at rest";
    attachments_ = Attachments(d_, sets, starts_);
    const bool moves = std::ranges::any_of(std::views::iota(0, static_cast<int>(d_.bodies.size())),
                                           [&](int body) { return sets.Find(body) != kGround; });
    if (!moves) return "nothing would move";
    result_.parts = {MergeRigidBodies(d_, attachments_, &renumbering_)};
    return StartAt(starts_, &result_.parts.front());
  }

  /// Joints that move no more, though they did and were not taken.
  std::vector<std::string> Stopped() const {
    const std::vector<bool> still = FindStill(result_.parts.front());
    std::vector<std::string> stopped;
    for (std::size_t j = 0; j < d_.joints.size(); ++j) {
      const int now = renumbering_.joints[j];
      if (now >= 0 && still[now] && !was_still_[j]) stopped.push_back(d_.joints[j].name);
    }
    return stopped;
  }

  const MechanismDescription& d_;
  const BodyStarts& starts_;
  Simplified& result_;
  std::vector<bool> was_still_;
  std::vector<Attachment> attachments_;
  Renumbering renumbering_;
};

}  // namespace

Simplified FreezeConstantParts(const MechanismDescription& description, const ShortRun& run,
                               const SimplifyOptions& options) {
  Simplified result;
  result.parts = {description};
  if (run.travels.empty()) {
    result.why_not = "there was no trial run";
    if (!run.message.empty()) result.why_not += ": " + run.message;
    return result;
  }
  const BodyStarts starts = AssembledStart(description, &result.why_not);
  if (!result.applies()) return result;
  const double length = ForSpace(description.space, [&]<class Space>(Space) {
    return Mechanism<Space, double>(description, Coordinates::kJoint).length();
  });
  for (const JointDescription& joint : description.joints) {
    const auto travel = run.travels.find(joint.name);
    if (travel == run.travels.end() || joint.type == JointType::kWeld) continue;
    const double number = SizeOf(travel->second, length);
    const bool is_driven = !joint.motions.empty();
    result.candidates.push_back({CandidateName(joint), number,
                                 !is_driven && number <= options.constant_parts,
                                 is_driven ? "its motion is prescribed" : ""});
  }
  Freezing freezing(description, starts, &result);
  if (result.why_not = freezing.Run(); !result.applies()) {
    for (Candidate& candidate : result.candidates) candidate.taken = false;
    result.parts = {description};
    return result;
  }
  const std::vector<Attachment>& attachments = freezing.attachments();
  for (std::size_t b = 1; b < attachments.size(); ++b) {
    if (!attachments[b].attached) continue;
    result.done.push_back("body " + Quoted(description, static_cast<int>(b)) + " is fixed to " +
                          Quoted(description, attachments[b].carrier) + " in its initial pose");
  }
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    if (freezing.renumbering().joints[j] >= 0) continue;
    result.dropped.push_back("joint \"" + description.joints[j].name +
                             "\" with the forces along it");
  }
  return result;
}

// Links of small mass: massless rods.

namespace {

/// A body with two joints, and the bodies at their other sides.
struct Link {
  int body = 0;
  int joints[2] = {-1, -1};
  JointSide own[2] = {}, other[2] = {};
  double length = 0.0;  ///< distance of the joints [m]
};

bool IsPin(SpaceKind space, JointType type) {
  return space == SpaceKind::kPlanar
             ? type == JointType::kRevolute
             : type == JointType::kSpherical || type == JointType::kUniversal;
}

/// Returns bodies with two joints that a rod can replace.
std::vector<Link> FindLinks(const MechanismDescription& description) {
  std::vector<Link> links;
  for (int body = 1; body < static_cast<int>(description.bodies.size()); ++body) {
    Link link{.body = body};
    int joints = 0, pins = 0, universals = 0;
    for (int j = 0; j < static_cast<int>(description.joints.size()); ++j) {
      const JointDescription& joint = description.joints[j];
      if (joint.from.body != body && joint.to.body != body) continue;
      pins += IsPin(description.space, joint.type);
      universals += joint.type == JointType::kUniversal;
      if (joints < 2) {
        const bool from = joint.from.body == body;
        link.joints[joints] = j;
        link.own[joints] = from ? joint.from : joint.to;
        link.other[joints] = from ? joint.to : joint.from;
      }
      ++joints;
    }
    // two universal joints transmit a moment about the line between them
    if (joints != 2 || pins != 2 || universals > 1) continue;
    link.length = (link.own[1].position - link.own[0].position).norm();
    links.push_back(link);
  }
  return links;
}

/// A share in the kinetic energy that is round-off.
constexpr double kStandsStill = 1e-15;

/// Returns the reason why the link cannot become a rod, for any mass; "" if it can.
std::string Obstacle(const MechanismDescription& description, const Link& link, double share) {
  if (link.other[0].body == link.other[1].body) return "both its ends are on one body";
  if (!(link.length > 0.0)) return "its joints are at one point";
  for (const int j : link.joints) {
    if (!description.joints[j].motions.empty()) return "one of its joints follows a given motion";
  }
  for (ForceDescription force : description.forces) {
    const ForceParts parts = PartsOf(force);
    if (parts.joint != nullptr && std::ranges::find(link.joints, *parts.joint) != link.joints + 2) {
      return "a " + std::string(parts.name) + " acts in one of its joints";
    }
    const auto on_link = [&](const BodyPoint* point) { return point->body == link.body; };
    if (std::ranges::any_of(parts.points, on_link)) {
      return "a " + std::string(parts.name) + " acts on it";
    }
  }
  if (share < kStandsStill) return "it does not move";
  return "";
}

/// Parts of the link's mass at its two ends, in [0, 1].
std::pair<double, double> Lumps(const BodyDescription& body, const Link& link, Lumping lumping) {
  if (lumping == Lumping::kNone) return {0.0, 0.0};
  if (lumping == Lumping::kHalf) return {0.5, 0.5};
  const Eigen::Vector3d along = link.own[1].position - link.own[0].position;
  const double s = (body.com - link.own[0].position).dot(along) / along.squaredNorm();
  const double second = std::clamp(s, 0.0, 1.0);
  return {1.0 - second, second};
}

/// Returns the description with a rod instead of the link, without its start.
MechanismDescription WithRod(const MechanismDescription& description, const Link& link,
                             Lumping lumping) {
  MechanismDescription changed = description;
  const BodyDescription& body = description.bodies[link.body];
  const auto [first, second] = Lumps(body, link, lumping);
  for (const int end : {0, 1}) {
    const JointSide& at = link.other[end];
    BodyDescription& neighbour = changed.bodies[at.body];
    for (const auto& [name, point] : body.points) {
      if (point == link.own[end].position) neighbour.points[body.name + "." + name] = at.position;
    }
    BodyDescription lump;
    lump.mass = body.mass * (end == 0 ? first : second);
    Frame X;
    X.p = at.position;
    if (at.body != kGround && lump.mass > 0.0) AddMass(lump, X, &neighbour);
  }
  Renumbering kept;
  for (int b = 0, next = 0; b < static_cast<int>(description.bodies.size()); ++b) {
    kept.bodies.push_back(b == link.body ? -1 : next++);
  }
  for (int j = 0, next = 0; j < static_cast<int>(description.joints.size()); ++j) {
    kept.joints.push_back(j == link.joints[0] || j == link.joints[1] ? -1 : next++);
  }
  MechanismDescription result = Select(changed, kept);
  const auto end = [&](int i) {
    return BodyPoint{kept.bodies[link.other[i].body], link.other[i].position};
  };
  result.joints.push_back(
      Rod(UnusedJointName(result, body.name, " (rod)"), end(0), end(1), link.length));
  return result;
}

/// Describes the losses of the rod: undistributed mass, and the inertia of the link's rotation.
std::string LumpingRemainder(const BodyDescription& body, const Link& link, Lumping lumping) {
  const auto [first, second] = Lumps(body, link, lumping);
  const double left = body.mass * (1.0 - first - second);
  const Eigen::Vector3d along = (link.own[1].position - link.own[0].position) / link.length;
  // about an axis across the rod, in space the mean of all
  const double across = 0.5 * (body.inertia.trace() - along.dot(body.inertia * along));
  const double inertia = body.inertia(2, 2);
  const double lumped = body.mass * first * second * link.length * link.length;
  const bool in_plane = body.inertia.isApprox(inertia * Eigen::Matrix3d::Identity(), 0.0);
  std::string text = "body \"" + body.name + "\" with its own inertia " +
                     NumberText(in_plane ? inertia : across, 4) +
                     " kg m^2 across the rod; two lumps have " + NumberText(lumped, 4);
  if (left > 0.0) text += "; " + NumberText(left, 4) + " kg removed";
  return text;
}

std::string Named(const MechanismDescription& description, const Link& link) {
  return "link " + Quoted(description, link.body) + " between " +
         Quoted(description, link.other[0].body) + " and " +
         Quoted(description, link.other[1].body);
}

}  // namespace

Simplified LightenLinks(const MechanismDescription& description, const ShortRun&,
                        const SimplifyOptions& options) {
  Simplified result;
  result.parts = {description};
  const Freedom freedom = MeasureFreedom(description);
  if (result.why_not = freedom.why; !result.applies()) return result;
  std::vector<std::pair<double, std::string>> order;  // share and name of the body
  for (const Link& link : FindLinks(description)) {
    const double share = freedom.shares[link.body];
    result.candidates.push_back(
        {Named(description, link), share, false, Obstacle(description, link, share)});
    const bool can_be = result.candidates.back().why.empty();
    if (can_be && share <= options.light_links)
      order.emplace_back(share, description.bodies[link.body].name);
  }
  std::ranges::sort(order);
  std::string why;
  const BodyStarts starts = AssembledStart(description, &why);
  MechanismDescription& model = result.parts.front();
  for (const auto& entry : order) {
    const std::string& name = entry.second;
    const std::vector<Link> links = FindLinks(model);
    const auto link = std::ranges::find_if(
        links, [&](const Link& one) { return model.bodies[one.body].name == name; });
    const auto candidate = std::ranges::find_if(result.candidates, [&](const Candidate& one) {
      return one.what.starts_with("link \"" + name + "\" ");
    });
    if (link == links.end()) {
      candidate->why = "one of its joints went with another link";
      continue;
    }
    MechanismDescription with_rod = WithRod(model, *link, options.lumping);
    if (const std::string fault = StartAt(starts, &with_rod); !fault.empty()) {
      candidate->why = "there is no start without it: " + fault;
      continue;
    }
    candidate->taken = true;
    result.done.push_back(Named(model, *link) + " is a massless rod of " +
                          NumberText(link->length, 4) + " m");
    result.dropped.push_back(LumpingRemainder(model.bodies[link->body], *link, options.lumping));
    model = std::move(with_rod);
  }
  if (result.candidates.empty()) {
    result.why_not = "no body has two pins and no other joint";
  } else if (result.done.empty()) {
    result.why_not = "no link is light enough and free of forces";
  }
  return result;
}

// Springs much faster than the motion: rods, and fixed joints.

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
  return "spring between " + Quoted(description, spring.from.body) + " and " +
         Quoted(description, spring.to.body);
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
  const std::string name =
      NameOf(description, spring.from.body) + "-" + NameOf(description, spring.to.body);
  return Rod(UnusedJointName(description, name, "'"), spring.from, spring.to,
             FreeCoordinate(spring));
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

void DescribeChange(const MechanismDescription& description, const Spring& spring, double off,
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
    DescribeChange(description, spring, freedom.travel[spring.force], &result);
  }
  if (result.done.empty()) result.why_not = "no spring is stiff enough";
  return result;
}

}  // namespace loopbench
