// "ground" and "bodies" of a mechanism file.
#include <Eigen/Cholesky>

#include "harness/config/mechanism_sections.h"
#include "mechanism/algebra/symmetric_eigen.h"

namespace loopbench::harness {
namespace {

void ReadPoints(const JsonNode& node, SpaceKind space, BodyDescription* body) {
  for (const auto& [name, position] : node.Members()) {
    if (name.empty()) position.FailAs("a point without a name", "a name that is not empty");
    body->points[name] = ReadVector(position, space);
  }
}

Json WritePoints(const BodyDescription& body, SpaceKind space) {
  Json points = Json::object();
  // names differ: at the end of the list, where points[name] would look through all of them
  auto& list = points.get_ref<Json::object_t&>();
  for (const auto& [name, at] : body.points) list.emplace_back(name, WriteVector(at, space));
  return points.empty() ? Json() : points;
}

Json PointsSchema() {
  Json schema = MapSchema(VectorSchema());
  schema["propertyNames"] = {{"minLength", 1}};
  return Named("points", schema);
}

using Body = PartOf<BodyDescription>;

/// One number I becomes diag(I, I, I): in the plane only Izz matters, in space it is isotropic.
/// Six numbers are the elements [Ixx, Iyy, Izz, Ixy, Ixz, Iyz] of the matrix as it stands.
///
/// A principal moment is the integral of two squared distances of three: none exceeds the sum of
/// the other two, and in a thin rod or plate one equals it. In the plane only Izz is used, and
/// nothing is known of the others.
void ReadInertia(const JsonNode& node, Body& body) {
  Eigen::Matrix3d& inertia = body.inertia;
  inertia.setIdentity();
  if (node.value().is_number()) inertia *= node.Number(kPositive);
  if (node.value().is_number()) return;
  const bool known_size =
      node.value().is_array() && (node.value().size() == 3 || node.value().size() == 6);
  if (!known_size) {
    node.Fail("a number > 0, [Ixx, Iyy, Izz] or [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]");
    return;
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
  if (!positive || body.draft->space == SpaceKind::kPlanar) return;
  // Three significant digits, as data sheets print them, are off by up to 0.5 % in each moment.
  constexpr double kPrinted = 0.01;
  const Eigen::Vector3d moments = SymmetricEigenvalues(inertia);
  if (moments[2] > (1.0 + kPrinted) * (moments[0] + moments[1])) {
    node.Fail("principal moments that satisfy the triangle inequality");
  }
}

/// As short as it can be said without loss.
Json WriteInertia(const Body& body) {
  const Eigen::Matrix3d& I = body.inertia;
  const bool is_diagonal = I(0, 1) == 0.0 && I(0, 2) == 0.0 && I(1, 2) == 0.0;
  if (is_diagonal && I(0, 0) == I(2, 2) && I(1, 1) == I(2, 2)) return I(2, 2);
  Json json = {I(0, 0), I(1, 1), I(2, 2)};
  for (const double product : {I(0, 1), I(0, 2), I(1, 2)}) {
    if (!is_diagonal) json.push_back(product);
  }
  return json;
}

void ReadNameOfBody(const JsonNode& node, Body& body) {
  body.name = ReadNewName(node, body.draft->body_names);
}

Json WriteNameOfBody(const Body& body) { return body.name; }

void ReadPointsOfBody(const JsonNode& node, Body& body) {
  ReadPoints(node, body.draft->space, &body);
}

Json WritePointsOfBody(const Body& body) { return WritePoints(body, body.draft->space); }

void ReadPointsOfGround(const JsonNode& node, Draft& draft) {
  ReadPoints(node, draft.space, &draft.bodies[kGround]);
}

Json WritePointsOfGround(const Draft& draft) {
  return WritePoints(draft.bodies[kGround], draft.space);
}

const Fields<Body>& BodyFields() {
  static const Json inertia =
      EitherSchema({NumberSchema(kPositive), ArraySchema(NumberSchema(kPositive), 3, 3),
                    ArraySchema(NumberSchema(), 6, 6)});
  static const Fields<Body> fields(
      "body", "A rigid body.",
      {{"name", By(TextSchema(), ReadNameOfBody, WriteNameOfBody), "One that no other body has.",
        "a name"},
       {"mass", Number(&BodyDescription::mass, kPositive), "Mass [kg].", "a number > 0 [kg]"},
       {"inertia", By(inertia, ReadInertia, WriteInertia),
        "About the centre of mass, body axes [kg m^2]: Izz (isotropic in space), [Ixx, Iyy, Izz] "
        "or the matrix elements [Ixx, Iyy, Izz, Ixy, Ixz, Iyz].",
        "the inertia about the centre of mass"},
       {"com", VectorOf(&BodyDescription::com),
        "Centre of mass in body axes [m], default the body's origin."},
       {"points", By(PointsSchema(), ReadPointsOfBody, WritePointsOfBody),
        "Named points in body axes from the body's origin [m]."}});
  return fields;
}

const Fields<Draft>& GroundFields() {
  static const Fields<Draft> fields(
      "ground", "What does not move.",
      {{"points", By(PointsSchema(), ReadPointsOfGround, WritePointsOfGround),
        "Named points in ground axes from the origin [m]."}});
  return fields;
}

void ReadBodies(const JsonNode& node, Draft& draft) {
  const std::vector<JsonNode> elements = node.Elements("bodies");
  if (node.value().is_array() && elements.empty()) node.Fail("at least one body");
  for (const JsonNode& element : elements) {
    draft.bodies.push_back(ReadPart(BodyFields(), element, draft));
    draft.body_names.Add(draft.bodies.back().name);
  }
}

Json WriteBodies(const Draft& draft) {
  Json bodies = Json::array();
  for (std::size_t i = kGround + 1; i < draft.bodies.size(); ++i) {
    bodies.push_back(WritePart(BodyFields(), draft, draft.bodies[i]));
  }
  return bodies;
}

}  // namespace

FieldValue<Draft> GroundValue() { return Section(GroundFields()); }

FieldValue<Draft> BodiesValue() {
  return By(ArraySchema(BodyFields().Schema(), 1), ReadBodies, WriteBodies);
}

}  // namespace loopbench::harness
