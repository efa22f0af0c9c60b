// Links of small mass: massless rods.
#include <algorithm>
#include <set>

#include "mechanism/simplify/attach.h"
#include "mechanism/simplify/compile.h"
#include "mechanism/simplify/freedom.h"
#include "mechanism/simplify/model.h"
#include "mechanism/simplify/restart.h"

namespace loopbench {

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
      return std::string("a ") + std::string(parts.name) + " acts in one of its joints";
    }
    const auto on_link = [&](const BodyPoint* point) { return point->body == link.body; };
    if (std::ranges::any_of(parts.points, on_link)) {
      return std::string("a ") + std::string(parts.name) + " acts on it";
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
  JointDescription rod;
  rod.name = body.name;
  const auto taken = [&](const JointDescription& joint) { return joint.name == rod.name; };
  while (std::ranges::any_of(result.joints, taken)) rod.name += " (rod)";
  rod.type = JointType::kRod;
  rod.from = {kept.bodies[link.other[0].body], link.other[0].position, Eigen::Vector3d::Zero()};
  rod.to = {kept.bodies[link.other[1].body], link.other[1].position, Eigen::Vector3d::Zero()};
  rod.parameter = link.length;
  result.joints.push_back(rod);
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
  const auto name = [&](int body) {
    return body == kGround ? std::string("ground") : description.bodies[body].name;
  };
  return "link \"" + name(link.body) + "\" between \"" + name(link.other[0].body) + "\" and \"" +
         name(link.other[1].body) + "\"";
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

}  // namespace loopbench
