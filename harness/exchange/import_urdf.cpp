// URDF (wiki.ros.org/urdf/XML): a tree of links, each in the frame of the joint that leads to it.
#include <fmt/format.h>

#include "harness/exchange/import_draft.h"

namespace loopbench::harness {

namespace {

constexpr double kGravity = 9.81;  // [m/s^2]: default, since URDF specifies none

constexpr DroppedReason kUrdfReasons[] = {
    {"visual", "shapes do not move anything"},
    {"collision", "there is no contact"},
    {"mujoco", "it is for another program"},
    {"limit", "joints turn and slide without ends", true},
    {"mimic", "no joint follows another: this is a freedom more than in the file", true},
    {"safety_controller", "there is no controller"},
    {"calibration", "it says where a sensor's zero is"},
    {"transmission", "there are no actuators"},
    {"gazebo", "it is for another program; loops in it belong in a sidecar (--loops)", true},
    {"sensor", "there are no sensors"},
    {"dynamics@friction", "dry friction is no force of mechanism files", true},
    // without influence on the motion
    {"material robot@version link@type", ""}};

Placement OriginOf(const XmlElement& element, ImportDraft* draft) {
  Placement X;
  const auto origin = element.Child("origin");
  if (!origin) return X;
  if (const auto xyz = origin->Attribute("xyz")) X.p = xyz->Vector();
  if (const auto rpy = origin->Attribute("rpy")) X.q = FromRollPitchYaw(draft->Vector(*rpy, "aaa"));
  return X;
}

void ReadInertial(const XmlElement& link, int body, ImportDraft* draft) {
  const auto inertial = link.Child("inertial");
  if (!inertial) return;
  const Placement X = OriginOf(*inertial, draft);
  const XmlElement mass = inertial->RequiredChild("mass");
  const XmlElement inertia = inertial->RequiredChild("inertia");
  const double kg = mass.Required("value", "a number [kg]").Number(kNotNegative);
  const auto moment = [&](const char* name) {
    return inertia.Required(name, "a number [kg m^2]").Number();
  };
  const auto product = [&](const char* name) {
    const auto value = inertia.Attribute(name);
    return value ? value->Number() : 0.0;
  };
  const Eigen::Matrix3d I = SymmetricMatrix(moment("ixx"), moment("iyy"), moment("izz"),
                                            product("ixy"), product("ixz"), product("iyz"));
  BodyDescription& described = draft->description.bodies[static_cast<std::size_t>(body)];
  described.mass = kg;
  described.com = X.p;
  described.inertia = InTurnedAxes(X.q, I);
}

/// A joint as given in the file, before poses are known.
struct UrdfJoint {
  XmlElement element;
  std::string type;
  int parent = -1, child = -1;
  Placement X_PC;
};

const std::vector<std::string>& UrdfTypes() {
  static const std::vector<std::string> names = {"revolute", "continuous", "prismatic",
                                                 "fixed",    "floating",   "planar"};
  return names;
}

JointType TypeOfUrdf(const std::string& name) {
  if (name == "prismatic") return JointType::kPrismatic;
  if (name == "fixed") return JointType::kWeld;
  if (name == "floating") return JointType::kFree;
  return name == "planar" ? JointType::kPlanar : JointType::kRevolute;
}

void AddJoint(const UrdfJoint& read, ImportDraft* draft) {
  const XmlElement& element = read.element;
  const JointType type = TypeOfUrdf(read.type);
  const std::string name = draft->NewJointName(element, element.Required("name", "a name").Name());
  JointDescription& joint = draft->AddJoint(name, type, read.parent, read.X_PC, read.child, {});
  if (const auto axis = element.Child("axis")) {
    const Eigen::Vector3d xyz = draft->Vector(axis->Required("xyz", "3 numbers"), "d");
    if (TraitsOf(type).own_axis != '-') {
      if (xyz.isZero()) axis->Fail("an axis of length 0", "one that is not zero");
      joint.axis = xyz;
    }
  } else if (TraitsOf(type).own_axis != '-') {
    joint.axis = Eigen::Vector3d::UnitX();  // the default of URDF
  }
  const auto dynamics = element.Child("dynamics");
  const auto damping = dynamics ? dynamics->Attribute("damping") : std::nullopt;
  const double c = damping ? damping->Number(kNotNegative) : 0.0;
  if (c > 0.0 && NumValues(type, SpaceKind::kSpatial, true) == 1) {
    draft->description.forces.emplace_back(JointDamper{draft->last_joint(), c});
  } else if (c > 0.0) {
    draft->Note(*dynamics, "damping", "dropped: only joints with one coordinate have dampers",
                true);
  }
  const auto friction = dynamics ? dynamics->Attribute("friction") : std::nullopt;
  if (friction && friction->Number() != 0.0) {
    draft->Note(*dynamics, "friction", "dropped: dry friction is no force of mechanism files",
                true);
  }
}

std::vector<UrdfJoint> ReadJoints(const XmlElement& root, bool has_world, ImportDraft* draft) {
  std::vector<UrdfJoint> joints;
  const std::set<std::string> ground =
      has_world ? std::set<std::string>{"world"} : std::set<std::string>{};
  const auto link = [&](const XmlElement& element, const char* side) {
    return draft->BodyNamed(element.RequiredChild(side).Required("link", "the name of a link"),
                            ground);
  };
  for (const XmlElement& element : root.Children("joint")) {
    UrdfJoint joint{element, "", link(element, "parent"), link(element, "child"),
                    OriginOf(element, draft)};
    const XmlValue type = element.Required("type", "a joint type");
    joint.type = UrdfTypes()[type.Choice(UrdfTypes())];
    if (joint.child == kGround) element.Fail("\"world\" as a child", "a link that can move");
    joints.push_back(joint);
  }
  return joints;
}

/// Joints ordered from parents to children, and links without a parent.
class UrdfTree {
 public:
  UrdfTree(std::vector<UrdfJoint> joints, std::size_t count)
      : joints_(std::move(joints)), parent_(count, -1), below_(count) {
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      const UrdfJoint& joint = joints_[j];
      int& known = parent_[static_cast<std::size_t>(joint.child)];
      if (known >= 0) {
        joint.element.Fail(
            fmt::format("a second joint that leads to this child (the first is in line {})",
                        joints_[static_cast<std::size_t>(known)].element.line()),
            "a tree: joints that close loops stand in a sidecar (--loops)");
      }
      known = static_cast<int>(j);
      below_[static_cast<std::size_t>(joint.parent)].push_back(static_cast<int>(j));
    }
  }

  std::vector<int> Roots() const {
    std::vector<int> roots;
    for (std::size_t i = 1; i < parent_.size(); ++i) {
      if (parent_[i] < 0) roots.push_back(static_cast<int>(i));
    }
    return roots;
  }
  std::vector<UrdfJoint> Below(int root) const {
    std::vector<UrdfJoint> ordered;
    std::vector<int> queue = {root};
    for (std::size_t k = 0; k < queue.size(); ++k) {
      for (const int j : below_[static_cast<std::size_t>(queue[k])]) {
        ordered.push_back(joints_[static_cast<std::size_t>(j)]);
        queue.push_back(ordered.back().child);
      }
    }
    return ordered;
  }
  const std::vector<UrdfJoint>& joints() const { return joints_; }

 private:
  std::vector<UrdfJoint> joints_;
  std::vector<int> parent_;
  std::vector<std::vector<int>> below_;
};

/// Sets the poses of all links; links that no root reaches form a cycle.
void PlaceLinks(const UrdfTree& tree, const std::vector<int>& roots, ImportDraft* draft) {
  std::vector<bool> placed(draft->at_rest.size(), false);
  for (const int root : roots) {
    placed[static_cast<std::size_t>(root)] = true;
    for (const UrdfJoint& joint : tree.Below(root)) {
      const auto child = static_cast<std::size_t>(joint.child);
      placed[child] = true;
      draft->at_rest[child] = draft->at_rest[static_cast<std::size_t>(joint.parent)] * joint.X_PC;
    }
  }
  for (const UrdfJoint& joint : tree.joints()) {
    if (!placed[static_cast<std::size_t>(joint.child)]) {
      joint.element.Fail("a joint of a cycle, which no root leads to",
                         "a tree: joints that close loops stand in a sidecar (--loops)");
    }
  }
}

void HoldRoots(const std::vector<int>& roots, const ImportOptions& options, ImportDraft* draft) {
  for (const int root : roots) {
    if (root == kGround || options.floats) continue;
    const std::string& link = draft->description.bodies[static_cast<std::size_t>(root)].name;
    draft->AddJoint(draft->NameLater(link + " to ground"), JointType::kWeld, kGround, {}, root, {});
  }
}

}  // namespace

void ReadUrdf(const XmlElement& root, const ImportOptions& options, ImportDraft* draft) {
  if (const auto name = root.Attribute("name")) draft->description.name = name->Name();
  bool has_world = false;
  std::vector<XmlElement> of_body = {root};
  for (const XmlElement& link : root.Children("link")) {
    const XmlValue name = link.Required("name", "a name");
    // "world" is by convention the fixed link
    if (name.Name() == "world" && !link.Child("inertial")) {
      if (has_world) name.Fail("a name that is not in use");
      has_world = true;
      continue;
    }
    of_body.push_back(link);
    ReadInertial(link, draft->AddBody(link, name.Name()), draft);
  }
  const UrdfTree tree(ReadJoints(root, has_world, draft), draft->at_rest.size());
  std::vector<int> roots = tree.Roots();
  if (has_world) roots.insert(roots.begin(), kGround);
  PlaceLinks(tree, roots, draft);
  if (roots.size() != 1) {
    const std::string found = fmt::format("{} links without a parent", roots.size());
    root.Fail(roots.empty() ? "no link without a parent" : found, "one, the root of the tree");
  }
  for (const UrdfJoint& joint : tree.joints()) AddJoint(joint, draft);
  HoldRoots(roots, options, draft);
  draft->AssumeGravity(root, kGravity);
  if (!options.floats && roots[0] != kGround) {
    draft->Note(of_body[static_cast<std::size_t>(roots[0])],
                "the root link is taken as fixed to the ground (--floating leaves it free)");
  }
  draft->NoteUnread(kUrdfReasons);
}

}  // namespace loopbench::harness
