// Joints that close loops, springs between points and forces at points as MJCF; and what it lacks.
#include <algorithm>
#include <array>
#include <cmath>

#include "harness/exchange/export_body.h"
#include "harness/exchange/export_mjcf_writer.h"

namespace loopbench::exchange {
namespace {

using Eigen::Vector3d;

/// MuJoCo refuses masses and moments of moving bodies below it (its mjMINVAL).
constexpr double kLeastMass = 1e-15;
/// Deeper documents are refused by the parser that MuJoCo has.
constexpr int kMostNested = 90;

}  // namespace

std::vector<std::string> MissingInMjcf(const Model& model) {
  std::vector<std::string> missing = model.missing;
  std::vector<int> depth(model.bodies.size(), 0);
  for (const Joint& joint : model.tree) {
    if (!HasParts(joint)) missing.push_back("joint \"" + joint.name + "\": " + joint.kind);
    const auto child = static_cast<std::size_t>(joint.child());
    depth[child] = depth[static_cast<std::size_t>(joint.parent())] + 1;
    if (depth[child] == kMostNested + 1) {
      missing.push_back(fmt::format("body \"{}\": more than {} bodies between it and Ground",
                                    model.bodies[child].name, kMostNested - 1));
    }
  }
  for (const Joint& joint : model.cut) {
    const auto kinds = {"revolute", "weld", "spherical", "rod", "free"};
    if (std::ranges::find(kinds, joint.kind) == kinds.end()) {
      missing.push_back("joint \"" + joint.name + "\": " + joint.kind + ", which closes a loop");
    }
  }
  for (std::size_t i = 1; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const std::string fault = FaultOfInertia(body, model.planar);
    if (!fault.empty()) missing.push_back(fault);
    const Vector3d moments = PrincipalInertiaOf(body, model.planar).moments;
    const double least = std::min(body.mass, moments.minCoeff());
    if (least >= kLeastMass) continue;
    missing.push_back(fmt::format(
        "body \"{}\": a mass [kg] or moment of inertia [kg m^2] of {:.3g}, below {:.0e}", body.name,
        least, kLeastMass));
  }
  return missing;
}

void MjcfWriter::AddClosures(const Joint& joint) {
  const std::string& kind = joint.kind;
  if (kind == "free") return;
  std::vector<Vector3d> points = {Vector3d::Zero()};
  if (kind == "revolute" && !model_.planar) points.push_back(Vector3d::UnitZ());
  if (kind == "weld") points.push_back(Vector3d::UnitX());
  if (kind == "weld" && !model_.planar) points.push_back(Vector3d::UnitY());
  // as far away as the pivot is from its body's centre of mass, a length of the mechanism
  const Vec& p = joint.M.p;
  const double reach = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::string wanted = i == 0 ? joint.name : fmt::format("{}.{}", joint.name, i + 1);
    const std::string name = closure_names_.Take(XmlText(wanted));
    if (i == 0) Renamed("joint", joint.name, name);
    AddClosure(joint, points[i] * (reach > 0.0 ? reach : 1.0), name);
  }
  const std::string pairs = points.size() == 1
                                ? "a pair of points is"
                                : fmt::format("{} pairs of points are", points.size());
  Say(fmt::format("joint \"{}\" ({}) closes a loop: {} held {}.", joint.name, kind, pairs,
                  kind == "rod" ? "at a distance, by a tendon" : "together"));
}

void MjcfWriter::AddClosure(const Joint& joint, const Vector3d& at, const std::string& name) {
  const auto F = FromOrigin(model_, joint.from, joint.F);
  const auto M = FromOrigin(model_, joint.to, joint.M);
  const Vector3d first = F.p + F.R * at, second = M.p + M.R * at;
  MjcfClosure closure{ToVec(first), ToVec(second), -1.0};
  if (joint.kind == "rod") {
    closure.rod = joint.parameter;
    AddTendon(name, joint.from, first, joint.to, second, "");
    equalities_ += "    <tendon" + Named("name", name) + Named("tendon1", name) + "/>\n";
  } else {
    // MuJoCo wants a body other than the world first
    const bool swap = joint.from == 0;
    if (swap) std::swap(closure.at_first, closure.at_second);
    equalities_ += "    <connect" + Named("name", name) +
                   Named("body1", body_names_[At(swap ? joint.to : joint.from)]) +
                   Named("body2", body_names_[At(swap ? joint.from : joint.to)]) +
                   Attribute("anchor", closure.at_first) + "/>\n";
  }
  made_.closures.push_back(closure);
}

void MjcfWriter::AddTendon(const std::string& name, int from, const Vector3d& at_from, int to,
                           const Vector3d& at_to, const std::string& attributes) {
  const std::string first = AddSite(from, at_from, name + ".from");
  const std::string second = AddSite(to, at_to, name + ".to");
  tendons_ += fmt::format(
      "    <spatial{} limited=\"false\"{}>\n      <site{}/>\n      <site{}/>\n    </spatial>\n",
      Named("name", name), attributes, Named("site", first), Named("site", second));
}

void MjcfWriter::AddSpringDamper(std::size_t index) {
  const SpringDamper& force = model_.spring_dampers[index];
  const std::string name = closure_names_.Take(fmt::format("spring_damper {}", index + 1));
  const auto &from = force.from, &to = force.to;
  AddTendon(name, from.body, FromOrigin(model_, from.body, from.at), to.body,
            FromOrigin(model_, to.body, to.at),
            Attribute("stiffness", force.stiffness) + Attribute("damping", force.damping) +
                Attribute("springlength", force.length));
  if (force.preload == 0.0) return;
  // a tension shortens
  actuators_ += "    <general" + Named("tendon", name) + Constant(-force.preload) + "/>\n";
  Say(fmt::format("The preload of {} is an actuator without control.", name));
}

void MjcfWriter::AddPointForce(std::size_t index) {
  const PointForce& force = model_.point_forces[index];
  const int body = force.point.body;
  const std::string name = fmt::format("point_force {}", index + 1);
  std::string sites = Named("site", AddSite(body, FromOrigin(model_, body, force.point.at), name));
  if (!force.in_body_axes) {
    sites += Named("refsite", AddSite(0, Vector3d::Zero(), name + ".axes"));
  }
  const Vec& F = force.force;
  actuators_ += "    <general" + sites +
                Attribute("gear", std::array{F[0], F[1], F[2], 0.0, 0.0, 0.0}) + Constant(1.0) +
                "/>\n";
  Say(fmt::format("{} on body \"{}\" is an actuator without control.", name,
                  model_.bodies[At(body)].name));
}

}  // namespace loopbench::exchange
