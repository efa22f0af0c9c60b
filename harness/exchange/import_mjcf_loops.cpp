// <equality> and <tendon>: constraints that close loops, and forces between two points.
#include "harness/exchange/import_mjcf.h"

namespace loopbench::harness {

namespace {

std::string NameOr(const XmlElement& element, const std::string& otherwise) {
  const auto name = element.Attribute("name");
  return name ? name->Name() : otherwise;
}

/// Adds a <connect> or <weld> of two sites, or of two bodies by a point or pose at rest.
void AddClosure(const XmlElement& equality, MjcfModel* model) {
  const bool is_weld = equality.tag() == "weld";
  const auto& rest = model->draft->at_rest;
  const auto site1 = equality.Attribute("site1"), site2 = equality.Attribute("site2");
  FrameOn first, second;
  if (site1) {
    if (!site2) equality.Fail("no \"site2\"", "a site of the other body");
    first = model->SiteNamed(*site1);
    second = model->SiteNamed(*site2);
  } else {
    const auto body2 = equality.Attribute("body2");
    first.body = model->BodyNamed(equality.Required("body1", "the name of a body"));
    if (body2) second.body = model->BodyNamed(*body2);
  }
  if (!site1 && is_weld) {
    first.X = rest[first.body].Inverse() * rest[second.body];
    if (const auto pose = equality.Attribute("relpose")) {
      // pose of the second body in the first; a zero quaternion selects the drawn poses
      const std::vector<double> p = model->draft->Numbers(*pose, "nnnq");
      const Eigen::Quaterniond q(p[3], p[4], p[5], p[6]);
      if (q.norm() > 0.0) first.X = {UnitQuaternion(*pose, q), {p[0], p[1], p[2]}};
    }
  } else if (!site1) {
    first.X.p = equality.Required("anchor", "3 numbers").Vector();
    second.X = rest[second.body].Inverse() * rest[first.body] * first.X;
  }
  if (is_weld) {
    // `anchor`: point of the weld; irrelevant, since a weld holds everywhere
    for (const char* name : {"anchor", "torquescale", "relpose"}) equality.Attribute(name);
  } else {
    first.X.q.setIdentity();
    second.X.q.setIdentity();
  }
  const std::string name = NameOr(equality, equality.tag()) + model->Suffix();
  model->draft->AddLoop(equality, model->draft->NameLater(name),
                        is_weld ? JointType::kWeld : JointType::kSpherical, first, second);
}

/// Returns the coefficients of `polycoef`; missing ones have their defaults.
std::vector<double> PolynomialOf(const XmlElement& equality) {
  std::vector<double> a = {0.0, 1.0, 0.0, 0.0, 0.0};
  if (const auto given = equality.Attribute("polycoef")) {
    std::ranges::copy(given->Numbers(1, 5), a.begin());
  }
  return a;
}

/// Couples two joints, or holds one at a constant. Returns false if it is dropped.
///
/// MuJoCo: q1 - q1_0 = a_0 + a_1 (q2 - q2_0) + ..., with q_0 the coordinates in the drawn position.
/// Loopbench's coordinates are 0 there.
bool AddJointEquality(const XmlElement& equality, MjcfModel* model) {
  const MjcfJoint& joint =
      model->joints[model->JointNamed(equality.Required("joint1", "the name of a joint"))];
  const std::vector<double> a = PolynomialOf(equality);
  const auto other = equality.Attribute("joint2");
  const MjcfJoint* leader = other ? &model->joints[model->JointNamed(*other)] : nullptr;
  if (joint.num_q() != 1 || (leader != nullptr && leader->num_q() != 1)) {
    model->draft->Note(equality, kNotCoupled, true);
    return false;
  }
  if (leader != nullptr && (a[2] != 0.0 || a[3] != 0.0 || a[4] != 0.0)) {
    model->draft->Note(equality, "polycoef",
                       "dropped: couplings are linear: this is a freedom more than in the file",
                       true);
    return false;
  }
  if (leader == nullptr) {
    model->draft->description.joints[joint.joint].motions = {{0, Polynomial{{a[0]}}}};
    return true;
  }
  model->draft->AddFollower(equality, NameOr(equality, "equality") + model->Suffix(), joint.joint,
                            {leader->joint, a[1]}, a[0]);
  return true;
}

void ReadEquality(const XmlElement& root, MjcfModel* model) {
  for (const XmlElement& element : root.InSections("equality")) {
    const auto active = model->defaults.Of(element, "", "equality", false).Attribute("active");
    if (!model->settings.has_equality || !BoolOr(active, true)) {
      model->draft->DropWhole(element, "it is not active");
      continue;
    }
    const XmlElement equality = model->defaults.Of(element, "", "equality");
    for (const char* name : {"solref", "solimp"}) equality.Attribute(name);
    const std::string tag = element.tag();
    bool is_exact = tag == "connect" || tag == "weld";
    MjcfModel::References references;
    if (tag == "joint") {
      for (const char* name : {"joint1", "joint2"}) {
        references.emplace_back("joint", element.Attribute(name));
      }
    } else if (is_exact) {
      for (const char* name : {"body1", "body2", "site1", "site2"}) {
        references.emplace_back(std::string(name, 4), element.Attribute(name));
      }
    }
    model->ForReplicas(references, [&] {
      if (tag == "connect" || tag == "weld") AddClosure(equality, model);
      if (tag == "joint") is_exact = AddJointEquality(equality, model);
    });
    if (is_exact) {
      model->draft->Note(element, "imposed exactly here; MuJoCo lets it give way");
    } else if (tag != "joint" && tag != "tendon") {
      model->draft->DropWhole(element, "there is no constraint of this kind", true);
    }
  }
}

/// Returns tendons whose length an active <equality><tendon> keeps constant.
std::map<std::string, XmlElement> HeldTendons(const XmlElement& root, const MjcfModel& model) {
  std::map<std::string, XmlElement> held;
  for (const XmlElement& element : root.InSections("equality", {"tendon"})) {
    const XmlElement equality = model.defaults.Of(element, "", "equality", false);
    const auto active = equality.Attribute("active");
    const auto first = equality.Attribute("tendon1");
    if (!first || equality.Attribute("tendon2") || !BoolOr(active, true)) continue;
    held.emplace(first->Name(), element);
  }
  return held;
}

/// Returns the two sites of a straight tendon, or nothing.
std::optional<std::pair<BodyPoint, BodyPoint>> StraightEnds(const XmlElement& element,
                                                            const MjcfModel& model) {
  const std::vector<XmlElement> sites = element.Children({"site"});
  const bool wraps = !element.Children({"geom"}).empty() || !element.Children({"pulley"}).empty();
  if (sites.size() != 2 || wraps) return std::nullopt;
  const auto end = [&](const XmlElement& site) {
    const FrameOn& at = model.SiteNamed(site.Required("site", "the name of a site"));
    return BodyPoint{at.body, at.X.p};
  };
  return std::pair{end(sites[0]), end(sites[1])};
}

void AddSpring(const XmlElement& tendon, const std::pair<BodyPoint, BodyPoint>& ends,
               double free_length, MjcfModel* model) {
  SpringDamper spring;
  std::tie(spring.from, spring.to) = ends;
  spring.stiffness = tendon.Number("stiffness", 0.0, kNotNegative);
  spring.damping = tendon.Number("damping", 0.0, kNotNegative);
  spring.length = free_length;
  if (const auto given = tendon.Attribute("springlength")) {
    const std::vector<double> rest = given->Numbers(1, 2);
    if (rest.size() == 2 && rest[0] != rest[1]) {
      given->Fail("one length: a spring with a range where it is free is no force here");
    }
    if (rest[0] >= 0.0) spring.length = rest[0];
  }
  if (!model->settings.has_springs) spring.stiffness = 0.0;
  if (!model->settings.has_dampers) spring.damping = 0.0;
  if (spring.stiffness > 0.0 || spring.damping > 0.0) {
    model->draft->description.forces.emplace_back(spring);
  }
}

double LengthOf(const std::pair<BodyPoint, BodyPoint>& ends, const std::vector<Placement>& poses) {
  const auto place = [&](const BodyPoint& point) { return poses[point.body].At(point.at); };
  return (place(ends.first) - place(ends.second)).norm();
}

/// Adds a fixed tendon of constant length: a coupling of the joints' coordinates, which are 0 in
/// the drawn position.
void AddFixedTendon(const XmlElement& element, const XmlElement& held, MjcfModel* model) {
  std::vector<CouplingDescription::Part> parts;
  for (const XmlElement& child : element.Children({"joint"})) {
    const MjcfJoint& joint =
        model->joints[model->JointNamed(child.Required("joint", "the name of a joint"))];
    if (joint.num_q() != 1) return model->draft->Note(element, kNotCoupled, true);
    const auto part = std::ranges::find(parts, joint.joint, &CouplingDescription::Part::joint);
    if (part != parts.end()) child.Fail("a joint twice", "each joint once");
    parts.push_back({joint.joint, child.Required("coef", "a number").Number()});
  }
  const XmlElement equality = model->defaults.Of(held, "", "equality");
  equality.Attribute("name");  // the coupling has the name of the tendon
  model->draft->AddCoupling(element, element.Attribute("name")->Name() + model->Suffix(),
                            std::move(parts), PolynomialOf(equality)[0]);
  const XmlElement tendon = model->defaults.Of(element, "", "tendon");
  model->NoteLimits(tendon, "tendons do not end");
  for (const char* key : {"stiffness", "damping", "frictionloss", "armature"}) {
    model->DropNonzero(tendon, key, "the length of the tendon is constant");
  }
}

void ReadTendon(const XmlElement& element, const std::map<std::string, XmlElement>& held,
                MjcfModel* model) {
  const auto name = element.Attribute("name");
  const bool is_held = name && held.contains(name->text()) && model->settings.has_equality;
  if (element.tag() == "fixed" && is_held) {
    return AddFixedTendon(element, held.at(name->text()), model);
  }
  const auto ends = element.tag() == "spatial" ? StraightEnds(element, *model) : std::nullopt;
  if (!ends || ends->first.body == ends->second.body) {
    return model->draft->DropWhole(
        element,
        is_held ? "only straight spatial and fixed tendons are constraints here: this is a freedom "
                  "more than in the file"
                : "only spatial tendons straight between two sites of two bodies are springs here",
        true);
  }
  const XmlElement tendon = model->defaults.Of(element, "", "tendon");
  AddSpring(tendon, *ends, LengthOf(*ends, model->where_springs_are_free), model);
  model->NoteLimits(tendon, "tendons do not end");
  model->DropNonzero(tendon, "frictionloss", "there is no dry friction");
  model->DropNonzero(tendon, "armature", "tendons have no inertia");
  if (!is_held) return;
  const XmlElement equality = model->defaults.Of(held.at(name->text()), "", "equality");
  equality.Attribute("name");  // the rod has the name of the tendon
  const double length = LengthOf(*ends, model->draft->at_rest) + PolynomialOf(equality)[0];
  if (!(length > 0.0)) element.Fail("a length that is not > 0", "one that is");
  ImportDraft* draft = model->draft;
  const auto& [a, b] = *ends;
  const std::string rod = draft->NameLater(name->Name() + model->Suffix());
  draft->AddJoint(rod, JointType::kRod, {a.body, Placement(a.at)}, {b.body, Placement(b.at)})
      .parameter = length;
  draft->Note(equality, "a rod here, exactly of its length");
}

// <keyframe>: conversion of coordinates and speeds from MuJoCo's joints.

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Sets coordinates, and speeds if given, of the Loopbench joints from MuJoCo's.
void SetMjcfStart(MjcfModel* model, const XmlElement& key, const std::vector<double>& qpos,
                  const std::vector<double>& qvel) {
  const auto positions = key.Attribute("qpos");
  const bool has_speeds = key.Attribute("qvel").has_value();
  InitialDescription& initial = model->draft->description.initial;
  initial.coordinates.clear();
  const double *q = qpos.data(), *u = qvel.data();
  for (const MjcfJoint& joint : model->joints) {
    const JointDescription& ours = model->draft->description.joints[joint.joint];
    std::vector<double> coordinates, speeds;
    if (positions && joint.num_q() > 1) {
      const double* turn = q + (joint.type == JointType::kFree ? 3 : 0);
      UnitQuaternion(*positions, {turn[0], turn[1], turn[2], turn[3]});  // rejects zero
    }
    if (joint.type == JointType::kFree) {
      // position in ground axes, angular velocity in body axes
      coordinates = {q[3], q[4], q[5], q[6], q[0], q[1], q[2]};
      const Vector3d w =
          Quaterniond(q[3], q[4], q[5], q[6]).normalized() * Vector3d(u[3], u[4], u[5]);
      speeds = {w.x(), w.y(), w.z(), u[0], u[1], u[2]};
    } else if (joint.num_q() == 1) {
      coordinates = {q[0] - joint.reference};
      speeds = {u[0]};
    } else {
      SetComposed({joint}, *Compose({joint}), q, u, &coordinates, &speeds);
    }
    if (!ours.motions.empty()) {
      // a start that contradicts an <equality>
      const double held = std::get<Polynomial>(ours.motions[0].value).coefficients[0];
      const std::string reason =
          fmt::format("of joint \"{}\" dropped: an <equality> holds it at {:.6g}", ours.name, held);
      if (positions && coordinates[0] != held) model->draft->Note(key, "qpos", reason, true);
      if (speeds[0] != 0.0) model->draft->Note(key, "qvel", reason, true);
    } else {
      initial.coordinates.push_back({joint.joint, coordinates});
      if (has_speeds) initial.speeds.push_back({joint.joint, speeds});
    }
    q += joint.num_q();
    u += joint.num_u();
  }
}

}  // namespace

void ReadMjcfLoops(const XmlElement& root, MjcfModel* model) {
  const std::map<std::string, XmlElement> held = HeldTendons(root, *model);
  ReadEquality(root, model);
  for (const XmlElement& element : root.InSections("tendon")) {
    MjcfModel::References parts;
    for (const char* kind : {"site", "joint"}) {
      for (const XmlElement& part : element.Children({kind})) {
        parts.emplace_back(kind, part.Attribute(kind));
      }
    }
    model->ForReplicas(parts, [&] { ReadTendon(element, held, model); });
  }
}

void ReadMjcfKeys(const XmlElement& root, MjcfModel* model) {
  const std::vector<XmlElement> keys = root.InSections("keyframe", {"key"});
  std::optional<XmlValue> controls;
  const bool has_start = !keys.empty() && model->replicates.empty();
  if (has_start) {
    std::vector<double> qpos, qvel;
    for (const MjcfJoint& joint : model->joints) {
      qpos.insert(qpos.end(), joint.drawn.begin(), joint.drawn.end());
      qvel.insert(qvel.end(), static_cast<std::size_t>(joint.num_u()), 0.0);
    }
    const auto positions = keys[0].Attribute("qpos");
    const auto speeds = keys[0].Attribute("qvel");
    if (speeds) qvel = speeds->Numbers(qvel.size(), qvel.size());
    if (positions) qpos = positions->Numbers(qpos.size(), qpos.size());
    if (positions || speeds) SetMjcfStart(model, keys[0], qpos, qvel);
    controls = keys[0].Attribute("ctrl");
    keys[0].Attribute("name");
    keys[0].Attribute("time");
  }
  for (std::size_t i = has_start ? 1 : 0; i < keys.size(); ++i) {
    model->draft->DropWhole(keys[i],
                            has_start ? "the first <key> is the start"
                                      : "with <replicate>, a <key> holds values of one replica",
                            !has_start);
  }
  ReadMjcfActuators(root, controls, model);
}

}  // namespace loopbench::harness
