// URDF (wiki.ros.org/urdf/XML): a tree of links, each in the frame of the joint that leads to it.
#include "harness/exchange/import_draft.h"

namespace loopbench::harness {

namespace {

constexpr double kGravity = 9.81;  // [m/s^2]: default, since URDF specifies none

constexpr const char* kOtherProgram = "it is for another program";
constexpr const char* kNoActuators = "there are no actuators";

constexpr DroppedReason kUrdfReasons[] = {
    {"collision", "there is no contact"},
    {"mujoco", kOtherProgram},
    {"limit", kNoEnds, true},
    {"safety_controller", "there is no controller"},
    {"calibration", "it says where a sensor's zero is"},
    {"ros2_control", kNoActuators},
    {"gazebo", "it is for another program, and no child of <robot>", true},
    {"sensor", "there are no sensors"},
    {"dynamics@friction", kDryFriction, true},
    // without influence on the motion
    {"visual material robot@version link@type", ""}};

/// Contents of <gazebo> without influence on the motion.
constexpr DroppedReason kIdleGazebo = {
    "sensor visual collision material preserveFixedJoint disableFixedJointLumping "
    "provideFeedback selfCollide mu1 mu2 fdir1 kp kd maxVel minDepth maxContacts laserRetro",
    kOtherProgram};

/// Returns the pose in the attributes of an element.
Placement PoseIn(const XmlElement& element, ImportDraft* draft) {
  Placement X;
  if (const auto xyz = element.Attribute("xyz")) X.p = xyz->Vector();
  if (const auto rpy = element.Attribute("rpy")) X.q = FromRollPitchYaw(draft->Vector(*rpy, "aaa"));
  return X;
}

Placement OriginOf(const XmlElement& element, ImportDraft* draft) {
  const auto origin = element.Child("origin");
  return origin ? PoseIn(*origin, draft) : Placement();
}

void ReadInertial(const XmlElement& link, int body, ImportDraft* draft) {
  const auto inertial = link.Child("inertial");
  if (!inertial) return;
  const Placement X = OriginOf(*inertial, draft);
  const XmlElement mass = inertial->RequiredChild("mass");
  const double kg = mass.Required("value", "a number [kg]").Number(kNotNegative);
  const auto inertia = inertial->Child("inertia");
  if (!inertia) {  // an error if the link moves
    return draft->ReadMassLater(body, [=] { inertial->RequiredChild("inertia"); });
  }
  const Eigen::Matrix3d I = InertiaOf([&](const char* name, bool is_moment) {
    return is_moment ? inertia->Required(name, "a number [kg m^2]").Number()
                     : inertia->Number(name, 0.0);
  });
  draft->SetMass(body, kg, X.p, InTurnedAxes(X.q, I));
}

/// A joint as given in the file, before poses are known.
struct UrdfJoint {
  XmlElement element;
  int parent = -1, child = -1;
  Placement X_PC;
  JointType type = JointType::kRevolute;
};

int LinkNamed(const XmlElement& element, const char* attribute, const ImportDraft& draft) {
  const XmlValue name = element.Required(attribute, "the name of a link");
  return draft.BodyNamed(name.Name(), name);
}

std::vector<UrdfJoint> ReadJoints(const XmlElement& root, ImportDraft* draft) {
  using enum JointType;
  constexpr XmlChoice<JointType> kTypes[] = {{"revolute", kRevolute},   {"continuous", kRevolute},
                                             {"prismatic", kPrismatic}, {"fixed", kWeld},
                                             {"floating", kFree},       {"planar", kPlanar}};
  std::vector<UrdfJoint> joints;
  const auto link = [&](const XmlElement& element, const char* side) {
    return LinkNamed(element.RequiredChild(side), "link", *draft);
  };
  for (const XmlElement& element : root.Children({"joint"})) {
    UrdfJoint joint{element, link(element, "parent"), link(element, "child"),
                    OriginOf(element, draft)};
    joint.type = element.Required("type", "a joint type").Choice(kTypes);
    if (joint.child == kGround) element.Fail("\"world\" as a child", "a link that can move");
    joints.push_back(joint);
  }
  return joints;
}

/// Sets the poses of all links and returns the root of the tree. Rejects joints that are no tree.
int PlaceLinks(const std::vector<UrdfJoint>& joints, const XmlElement& root, bool has_world,
               ImportDraft* draft) {
  constexpr const char* kTree =
      "a tree: joints that close loops are a <loop_joint>, or stand in a sidecar (--loops)";
  const int count = static_cast<int>(draft->at_rest.size());
  std::vector<const UrdfJoint*> leading(count, nullptr);  // the joint to each link
  std::vector<std::vector<const UrdfJoint*>> below(count);
  for (const UrdfJoint& joint : joints) {
    const UrdfJoint*& known = leading[joint.child];
    if (known != nullptr) {
      joint.element.Fail(
          fmt::format("a second joint that leads to this child (the first is in line {})",
                      known->element.line()),
          kTree);
    }
    known = &joint;
    below[joint.parent].push_back(&joint);
  }
  std::vector<int> roots, queue;
  for (int i = has_world ? kGround : 1; i < count; ++i) {
    if (leading[i] == nullptr) roots.push_back(i);
  }
  std::vector<bool> placed(count, false);
  queue = roots;
  for (std::size_t k = 0; k < queue.size(); ++k) {
    placed[queue[k]] = true;
    for (const UrdfJoint* joint : below[queue[k]]) {
      draft->at_rest[joint->child] = draft->at_rest[joint->parent] * joint->X_PC;
      queue.push_back(joint->child);
    }
  }
  for (const UrdfJoint& joint : joints) {
    if (placed[joint.child]) continue;
    joint.element.Fail("a joint of a cycle, which no root leads to", kTree);
  }
  if (roots.size() != 1) {
    const std::string found = fmt::format("{} links without a parent", roots.size());
    root.Fail(roots.empty() ? "no link without a parent" : found, "one, the root of the tree");
  }
  return roots[0];
}

void ReadAxis(const XmlElement& element, JointDescription* joint, ImportDraft* draft) {
  const bool has_axis = TraitsOf(joint->type).own_axis != '-';
  if (has_axis) joint->axis = Eigen::Vector3d::UnitX();  // the default of URDF
  if (const auto axis = element.Child("axis")) {
    const Eigen::Vector3d xyz = draft->Vector(axis->Required("xyz", "3 numbers"), "d");
    if (has_axis && xyz.isZero()) axis->Fail("an axis of length 0", "one that is not zero");
    if (has_axis) joint->axis = xyz;
  }
}

void AddJoint(const UrdfJoint& read, ImportDraft* draft) {
  const XmlElement& element = read.element;
  const std::string name = draft->NewJointName(element, element.RequiredName());
  JointDescription& joint =
      draft->AddJoint(name, read.type, {read.parent, read.X_PC}, {read.child, {}});
  ReadAxis(element, &joint, draft);
  if (const auto type = element.Attribute("type")->text();
      type != "revolute" && type != "prismatic") {
    const auto limit = element.Child("limit");
    if (limit) draft->DropWhole(*limit, "joints of this type have no limits");
  }
  const auto dynamics = element.Child("dynamics");
  if (!dynamics) return;
  if (read.type == JointType::kWeld) {
    return draft->DropWhole(*dynamics, "a fixed joint does not move");
  }
  const double c = dynamics->Number("damping", 0.0, kNotNegative);
  if (NumValues(read.type, SpaceKind::kSpatial, true) == 1) {
    draft->AddSpringAndDamper(0.0, 0.0, c);
  } else if (c > 0.0) {
    draft->Drop(*dynamics, "damping", "only joints with one coordinate have dampers");
  }
  if (dynamics->Number("friction", 0.0) != 0.0) {
    draft->Drop(*dynamics, "friction", kDryFriction);
  }
}

/// <mimic>: q = multiplier q_leader + offset.
void AddMimic(const UrdfJoint& read, int follower, ImportDraft* draft) {
  const auto mimic = read.element.Child("mimic");
  if (!mimic) return;
  if (read.type == JointType::kWeld) {
    return draft->DropWhole(*mimic, "a fixed joint does not move");
  }
  const int leader = draft->JointNamed(mimic->Required("joint", "the name of a joint"));
  const double multiplier = mimic->Number("multiplier", 1.0);
  const double offset = mimic->Number("offset", 0.0);
  draft->AddMimic(*mimic, follower, {leader, multiplier}, offset);
}

/// Reads a <transmission>: Drake's rotor inertia at the joint is gear_ratio^2 times the given one.
void ReadTransmission(const XmlElement& element, ImportDraft* draft) {
  // other types are no part of Drake's models
  const auto type = element.Content("type");
  const bool is_simple = !type || type->text().find("SimpleTransmission") != std::string::npos;
  double inertia = 0.0;
  for (const XmlElement& actuator : element.Children({"actuator"})) {
    const auto value = [&](const char* tag, double otherwise, const Range& range) {
      const auto child = actuator.Child(tag);
      return child ? child->Required("value", "a number").Number(range) : otherwise;
    };
    const double ratio = value("drake:gear_ratio", 1.0, {});
    inertia += ratio * ratio * value("drake:rotor_inertia", 0.0, kNotNegative);
  }
  if (!is_simple) inertia = 0.0;
  draft->DropWhole(element, inertia > 0.0 ? "only its rotor_inertia matters" : kNoActuators);
  if (inertia == 0.0) return;
  const XmlValue name = element.RequiredChild("joint").Required("name", "the name of a joint");
  JointDescription& joint = draft->description.joints[draft->JointNamed(name)];
  if (NumValues(joint.type, SpaceKind::kSpatial, false) == 1) {
    joint.rotor_inertia += inertia;
  } else if (joint.type != JointType::kWeld) {
    draft->Drop(element, "drake:rotor_inertia", kNoRotors);
  }
}

}  // namespace

void PlaceFollowers(ImportDraft* draft) {
  MechanismDescription& d = draft->description;
  std::vector<double> start(d.joints.size(), 0.0);
  for (const JointValues& given : d.initial.coordinates) {
    if (given.values.size() == 1) start[given.joint] = given.values[0];
  }
  for (std::size_t j = 0; j < start.size(); ++j) {  // followers of a factor zero
    for (const PrescribedMotion& motion : d.joints[j].motions) {
      start[j] = std::get<Polynomial>(motion.value).coefficients[0];
    }
  }
  for (std::size_t pass = 0; pass < d.couplings.size(); ++pass) {  // followers of followers
    for (const CouplingDescription& mimic : d.couplings) {
      const CouplingDescription::Part &follower = mimic.parts[0], &leader = mimic.parts[1];
      start[follower.joint] = (mimic.offset - leader.ratio * start[leader.joint]) / follower.ratio;
    }
  }
  for (const CouplingDescription& mimic : d.couplings) {
    const int j = mimic.parts[0].joint;
    const auto given = std::ranges::find(d.initial.coordinates, j, &JointValues::joint);
    if (given == d.initial.coordinates.end()) {
      if (start[j] != 0.0) d.initial.coordinates.push_back({j, {start[j]}});
    } else if (given->values[0] != start[j]) {
      draft->Note(draft->element(d.joints[j].to.body),
                  fmt::format("joint \"{}\" starts at {:.6g}, where it follows another joint",
                              d.joints[j].name, start[j]),
                  true);
      given->values[0] = start[j];
    }
  }
}

namespace {

// Loops, which URDF itself excludes: extensions of other programs.

/// Reads a <loop_joint>. Drake's RigidBodyTree (parseLoop): frames on `link1` and `link2` with one
/// origin and one axis, in axes of both frames; type continuous. Isaac Sim: type spherical, and
/// both sides may be called `link1`.
void AddLoop(const XmlElement& element, ImportDraft* draft) {
  using enum JointType;
  constexpr XmlChoice<JointType> kTypes[] = {{"continuous", kRevolute},
                                             {"revolute", kRevolute},
                                             {"spherical", kSpherical},
                                             {"prismatic", kPrismatic},
                                             {"fixed", kWeld}};
  const JointType type = element.Required("type", "a joint type").Choice(kTypes);
  const std::vector<XmlElement> sides = element.Children({"link1", "link2"});
  if (sides.size() != 2) {
    element.Fail(fmt::format("{} of <link1> and <link2>", sides.size()), "two, its sides");
  }
  const std::string name = draft->NewJointName(element, element.RequiredName());
  const int first = LinkNamed(sides[0], "link", *draft);
  const int second = LinkNamed(sides[1], "link", *draft);
  JointDescription& joint = draft->AddLoop(element, name, type, {first, PoseIn(sides[0], draft)},
                                           {second, PoseIn(sides[1], draft)});
  ReadAxis(element, &joint, draft);
}

/// Reads joints of SDF; other contents of <gazebo> are dropped.
void ReadGazebo(const XmlElement& root, ImportDraft* draft) {
  std::vector<XmlElement> joints;
  for (const XmlElement& gazebo : root.Children({"gazebo"})) {
    const bool is_model = !gazebo.Attribute("reference") && !gazebo.Children({"joint"}).empty();
    bool changes_motion = false;
    for (const XmlElement& child : gazebo.Children()) {
      const bool acts = !kIdleGazebo.Has(child.tag()), is_joint = child.tag() == "joint";
      changes_motion = changes_motion || acts;
      if (is_model && is_joint) joints.push_back(child);
      if (is_model && !is_joint) draft->DropWhole(child, kOtherProgram, acts);
    }
    if (!is_model) draft->DropWhole(gazebo, kOtherProgram, changes_motion);
  }
  ReadGazeboJoints(root, joints, draft);
}

}  // namespace

void ReadUrdf(const XmlElement& root, const ImportOptions& options, ImportDraft* draft) {
  if (const auto name = root.Attribute("name")) draft->description.name = name->Name();
  bool has_world = false;
  for (const XmlElement& link : root.Children({"link"})) {
    const XmlValue name = link.Required("name", "a name");
    // "world" is by convention the fixed link
    if (name.Name() == "world" && !link.Child("inertial")) {
      if (has_world) name.Fail("a name that is not in use");
      has_world = true;
      continue;
    }
    ReadInertial(link, draft->AddBody(link, name.Name()), draft);
  }
  if (has_world) draft->NameGround("world");
  const std::vector<UrdfJoint> joints = ReadJoints(root, draft);
  const int base = draft->base = PlaceLinks(joints, root, has_world, draft);
  const int first = draft->last_joint() + 1;
  for (const UrdfJoint& joint : joints) AddJoint(joint, draft);
  for (int i = 0; i < std::ssize(joints); ++i) AddMimic(joints[i], first + i, draft);
  PlaceFollowers(draft);
  for (const XmlElement& one : root.Children({"transmission"})) ReadTransmission(one, draft);
  for (const XmlElement& loop : root.Children({"loop_joint"})) AddLoop(loop, draft);
  for (const XmlElement& ball : root.Children({kDrakeBall})) {
    draft->AddBall(
        ball, [&](const XmlElement& side) { return LinkNamed(side, "name", *draft); },
        [](const XmlElement& point) { return point.Required("value", "3 numbers [m]"); });
  }
  ReadGazebo(root, draft);
  draft->AssumeGravity(root, kGravity);
  const bool is_joined =
      std::ranges::any_of(draft->description.joints, [&](const JointDescription& joint) {
        return std::min(joint.from.body, joint.to.body) == kGround &&
               std::max(joint.from.body, joint.to.body) == base;
      });
  if (base != kGround && !options.floats && !is_joined) {
    draft->Fix(kGround, {}, base, " to ground");
    draft->Note(draft->element(base),
                "the root link is taken as fixed to the ground (--floating leaves it free)");
  }
  draft->NoteUnread(kUrdfReasons);
}

}  // namespace loopbench::harness
