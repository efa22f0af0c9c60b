// <equality> and <tendon>: constraints that close loops, and forces between two points.
#include "harness/exchange/import_mjcf.h"

namespace loopbench::harness {

namespace {

constexpr const char* kUnknownAxes =
    "MuJoCo's axes of a free body with align are its principal axes; here they are the file's";

std::string NameOr(const XmlElement& element, const std::string& otherwise) {
  const auto name = element.Attribute("name");
  return name ? name->Name() : otherwise;
}

/// Adds a <connect> or <weld> of two sites, or of two bodies by a point or pose at rest.
///
/// MuJoCo's weld (engine_core_constraint.c): x1 + R1 relpose = x2 + R2 anchor, and torquescale
/// times the relative rotation is 0.
void AddClosure(const XmlElement& equality, MjcfModel* model) {
  ImportDraft* draft = model->draft;
  const bool is_weld = equality.tag() == "weld";
  const bool is_ball = !is_weld || equality.Number("torquescale", 1.0) == 0.0;
  const auto site1 = equality.Attribute("site1"), site2 = equality.Attribute("site2");
  const auto anchor = equality.Attribute("anchor");
  const auto pose = is_weld ? equality.Attribute("relpose") : std::nullopt;
  FrameOn first, second;
  if (site1) {  // which make anchor and pose idle
    if (!site2) equality.Fail("no \"site2\"", "a site of the other body");
    first = model->SiteNamed(*site1);
    second = model->SiteNamed(*site2);
  } else {
    const auto body2 = equality.Attribute("body2");
    first.body = model->BodyNamed(equality.Required("body1", "the name of a body"));
    if (body2) second.body = model->BodyNamed(*body2);
    const MjcfFrame frame1 = model->FrameOf(first.body), frame2 = model->FrameOf(second.body);
    const Placement X1 = draft->at_rest[first.body] * frame1.X;
    const Placement X2 = draft->at_rest[second.body] * frame2.X;
    if (is_weld) {
      second.X.p = VectorOr(anchor);
      first.X = X1.Inverse() * X2 * second.X;
      if (pose) {
        // a zero quaternion selects the drawn poses
        const std::vector<double> p = draft->Numbers(*pose, "nnnq");
        const Eigen::Quaterniond q(p[3], p[4], p[5], p[6]);
        if (q.norm() > 0.0) first.X = {UnitQuaternion(*pose, q), {p[0], p[1], p[2]}};
      }
    } else {
      first.X.p = equality.Required("anchor", "3 numbers").Vector();
      second.X = X2.Inverse() * X1 * first.X;
    }
    first.X = frame1.X * first.X;
    second.X = frame2.X * second.X;
    if (!frame1.has_axes || !frame2.has_axes) draft->Note(equality, kUnknownAxes, true);
  }
  if (is_ball) first.X.q = second.X.q = Eigen::Quaterniond::Identity();
  draft->AddLoop(equality, draft->NameLater(NameOr(equality, equality.tag()) + model->Suffix()),
                 is_ball ? JointType::kSpherical : JointType::kWeld, first, second);
}

/// Returns the coefficients of `polycoef`; missing ones have their defaults.
std::vector<double> PolynomialOf(const XmlElement& equality) {
  std::vector<double> a = {0.0, 1.0, 0.0, 0.0, 0.0};
  if (const auto given = equality.Attribute("polycoef")) {
    std::ranges::copy(given->Numbers(1, 5), a.begin());
  }
  return a;
}

using Parts = std::vector<CouplingDescription::Part>;

/// Returns the coefficients of a fixed tendon. Its length is sum_i coef_i q_i.
Parts CoefficientsOf(const XmlElement& tendon, const MjcfModel& model) {
  Parts parts;
  for (const XmlElement& child : tendon.Children({"joint"})) {
    const std::size_t index = model.JointNamed(child.Required("joint", "the name of a joint"));
    const int joint = model.joints[index].joint;
    if (std::ranges::count(parts, joint, &CouplingDescription::Part::joint) > 0) {
      child.Fail("a joint twice", "each joint once");
    }
    parts.push_back({joint, child.Required("coef", "a number").Number()});
  }
  return parts;
}

/// Couples two lengths, or holds one constant. Returns false if the constraint is dropped.
///
/// MuJoCo: L1 - L1_0 = a_0 + a_1 (L2 - L2_0) + ..., with L_0 the lengths in the drawn position.
/// Loopbench's coordinates are 0 there. The length of a joint is its coordinate.
bool AddCoupling(const XmlElement& equality, const std::string& name, Parts parts,
                 const std::optional<Parts>& others, MjcfModel* model) {
  const std::vector<double> a = PolynomialOf(equality);
  if (others && (a[2] != 0.0 || a[3] != 0.0 || a[4] != 0.0)) {
    model->draft->Note(equality, "polycoef",
                       "dropped: couplings are linear: this is a freedom more than in the file",
                       true);
    return false;
  }
  for (const auto& [joint, ratio] : others.value_or(Parts())) {
    const auto known = std::ranges::find(parts, joint, &CouplingDescription::Part::joint);
    auto& part =
        known != parts.end() ? *known : parts.emplace_back(CouplingDescription::Part{joint, 0.0});
    part.ratio -= a[1] * ratio;
  }
  return model->draft->AddCoupling(equality, name + model->Suffix(), std::move(parts), a[0]);
}

bool AddJointEquality(const XmlElement& equality, MjcfModel* model) {
  const auto part = [&](const XmlValue& name) {
    return Parts{{model->joints[model->JointNamed(name)].joint, 1.0}};
  };
  const Parts first = part(equality.Required("joint1", "the name of a joint"));
  std::optional<Parts> second;
  if (const auto other = equality.Attribute("joint2")) second = part(*other);
  if (second && second->front().joint == first.front().joint) {
    equality.Fail("a joint that follows itself", "another joint");
  }
  return AddCoupling(equality, NameOr(equality, "equality"), first, second, model);
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
  if (!model->settings.has_springs) spring.stiffness = 0.0;
  if (!model->settings.has_dampers) spring.damping = 0.0;
  spring.length = free_length;
  if (const auto given = tendon.Attribute("springlength")) {
    const std::vector<double> rest = given->Numbers(1, 2);
    if (spring.stiffness > 0.0 && rest[0] != rest.back()) {
      given->Fail("one length: a spring with a range where it is free is no force here");
    }
    if (rest[0] >= 0.0) spring.length = rest[0];
  }
  if (spring.stiffness > 0.0 || spring.damping > 0.0) {
    model->draft->description.forces.emplace_back(spring);
  }
}

double LengthOf(const std::pair<BodyPoint, BodyPoint>& ends, const std::vector<Placement>& poses) {
  const auto place = [&](const BodyPoint& point) { return poses[point.body].At(point.at); };
  return (place(ends.first) - place(ends.second)).norm();
}

/// Adds the constraint of one or two tendons: a coupling or a rod. Returns false if it is dropped.
bool AddTendonEquality(const XmlElement& equality, const std::vector<XmlElement>& tendons,
                       MjcfModel* model) {
  ImportDraft* draft = model->draft;
  const bool is_pair = tendons.size() > 1;
  equality.Attribute("name");  // the coupling or rod has the name of the first tendon
  const std::string name = tendons[0].Attribute("name")->Name();
  if (std::ranges::all_of(tendons, [](const XmlElement& one) { return one.tag() == "fixed"; })) {
    std::optional<Parts> others;
    if (is_pair) others = CoefficientsOf(tendons[1], *model);
    return AddCoupling(equality, name, CoefficientsOf(tendons[0], *model), others, model);
  }
  const auto ends = is_pair ? std::nullopt : StraightEnds(tendons[0], *model);
  if (ends && ends->first.body == ends->second.body) {
    draft->DropWhole(equality, "both ends are on one body", PolynomialOf(equality)[0] != 0.0);
    return false;
  }
  if (!ends) {
    draft->DropWhole(equality,
                     "only fixed tendons, and the length of one straight spatial tendon, are "
                     "constraints here: this is a freedom more than in the file",
                     true);
    return false;
  }
  const double length = LengthOf(*ends, draft->at_rest) + PolynomialOf(equality)[0];
  if (!(length > 0.0)) tendons[0].Fail("a length that is not > 0", "one that is");
  const auto& [a, b] = *ends;
  draft
      ->AddJoint(draft->NameLater(name + model->Suffix()), JointType::kRod,
                 {a.body, Placement(a.at)}, {b.body, Placement(b.at)})
      .parameter = length;
  return true;
}

/// Adds the names of the sites and joints of a tendon.
void AddReferences(const XmlElement& tendon, MjcfModel::References* references) {
  for (const char* kind : {"site", "joint"}) {
    for (const XmlElement& part : tendon.Children({kind})) {
      references->emplace_back(kind, part.Attribute(kind));
    }
  }
}

void ReadEquality(const XmlElement& root, const std::map<std::string, XmlElement>& tendons,
                  MjcfModel* model) {
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
    std::vector<XmlElement> lengths;
    if (tag == "tendon") {
      const XmlValue first = element.Required("tendon1", "the name of a tendon");
      for (const auto& name : {std::optional(first), element.Attribute("tendon2")}) {
        if (!name) continue;
        lengths.push_back(Named(tendons, name->text(), *name, "the name of a tendon"));
        AddReferences(lengths.back(), &references);
      }
    } else if (tag == "joint") {
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
      if (tag == "tendon") is_exact = AddTendonEquality(equality, lengths, model);
    });
    if (is_exact) {
      model->draft->Note(element, "imposed exactly here; MuJoCo lets it give way");
    } else if (tag != "joint" && tag != "tendon") {
      model->draft->DropWhole(element, "there is no constraint of this kind", true);
    }
  }
}

/// Reads forces of a tendon. `groups`: FixedTogether() of the bodies.
void ReadTendon(const XmlElement& element, const std::vector<int>& groups, MjcfModel* model) {
  const auto ends = element.tag() == "spatial" ? StraightEnds(element, *model) : std::nullopt;
  if (ends && groups[ends->first.body] == groups[ends->second.body]) {
    return model->draft->DropWhole(element, "both ends are on bodies that are fixed together");
  }
  const XmlElement tendon = model->defaults.Of(element, "", "tendon");
  model->NoteLimits(tendon, "tendons do not end");
  if (ends) {
    AddSpring(tendon, *ends, LengthOf(*ends, model->where_springs_are_free), model);
  } else {
    tendon.Ignore();
    for (const auto& [key, acts] : {std::pair{"stiffness", model->settings.has_springs},
                                    {"damping", model->settings.has_dampers}}) {
      if (!acts) continue;
      model->DropNonzero(
          tendon, key,
          "only spatial tendons straight between two sites of two bodies are springs here");
    }
  }
  if (model->settings.has_friction) {
    model->DropNonzero(tendon, "frictionloss", "there is no dry friction");
  }
  model->DropNonzero(tendon, "armature", "tendons have no inertia");
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
      const Placement X_WI(Quaterniond(q[3], q[4], q[5], q[6]).normalized(), Vector3d(q));
      const Vector3d w = X_WI.q * Vector3d(u[3], u[4], u[5]);
      Vector3d v(u[0], u[1], u[2]);
      if (const auto it = model->aligned.find(ours.to.body); it != model->aligned.end()) {
        const Placement X_WB = X_WI * it->second.X.Inverse();
        coordinates = X_WB.AsCoordinates();
        v += w.cross(X_WB.p - X_WI.p);
        const bool is_known = it->second.has_axes || (!positions && w.isZero(0.0));
        if (!is_known) model->draft->Note(key, kUnknownAxes, true);
      }
      speeds = {w.x(), w.y(), w.z(), v.x(), v.y(), v.z()};
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
  std::map<std::string, XmlElement> tendons;
  const std::vector<XmlElement> elements = root.InSections("tendon");
  for (const XmlElement& element : elements) {
    if (const auto name = element.Attribute("name")) tendons.emplace(name->text(), element);
  }
  ReadEquality(root, tendons, model);
  const std::vector<int> groups = FixedTogether(model->draft->description);
  for (const XmlElement& element : elements) {
    MjcfModel::References parts;
    AddReferences(element, &parts);
    model->ForReplicas(parts, [&] { ReadTendon(element, groups, model); });
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
