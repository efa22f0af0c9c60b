// <equality> and <tendon>: what closes loops and what pulls between two points.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/exchange/import_mjcf.h"

namespace loopbench::harness {

namespace {

constexpr const char* kMjcfWorld = "world";

/// The two frames of a loop, each on its body, at the same place where all coordinates are 0.
struct Ends {
  int first = kGround, second = kGround;
  Placement X_first, X_second;
};

/// The frame on the second body that is where `X` on the first is.
Placement AtRestOn(const MjcfModel& model, int first, const Placement& X, int second) {
  const auto& rest = model.draft->at_rest;
  return rest[static_cast<std::size_t>(second)].Inverse() * rest[static_cast<std::size_t>(first)] *
         X;
}

std::optional<Ends> EndsAtSites(const MjcfModel& model, const MjcfElement& equality) {
  const auto site1 = equality.Attribute("site1"), site2 = equality.Attribute("site2");
  if (!site1) return std::nullopt;
  if (!site2) equality.own().Fail("no \"site2\"", "a site of the other body");
  const BodyPoint &a = model.SiteNamed(*site1), &b = model.SiteNamed(*site2);
  return Ends{a.body, b.body, Placement(a.at), Placement(b.at)};
}

Ends EndsOnBodies(const MjcfModel& model, const MjcfElement& equality) {
  Ends ends;
  const auto body1 = equality.Attribute("body1"), body2 = equality.Attribute("body2");
  if (!body1) equality.own().Fail("no \"body1\"", "the name of a body");
  ends.first = model.draft->BodyNamed(*body1, {kMjcfWorld});
  if (body2) ends.second = model.draft->BodyNamed(*body2, {kMjcfWorld});
  return ends;
}

void AddConnect(const MjcfElement& equality, MjcfModel* model) {
  auto ends = EndsAtSites(*model, equality);
  if (!ends) {
    ends = EndsOnBodies(*model, equality);
    const auto anchor = equality.Attribute("anchor");
    if (!anchor) equality.own().Fail("no \"anchor\"", "3 numbers");
    ends->X_first.p = anchor->Vector();
    ends->X_second.p = AtRestOn(*model, ends->first, ends->X_first, ends->second).p;
  }
  if (ends->first == ends->second) equality.own().Fail("one body twice", "two different bodies");
  const auto name = equality.own().Attribute("name");
  ImportDraft* draft = model->draft;
  draft
      ->AddJoint(draft->NameLater(name ? name->Name() : "connect"), JointType::kSpherical,
                 ends->first, ends->X_first, ends->second, ends->X_second)
      .cut = true;
}

/// `relpose`: the second body in the first, from the anchor on the second.
void AddWeld(const MjcfElement& equality, MjcfModel* model) {
  if (equality.Attribute("site1")) {
    equality.own().Fail("a weld of sites", "a weld of bodies (body1, body2)");
  }
  Ends ends = EndsOnBodies(*model, equality);
  if (ends.first == ends.second) equality.own().Fail("one body twice", "two different bodies");
  Placement relative = AtRestOn(*model, ends.second, {}, ends.first);
  if (const auto pose = equality.Attribute("relpose")) {
    const std::vector<double> p = model->draft->Numbers(*pose, "nnnq");
    const Eigen::Quaterniond q(p[3], p[4], p[5], p[6]);
    // a quaternion of zeros asks for the poses that the file draws
    if (q.norm() > 0.0) relative = {UnitQuaternion(*pose, q), {p[0], p[1], p[2]}};
  }
  equality.Attribute("anchor");  // where the two are held together: a weld holds them everywhere
  equality.Attribute("torquescale");
  const auto name = equality.own().Attribute("name");
  ImportDraft* draft = model->draft;
  draft
      ->AddJoint(draft->NameLater(name ? name->Name() : "weld"), JointType::kWeld, ends.first,
                 relative, ends.second, {})
      .cut = true;
}

/// A joint of one coordinate at a constant value. False for a coupling of two, which is dropped.
bool AddConstantJoint(const MjcfElement& equality, MjcfModel* model) {
  const auto joint1 = equality.Attribute("joint1");
  if (!joint1) equality.own().Fail("no \"joint1\"", "the name of a joint");
  const MjcfJoint& joint = model->JointNamed(*joint1);
  const auto coefficients = equality.Attribute("polycoef");
  const std::vector<double> a =
      coefficients ? coefficients->Numbers(1, 5) : std::vector<double>{0.0};
  if (equality.Attribute("joint2") || joint.num_q() != 1 || !joint.alone) {
    model->draft->Note(equality.own(),
                       "dropped: no joint follows another: this is a freedom more than in the file",
                       true);
    return false;
  }
  // MuJoCo: q1 - q1_0 = a_0, with q1_0 the coordinate where the file draws the joint
  JointDescription& ours = model->draft->description.joints[static_cast<std::size_t>(joint.joint)];
  ours.motions = {{0, Polynomial{{a[0]}}}};
  return true;
}

void ReadSolverOptions(const MjcfElement& element) {
  for (const char* name : {"solref", "solimp"}) element.Attribute(name);
}

}  // namespace

void ReadMjcfEquality(const XmlElement& section, MjcfModel* model) {
  for (const XmlElement& element : section.Children()) {
    const auto active = model->defaults.Peek(element, "", "equality").Attribute("active");
    if (!model->settings.has_equality || (active && !active->Bool())) {
      element.Ignore();
      model->draft->Note(element, "dropped: it is not active");
      continue;
    }
    const MjcfElement equality = model->defaults.Of(element, "", "equality");
    ReadSolverOptions(equality);
    const std::string tag = element.tag();
    bool is_exact = tag == "connect" || tag == "weld";
    if (tag == "connect") AddConnect(equality, model);
    if (tag == "weld") AddWeld(equality, model);
    if (tag == "joint") is_exact = AddConstantJoint(equality, model);
    if (is_exact) {
      model->draft->Note(element, "imposed exactly here; MuJoCo lets it give way");
    } else if (tag != "joint" && tag != "tendon") {
      element.Ignore();
      model->draft->Note(element, "dropped: there is no constraint of this kind", true);
    }
  }
}

namespace {

/// The two sites of a tendon that is straight, or nothing.
std::optional<std::pair<BodyPoint, BodyPoint>> StraightEnds(const XmlElement& element,
                                                            const MjcfModel& model) {
  const std::vector<XmlElement> sites = element.Children("site");
  const bool wraps = !element.Children("geom").empty() || !element.Children("pulley").empty();
  if (sites.size() != 2 || wraps) return std::nullopt;
  const auto end = [&](const XmlElement& site) {
    return model.SiteNamed(site.Required("site", "the name of a site"));
  };
  return std::pair{end(sites[0]), end(sites[1])};
}

/// A tendon of a length that does not change.
void AddRod(const std::string& name, const std::pair<BodyPoint, BodyPoint>& ends, double length,
            MjcfModel* model) {
  const auto& [a, b] = ends;
  ImportDraft* draft = model->draft;
  JointDescription& rod = draft->AddJoint(draft->NameLater(name), JointType::kRod, a.body,
                                          Placement(a.at), b.body, Placement(b.at));
  rod.parameter = length;
}

void AddSpring(const MjcfElement& tendon, const std::pair<BodyPoint, BodyPoint>& ends,
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
  const auto place = [&](const BodyPoint& point) {
    return poses[static_cast<std::size_t>(point.body)].At(point.at);
  };
  return (place(ends.first) - place(ends.second)).norm();
}

void ReadTendon(const XmlElement& element, const std::map<std::string, XmlElement>& held,
                const std::vector<Placement>& free_poses, MjcfModel* model) {
  const auto name = element.Attribute("name");
  const auto ends = element.tag() == "spatial" ? StraightEnds(element, *model) : std::nullopt;
  if (!ends || ends->first.body == ends->second.body) {
    element.Ignore();
    model->draft->Note(element,
                       "dropped: only spatial tendons straight between two sites of two bodies are "
                       "springs here",
                       true);
    return;
  }
  const MjcfElement tendon = model->defaults.Of(element, "", "tendon");
  AddSpring(tendon, *ends, LengthOf(*ends, free_poses), model);
  model->NoteLimits(tendon, "dropped: tendons do not end");
  if (tendon.Number("frictionloss", 0.0) != 0.0) {
    model->draft->Note(element, "frictionloss", "dropped: there is no dry friction", true);
  }
  if (tendon.Number("armature", 0.0) != 0.0) {
    model->draft->Note(element, "armature", "dropped: tendons have no inertia", true);
  }
  if (!name || !held.contains(name->text()) || !model->settings.has_equality) return;
  const MjcfElement equality = model->defaults.Of(held.at(name->text()), "", "equality");
  equality.own().Attribute("name");  // the tendon's is the rod's
  const auto coefficients = equality.Attribute("polycoef");
  const double offset = coefficients ? coefficients->Numbers(1, 5)[0] : 0.0;
  const double drawn = LengthOf(*ends, model->draft->at_rest);
  if (!(drawn + offset > 0.0)) element.Fail("a length that is not > 0", "one that is");
  AddRod(name->Name(), *ends, drawn + offset, model);
  model->draft->Note(equality.own(), "a rod here, exactly of its length");
}

}  // namespace

void ReadMjcfTendons(const XmlElement& root, const std::map<std::string, XmlElement>& held,
                     MjcfModel* model) {
  const std::vector<Placement> free_poses = model->WhereSpringsAreFree();
  for (const XmlElement& section : root.Children("tendon")) {
    for (const XmlElement& element : section.Children()) {
      ReadTendon(element, held, free_poses, model);
    }
  }
}

}  // namespace loopbench::harness
