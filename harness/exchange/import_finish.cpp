// What is done with an imported mechanism whatever its format.
#include <fmt/format.h>

#include <algorithm>

#include "harness/config/sidecar.h"
#include "harness/exchange/import_draft.h"
#include "harness/text/config_error.h"
#include "mechanism/description/islands.h"
#include "mechanism/simplify/attach.h"

namespace loopbench::harness {

namespace {

bool IsMassless(const BodyDescription& body) { return body.mass == 0.0; }

/// The bodies that welds hold to `root` through bodies without mass, with the root's carrier: the
/// ground if it is among them, else the first with a mass.
class Cluster {
 public:
  /// `welds`: numbers of the welds at each body.
  Cluster(const MechanismDescription& description, const std::vector<std::vector<int>>& welds,
          int root)
      : d_(description) {
    poses_[root] = Frame();
    std::vector<int> queue = {root};
    for (std::size_t k = 0; k < queue.size(); ++k) {
      for (const int weld : welds[static_cast<std::size_t>(queue[k])]) {
        const JointDescription& joint = d_.joints[static_cast<std::size_t>(weld)];
        for (const auto& [here, there] :
             {std::pair{&joint.from, &joint.to}, {&joint.to, &joint.from}}) {
          if (here->body != queue[k] || poses_.contains(there->body)) continue;
          poses_[there->body] = poses_[here->body] * PoseOf(*here) * PoseOf(*there).Inverse();
          if (there->body == kGround || (carrier_ < 0 && !IsMasslessBody(there->body))) {
            carrier_ = there->body;
          }
          if (IsMasslessBody(there->body)) queue.push_back(there->body);
        }
      }
    }
    massless_ = std::move(queue);
  }

  int carrier() const { return carrier_; }
  const std::vector<int>& massless() const { return massless_; }
  Attachment AttachmentOf(int body) const {
    Attachment at;
    at.carrier = carrier_;
    at.attached = true;
    at.X = poses_.at(carrier_).Inverse() * poses_.at(body);
    return at;
  }

 private:
  bool IsMasslessBody(int body) const {
    return body != kGround && IsMassless(d_.bodies[static_cast<std::size_t>(body)]);
  }

  const MechanismDescription& d_;
  std::map<int, Frame> poses_;
  std::vector<int> massless_;
  int carrier_ = -1;
};

std::vector<std::vector<int>> WeldsAtBodies(const MechanismDescription& description) {
  std::vector<std::vector<int>> welds(description.bodies.size());
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    const JointDescription& joint = description.joints[j];
    if (joint.type != JointType::kWeld) continue;
    for (const int body : {joint.from.body, joint.to.body}) {
      welds[static_cast<std::size_t>(body)].push_back(static_cast<int>(j));
    }
  }
  return welds;
}

}  // namespace

void ImportDraft::RefuseMassless(int body) const {
  elements_[static_cast<std::size_t>(body)].Fail(
      "a body without mass that moves",
      "a mass > 0, or a joint that fixes it to a body with one: nothing could accelerate it");
}

void ImportDraft::MergeMassless() {
  const std::size_t count = description.bodies.size();
  std::vector<Attachment> attachments(count);
  const std::vector<std::vector<int>> welds = WeldsAtBodies(description);
  bool any = false;
  for (std::size_t i = 1; i < count; ++i) {
    if (!IsMassless(description.bodies[i]) || attachments[i].attached) continue;
    const Cluster cluster(description, welds, static_cast<int>(i));
    if (cluster.carrier() < 0) RefuseMassless(static_cast<int>(i));
    for (const int body : cluster.massless()) {
      const auto index = static_cast<std::size_t>(body);
      attachments[index] = cluster.AttachmentOf(body);
      const auto carrier = static_cast<std::size_t>(cluster.carrier());
      const BodyDescription& merged = description.bodies[index];
      std::string reason = fmt::format("without mass and fixed: merged with \"{}\"",
                                       description.bodies[carrier].name);
      if (!merged.points.empty()) reason += fmt::format(", points are \"{}.POINT\"", merged.name);
      Note(elements_[index], reason);
    }
    any = true;
  }
  if (!any) return;
  Renumbering renumbering;
  description = Attach(description, attachments, &renumbering);
  std::vector<Placement> rest(description.bodies.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (renumbering.bodies[i] >= 0) {
      rest[static_cast<std::size_t>(renumbering.bodies[i])] = at_rest[i];
    }
  }
  at_rest = std::move(rest);
}

void ImportDraft::HoldFloatingParts() {
  for (const Island& island : FindIslands(description, Connection::kJoints)) {
    if (island.grounded) continue;
    const int root = island.bodies.front();
    const auto index = static_cast<std::size_t>(root);
    AddJoint(NameLater(description.bodies[index].name), JointType::kFree, kGround, {}, root, {});
    const Placement& X = at_rest[index];
    description.initial.coordinates.push_back(
        {last_joint(), {X.q.w(), X.q.x(), X.q.y(), X.q.z(), X.p.x(), X.p.y(), X.p.z()}});
  }
  NameJoints();
}

Imported ImportDraft::Finish(const std::string& format) {
  Imported imported;
  imported.format = format;
  NameJoints();
  bool gravity_is_said = options_.gravity.has_value() || !assumed_gravity_;
  if (!options_.sidecar.empty()) {
    std::vector<Frame> rest;
    for (const Placement& X : at_rest) rest.push_back(X.AsFrame());
    const SidecarFacts facts = ReadSidecar(options_.sidecar, rest, &description);
    imported.observe = facts.observe;
    gravity_is_said = gravity_is_said || facts.has_gravity;
  }
  if (!gravity_is_said) {
    Note(*assumed_gravity_, fmt::format("no gravity is said: {} m/s^2 along -z (--gravity x,y,z "
                                        "says another)",
                                        -description.gravity.z()));
  }
  if (options_.gravity) description.gravity = *options_.gravity;
  for (const auto& [body, share] : lifts_) {
    const BodyDescription& lifted = description.bodies[static_cast<std::size_t>(body)];
    if (!(lifted.mass > 0.0) || description.gravity.isZero(0.0)) continue;
    description.forces.emplace_back(
        PointForce{{body, lifted.com}, -share * lifted.mass * description.gravity, false});
  }
  if (description.bodies.size() < 2) {
    elements_[kGround].Fail("no body", "at least one that is not the ground");
  }
  MergeMassless();
  HoldFloatingParts();
  if (options_.planar) GoToPlane();
  const std::string fault = Validate(description);
  if (!fault.empty()) throw ConfigError(fmt::format("{}: {}", file_.name(), fault));
  std::ranges::stable_sort(notes_, {}, &ImportNote::line);
  imported.description = std::move(description);
  imported.notes = std::move(notes_);
  return imported;
}

}  // namespace loopbench::harness
