// Bodies that hardly move against each other: one body.
#include <algorithm>
#include <functional>
#include <numeric>

#include "mechanism/model/mechanism.h"
#include "mechanism/simplify/attach.h"
#include "mechanism/simplify/freedom.h"
#include "mechanism/simplify/model.h"
#include "mechanism/simplify/restart.h"

namespace loopbench {

namespace {

/// The mechanism's own length [m].
double LengthOf(const MechanismDescription& description) {
  return description.space == SpaceKind::kPlanar
             ? Mechanism<Planar, double>(description, Coordinates::kJoint).length()
             : Mechanism<Spatial, double>(description, Coordinates::kJoint).length();
}

/// Turn and shift as one number: rad, or lengths of the mechanism.
double SizeOf(const Travel& travel, double length) {
  return std::max(travel.turn, travel.shift / length);
}

std::string CandidateName(const JointDescription& joint) { return "joint \"" + joint.name + "\""; }

/// Sets of bodies at rest relative to each other: by body, the lowest body of its set.
class Sets {
 public:
  explicit Sets(std::size_t bodies) : lowest_(bodies) {
    std::iota(lowest_.begin(), lowest_.end(), 0);
  }
  int LowestWith(int body) const { return lowest_[body]; }
  void Unite(int a, int b) {
    const int from = std::max(lowest_[a], lowest_[b]), to = std::min(lowest_[a], lowest_[b]);
    std::ranges::replace(lowest_, from, to);
  }
  /// Returns true if all bodies belong to Ground's group.
  bool AllStandStill() const {
    return std::ranges::all_of(lowest_, [](int lowest) { return lowest == kGround; });
  }

 private:
  std::vector<int> lowest_;
};

std::vector<Attachment> Attachments(const MechanismDescription& description, const Sets& sets,
                                    const BodyStarts& starts) {
  const auto start_of = [&](int body) {
    return starts.at(body == kGround ? "" : description.bodies[body].name);
  };
  std::vector<Attachment> attachments(description.bodies.size());
  for (int body = 1; body < static_cast<int>(attachments.size()); ++body) {
    const int carrier = sets.LowestWith(body);
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
    Sets sets(d_.bodies.size());
    bool any = false;
    for (const JointDescription& joint : d_.joints) {
      if (!IsTaken(joint)) continue;
      any = true;
      sets.Unite(joint.from.body, joint.to.body);
    }
    if (!any) return "no joint is at rest";
    if (sets.AllStandStill()) return "nothing would move";
    attachments_ = Attachments(d_, sets, starts_);
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
  const double length = LengthOf(description);
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
    const int carrier = attachments[b].carrier;
    result.done.push_back("body \"" + description.bodies[b].name + "\" is fixed to \"" +
                          (carrier == kGround ? "ground" : description.bodies[carrier].name) +
                          "\" in its initial pose");
  }
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    if (freezing.renumbering().joints[j] >= 0) continue;
    result.dropped.push_back("joint \"" + description.joints[j].name +
                             "\" with the forces along it");
  }
  return result;
}

}  // namespace loopbench
