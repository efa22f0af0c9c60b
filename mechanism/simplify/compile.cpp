#include "mechanism/simplify/compile.h"

#include <algorithm>
#include <stdexcept>

#include "mechanism/description/topology.h"
#include "mechanism/simplify/attach.h"
#include "mechanism/simplify/plane.h"
#include "mechanism/simplify/redundancy.h"

namespace loopbench {

namespace {

/// Returns true if loops are cut at the same joints. Another joint that closes a loop may carry a
/// guess, which Assemble() rejects.
bool KeepsCuts(const MechanismDescription& before, const MechanismDescription& after,
               const Renumbering& renumbering) {
  std::vector<bool> was_cut(after.joints.size(), false);
  for (const int joint : BuildTopology(before, Coordinates::kJoint).constraints) {
    if (renumbering.joints[joint] >= 0) was_cut[renumbering.joints[joint]] = true;
  }
  return std::ranges::all_of(BuildTopology(after, Coordinates::kJoint).constraints,
                             [&](int joint) { return was_cut[joint]; });
}

/// Returns true if a joint of a coupling is gone.
bool LosesCoupledJoint(const MechanismDescription& before, const Renumbering& renumbering) {
  return std::ranges::any_of(before.couplings, [&](const CouplingDescription& coupling) {
    return std::ranges::any_of(coupling.parts, [&](const CouplingDescription::Part& part) {
      return renumbering.joints[part.joint] < 0;
    });
  });
}

class Compiler {
 public:
  Compiler(const MechanismDescription& description, const CompileOptions& options)
      : options_(options) {
    result_.parts.push_back({.description = description});
    result_.done = CompileOptions::None();
    for (std::size_t i = 0; i < description.bodies.size(); ++i) {
      result_.bodies.push_back(
          {.part = i == kGround ? -1 : 0, .body = static_cast<int>(i), .X = {}});
    }
    for (std::size_t j = 0; j < description.joints.size(); ++j) {
      result_.joints.push_back({.part = 0, .joint = static_cast<int>(j)});
    }
  }

  Compiled Run() {
    if (options_.welds) result_.done.welds = AttachAll(FindWelded(whole()), "welded");
    if (options_.immovable) {
      result_.done.immovable = AttachAll(FindImmovable(whole()), "cannot move, fixed");
    }
    if (options_.islands) SplitIslands();
    if (options_.planar) {
      for (int part = 0; part < static_cast<int>(result_.parts.size()); ++part) Flatten(part);
    }
    if (options_.redundancy) {
      for (CompiledPart& part : result_.parts) ReleaseRedundant(part.description);
    }
    return std::move(result_);
  }

 private:
  MechanismDescription& whole() { return result_.parts.front().description; }

  /// Returns true if something was attached.
  bool AttachAll(const std::vector<Attachment>& attachments, const std::string& how) {
    const auto count = std::ranges::count_if(attachments, &Attachment::attached);
    if (count == 0) return false;
    if (count + 1 == static_cast<std::ptrdiff_t>(attachments.size())) {
      result_.report.push_back("nothing can move: all bodies are kept as they are");
      return false;
    }
    Renumbering renumbering;
    const MechanismDescription before = whole();
    MechanismDescription after = MergeRigidBodies(before, attachments, &renumbering);
    const bool keeps_cuts = KeepsCuts(before, after, renumbering);
    if (!keeps_cuts || LosesCoupledJoint(before, renumbering)) {
      result_.report.push_back("bodies that could be " + how + " to others are kept: " +
                               (keeps_cuts ? "they hold a joint of a coupling"
                                           : "a joint with an initial value would have to close a "
                                             "loop"));
      return false;
    }
    for (std::size_t i = 1; i < attachments.size(); ++i) {
      if (!attachments[i].attached) continue;
      result_.report.push_back("body \"" + before.bodies[i].name + "\": " + how + " to \"" +
                               before.bodies[attachments[i].carrier].name + "\"");
    }
    whole() = std::move(after);
    for (BodyImage& image : result_.bodies) {
      if (image.part < 0) continue;
      const Attachment& at = attachments[image.body];
      const int carrier = at.attached ? at.carrier : image.body;
      if (at.attached) {
        image.X = at.X * image.X;
        image.turn += at.turn;
      }
      image.body = renumbering.bodies[carrier];
      if (image.body == kGround) image.part = -1;
    }
    for (JointImage& image : result_.joints) {
      if (image.joint >= 0) image.joint = renumbering.joints[image.joint];
      if (image.joint < 0) image.part = -1;
    }
    return true;
  }

  void SplitIslands() {
    const MechanismDescription all = whole();
    const std::vector<Island> islands = FindIslands(all);
    if (islands.size() < 2) return;
    result_.done.islands = true;
    result_.parts.clear();
    std::vector<int> part_of(all.bodies.size(), -1), place(all.bodies.size(), -1);
    std::vector<int> joint_part(all.joints.size(), -1), joint_place(all.joints.size(), -1);
    for (Part& part : Split(all, islands)) {
      const int index = static_cast<int>(result_.parts.size());
      for (std::size_t b = 1; b < part.bodies.size(); ++b) {
        part_of[part.bodies[b]] = index;
        place[part.bodies[b]] = static_cast<int>(b);
      }
      for (std::size_t j = 0; j < part.joints.size(); ++j) {
        joint_part[part.joints[j]] = index;
        joint_place[part.joints[j]] = static_cast<int>(j);
      }
      result_.parts.push_back({.description = std::move(part.description)});
    }
    for (BodyImage& image : result_.bodies) {
      if (image.part < 0) continue;
      image.part = part_of[image.body];
      image.body = place[image.body];
    }
    for (JointImage& image : result_.joints) {
      if (image.part < 0) continue;
      image.part = joint_part[image.joint];
      image.joint = joint_place[image.joint];
    }
    result_.report.push_back(std::to_string(islands.size()) +
                             " parts without a connection: one system each");
  }

  void Flatten(int part) {
    CompiledPart& one = result_.parts[part];
    if (one.description.space == SpaceKind::kPlanar) return;
    const std::string& name = one.description.name;
    std::string why;
    const std::optional<InPlane> plane = ExpressInPlane(one.description, &why);
    if (!plane) {
      result_.report.push_back(name + " stays spatial: " + why);
      return;
    }
    result_.done.planar = true;
    const Eigen::Vector3d n = plane->R_WC.col(2);
    result_.report.push_back(name + " moves in planes normal to (" + NumberText(n.x(), 6) + ", " +
                             NumberText(n.y(), 6) + ", " + NumberText(n.z(), 6) + "): planar");
    if (plane->gravity_dropped != 0.0) {
      result_.report.push_back(name + ": gravity along the normal is borne by the joints: " +
                               NumberText(plane->gravity_dropped, 6) + " m/s^2 dropped");
    }
    for (const double force : plane->force_dropped) {
      if (force == 0.0) continue;
      result_.report.push_back(name + ": a force along the normal is borne by the joints: " +
                               NumberText(force, 6) + " N dropped");
    }
    for (BodyImage& image : result_.bodies) {
      if (image.part == part) image.X = plane->X_CB[image.body] * image.X;
    }
    for (JointImage& image : result_.joints) {
      if (image.part == part) image.mirrored = plane->mirrored[image.joint];
    }
    one.R_WC = plane->R_WC;
    one.description = plane->description;
  }

  void ReleaseRedundant(MechanismDescription& description) {
    const Redundancy redundancy = FindRedundancy(description);
    const std::string where =
        redundancy.rounding > 0.0
            ? "within " + NumberText(redundancy.rounding, 2) + " lengths, the accuracy of the input"
            : "at every position";
    std::size_t moving = 0;
    for (const Released& out : redundancy.released) {
      moving += out.moving.size();
      for (const int direction : out.directions) {
        if (out.IsMoving(direction)) continue;
        result_.report.push_back("joint \"" + description.joints[out.joint].name +
                                 "\": " + NameOfDirection(description, out, direction) +
                                 " is redundant " + where);
      }
    }
    if (moving > 0) {
      result_.report.push_back(std::to_string(moving) +
                               " of the imposed constraints may move between joints during a run");
    }
    if (redundancy.released.empty()) return;
    result_.done.redundancy = true;
    description = Release(description, redundancy);
  }

  CompileOptions options_;
  Compiled result_;
};

}  // namespace

Compiled Compile(const MechanismDescription& description, const CompileOptions& options) {
  if (const std::string error = Validate(description); !error.empty()) {
    throw std::invalid_argument(error);
  }
  return Compiler(description, options).Run();
}

template <class Space>
Frame UserPose(const Compiled& compiled, int body, const Kinematics<Space, double>* kinematics) {
  const BodyImage& image = compiled.bodies[body];
  if (image.part < 0) return image.X;
  const CompiledPart& part = compiled.parts[image.part];
  Eigen::Vector3d com = part.description.bodies[image.body].com;
  if (Space::kRot == 1) com.z() = 0.0;
  const Frame X = OriginOf(kinematics->poses()[image.body], com) * image.X;
  return {part.R_WC * X.R, part.R_WC * X.p};
}

template Frame UserPose(const Compiled&, int, const Kinematics<Planar, double>*);
template Frame UserPose(const Compiled&, int, const Kinematics<Spatial, double>*);

}  // namespace loopbench
