// "ground" and "bodies" of a mechanism file.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "harness/config/mechanism_sections.h"

namespace loopbench::harness {
namespace {

void ReadPoints(const JsonNode& owner, SpaceKind space, BodyDescription* body) {
  const auto points = owner.Optional("points");
  if (!points) return;
  for (const auto& [name, position] : points->Members()) {
    if (name.empty()) position.FailAs("a point without a name", "a name that is not empty");
    body->points[name] = ReadVector(position, space);
  }
}

/// One number I becomes diag(I, I, I): in the plane only Izz matters, in space it is isotropic.
/// Six numbers are the elements [Ixx, Iyy, Izz, Ixy, Ixz, Iyz] of the matrix as it stands.
///
/// A principal moment is the integral of two squared distances of three: none exceeds the sum of
/// the other two, and in a thin rod or plate one equals it. In the plane only Izz is used, and
/// nothing is known of the others.
Eigen::Matrix3d ReadInertia(const JsonNode& node, SpaceKind space) {
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Identity();
  if (node.value().is_number()) return inertia * node.Number(kPositive);
  const bool known_size =
      node.value().is_array() && (node.value().size() == 3 || node.value().size() == 6);
  if (!known_size) {
    node.Fail("a number > 0, [Ixx, Iyy, Izz] or [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]");
    return inertia;
  }
  const std::vector<double> values = node.Numbers(node.value().size());
  inertia.diagonal() << values[0], values[1], values[2];
  if (values.size() == 6) {
    inertia(0, 1) = inertia(1, 0) = values[3];
    inertia(0, 2) = inertia(2, 0) = values[4];
    inertia(1, 2) = inertia(2, 1) = values[5];
  }
  // Not the factorisation alone: a matrix of huge elements may factorise by round-off.
  const bool positive = inertia.diagonal().minCoeff() > 0.0 &&
                        Eigen::LLT<Eigen::Matrix3d>(inertia).info() == Eigen::Success;
  if (!positive) node.Fail("a positive definite inertia");
  if (!positive || space == SpaceKind::kPlanar) return inertia;
  // Three significant digits, as data sheets print them, are off by up to 0.5 % in each moment.
  constexpr double kPrinted = 0.01;
  const Eigen::Vector3d moments =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia, Eigen::EigenvaluesOnly).eigenvalues();
  if (moments[2] > (1.0 + kPrinted) * (moments[0] + moments[1])) {
    node.Fail(
        "principal moments of which none exceeds the sum of the other two, as no body's does");
  }
  return inertia;
}

BodyDescription ReadBody(const JsonNode& node, const NameList& taken, SpaceKind space) {
  BodyDescription body;
  if (!node.ExpectObject({"name", "mass", "inertia", "com", "points"})) return body;
  body.name = ReadNewName(node, taken);
  if (const auto mass = node.Required("mass", "a number > 0 [kg]")) {
    body.mass = mass->Number(kPositive);
  }
  if (const auto inertia = node.Required("inertia", "the inertia about the centre of mass")) {
    body.inertia = ReadInertia(*inertia, space);
  }
  if (const auto com = node.Optional("com")) body.com = ReadVector(*com, space);
  ReadPoints(node, space, &body);
  return body;
}

}  // namespace

void ReadBodies(const JsonNode& root, Draft* draft) {
  const SpaceKind space = draft->space;
  draft->bodies[kGround].name = "ground";
  draft->body_names.Add("ground");
  const auto ground = root.Optional("ground");
  if (ground && ground->ExpectObject({"points"})) {
    ReadPoints(*ground, space, &draft->bodies[kGround]);
  }
  const auto bodies = root.Required("bodies", "an array of bodies");
  if (!bodies) return;
  const std::vector<JsonNode> elements = bodies->Elements("bodies");
  if (bodies->value().is_array() && elements.empty()) bodies->Fail("at least one body");
  for (const JsonNode& element : elements) {
    draft->bodies.push_back(ReadBody(element, draft->body_names, space));
    draft->body_names.Add(draft->bodies.back().name);
  }
}

}  // namespace loopbench::harness
