// Sections of a mechanism: bodies and joints.

#include <Eigen/Cholesky>
#include <cmath>

#include "harness/base/text.h"
#include "harness/config/mechanism_sections.h"
#include "mechanism/algebra/symmetric_eigen.h"

namespace loopbench::harness {
namespace {

using Points = std::map<std::string, Eigen::Vector3d>;

Points ReadPoints(const JsonNode& node, const Draft& draft) {
  Points points;
  for (const auto& [name, position] : node.Members()) {
    if (name.empty()) position.FailAs("a point without a name", "a name that is not empty");
    points[name] = ReadVector(position, draft);
  }
  return points;
}

Json WritePoints(const Points& points, const Draft& draft) {
  Json written = Json::object();
  // names are unique: append, since written[name] would search the list
  auto& list = written.get_ref<Json::object_t&>();
  for (const auto& [name, at] : points) list.emplace_back(name, WriteVector(at, draft));
  return written;
}

Json PointsSchema() {
  Json schema = MapSchema(VectorSchema());
  schema["propertyNames"] = {{"minLength", 1}};
  return Named("points", schema);
}

/// Reads the inertia. One number I becomes diag(I, I, I): in the plane only Izz matters, in space
/// it is isotropic. Six numbers are the elements [Ixx, Iyy, Izz, Ixy, Ixz, Iyz].
///
/// Principal moments satisfy the triangle inequality; for a thin rod or plate with equality. In the
/// plane only Izz is used and the other moments are unknown.
void ReadInertia(const JsonNode& node, BodyDescription& body, const Draft& draft) {
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
  // The factorisation alone is insufficient: huge elements may pass by round-off.
  const bool positive = inertia.diagonal().minCoeff() > 0.0 &&
                        Eigen::LLT<Eigen::Matrix3d>(inertia).info() == Eigen::Success;
  if (!positive) node.Fail("a positive definite inertia");
  if (!positive || draft.space == SpaceKind::kPlanar) return;
  // Three significant digits, as data sheets print them, are off by up to 0.5 % in each moment.
  constexpr double kPrinted = 0.01;
  const Eigen::Vector3d moments = SymmetricEigenvalues(inertia);
  if (moments[2] > (1.0 + kPrinted) * (moments[0] + moments[1])) {
    node.Fail("principal moments that satisfy the triangle inequality");
  }
}

/// Writes the shortest form without loss.
Json WriteInertia(const BodyDescription& body, const Draft&) {
  const Eigen::Matrix3d& I = body.inertia;
  const bool is_diagonal = I(0, 1) == 0.0 && I(0, 2) == 0.0 && I(1, 2) == 0.0;
  if (is_diagonal && I(0, 0) == I(2, 2) && I(1, 1) == I(2, 2)) return I(2, 2);
  Json json = {I(0, 0), I(1, 1), I(2, 2)};
  for (const double product : {I(0, 1), I(0, 2), I(1, 2)}) {
    if (!is_diagonal) json.push_back(product);
  }
  return json;
}

/// Masses times squares of lengths must not overflow.
void CheckSizes(const JsonNode& node, BodyDescription& body, const Draft&) {
  constexpr double kLargest = 1e100;
  const auto mass = node.Optional("mass"), inertia = node.Optional("inertia");
  if (mass && body.mass >= kLargest) mass->Fail("a mass below 1e100 kg");
  if (inertia && body.inertia.cwiseAbs().maxCoeff() >= kLargest) {
    inertia->Fail("moments of inertia below 1e100 kg m^2");
  }
}

const PartFields<BodyDescription>& BodyFields() {
  using Body = BodyDescription;
  static const Json inertia =
      EitherSchema({NumberSchema(kPositive), ArraySchema(NumberSchema(kPositive), 3, 3),
                    ArraySchema(NumberSchema(), 6, 6)});
  static const PartFields<Body> fields(
      "body", "A rigid body.",
      {{"name", NewName(&Body::name, &Draft::body_names), "Unique name of the body.", "a name"},
       {"mass", Number(&Body::mass, kPositive), "Mass [kg].", "a number > 0 [kg]"},
       {"inertia", By(inertia, ReadInertia, WriteInertia),
        "Inertia about the centre of mass in body axes [kg m^2]: Izz (isotropic in space), [Ixx, "
        "Iyy, Izz] or the matrix elements [Ixx, Iyy, Izz, Ixy, Ixz, Iyz].",
        "the inertia about the centre of mass"},
       {"com", Coded<Body>(&Body::com, VectorSchema(), ReadVector, UnlessZero<WriteVector>),
        "Centre of mass in body axes [m]; default: the body's origin."},
       {"points", Coded<Body>(&Body::points, PointsSchema(), ReadPoints, WritePoints),
        "Named points in body axes, from the body's origin [m]."},
       {"", By(Json::object(), CheckSizes)}});
  return fields;
}

const PartFields<Draft>& GroundFields() {
  const auto points = [](auto& draft) -> auto& { return draft.bodies[kGround].points; };
  static const PartFields<Draft> fields(
      "ground", "The fixed ground.",
      {{"points", Coded<Draft>(points, PointsSchema(), ReadPoints, WritePoints),
        "Named points in ground axes, from the origin [m]."}});
  return fields;
}

// "joints" of a mechanism file.

using Side = JointSide;
using Joint = JointDescription;

const PartFields<Side>& SideFields() {
  static const PartFields<Side> fields(
      "side", "Frame of a joint, fixed to a body.",
      {{"body", BodyOf<Side>(&Side::body, true), "Name of a body, or \"ground\".",
        "the name of a body or \"ground\""},
       {"at", PlaceOf<Side>(&Side::body, &Side::position),
        "Origin: a point of the body by name, or body coordinates [m]. Default: body origin."},
       {"rotation",
        Coded<Side>(&Side::rotation, RotationSchema(), ReadRotation, UnlessZero<WriteRotation>),
        "Rotation from body to frame [rad]: angle about z, or rotation vector; default: 0."}});
  return fields;
}

constexpr double kZeroAxis = 1e-12;  ///< largest component of an axis that counts as zero

/// Returns the schema of a vector that is not zero.
Json AxisSchema() {
  const Json zero = {{"items", {{"minimum", -kZeroAxis}, {"maximum", kZeroAxis}}}};
  return {{"allOf", Json::array({VectorSchema(), {{"not", zero}}})},
          {"words", VectorSchema()["words"]}};
}

void ReadAxis(const JsonNode& node, Joint& joint, const Draft& draft) {
  const Eigen::Vector3d axis = joint.axis = node.Vector();
  const JointType type = joint.type;
  if (TraitsOf(type).own_axis == '-') {
    node.Fail(fmt::format("no axis on a {} joint", ToString(type)));
  } else if (axis.isZero(kZeroAxis)) {
    if (node.value().is_array()) node.Fail("an axis that is not zero");
  } else if (draft.space == SpaceKind::kPlanar) {
    const bool along_z = axis.x() == 0.0 && axis.y() == 0.0 && axis.z() > 0.0;
    if (TraitsOf(type).own_axis == 'z' && !along_z) {
      node.FailWithCure(kSpatialCure, "an axis along +z in a planar mechanism");
    }
    if (TraitsOf(type).own_axis == 'x' && axis.z() != 0.0) {
      node.FailWithCure(kSpatialCure, "an axis with z = 0 in a planar mechanism");
    }
  }
}

Json WriteAxis(const Joint& joint, const Draft& draft) {
  return UnlessZero<WriteVector>(joint.axis, draft);
}

Range RangeOf(const JointParameter& parameter) { return parameter.positive ? kPositive : Range{}; }

/// Parameter that some joint types require and others do not allow.
struct ParameterKey {
  JointParameter parameter;
  std::vector<std::string> types;
};

std::vector<ParameterKey> ParameterKeys() {
  std::vector<ParameterKey> keys;
  for (const JointTraits& traits : AllJointTraits()) {
    if (traits.parameter.key.empty()) continue;
    auto known = std::ranges::find(keys, traits.parameter.key,
                                   [](const ParameterKey& other) { return other.parameter.key; });
    if (known == keys.end()) known = keys.insert(keys.end(), {traits.parameter, {}});
    known->types.emplace_back(traits.name);
  }
  return keys;
}

void ReadParameter(const JsonNode& node, Joint& joint) {
  static const std::vector<ParameterKey> keys = ParameterKeys();
  const JointParameter& own = TraitsOf(joint.type).parameter;
  for (const ParameterKey& known : keys) {
    const std::string key(known.parameter.key);
    if (key == own.key) {
      const auto found = node.Required(key, own.meaning);
      joint.parameter = found ? found->Number(RangeOf(own)) : 1.0;
    } else if (const auto found = node.Optional(key)) {
      found->Fail(fmt::format("no {} on a {} joint", key, ToString(joint.type)));
    }
  }
}

using MotionFields = Fields<PrescribedMotion, const Joint, const Draft>;

void ReadCoordinate(const JsonNode& node, PrescribedMotion& motion, const Joint& joint,
                    const Draft& draft) {
  const int speeds = NumValues(joint.type, draft.space, true);
  motion.coordinate = static_cast<int>(node.Integer(0, speeds - 1));
  for (const PrescribedMotion& other : joint.motions) {
    if (other.coordinate == motion.coordinate) node.Fail("a coordinate not yet prescribed");
  }
}

Json WriteCoordinate(const PrescribedMotion& motion, const Joint&, const Draft&) {
  return motion.coordinate;
}

const MotionFields& FieldsOfMotion() {
  constexpr int kMaxCoordinates = 3;  // prescribable coordinates of a planar joint
  static const MotionFields fields(
      "motion", "Prescribed motion of one coordinate of a joint.",
      {{"coordinate", By(IntegerSchema(0, kMaxCoordinates - 1), ReadCoordinate, WriteCoordinate),
        "Index in the initial coordinates, from 0.", "the number of a coordinate"},
       {"value", TimeFunctionOf<PrescribedMotion>(&PrescribedMotion::value), "Value [rad or m].",
        "a number or a function of time"}});
  return fields;
}

/// Reads one function for a joint with one coordinate, otherwise a list with coordinates.
void ReadMotions(const JsonNode& node, Joint& joint, const Draft& draft) {
  const int speeds = NumValues(joint.type, draft.space, true);
  if (speeds == 0 || NumValues(joint.type, draft.space, false) != speeds) {
    node.FailAs(fmt::format("a motion of a {} joint", ToString(joint.type)),
                "a joint whose coordinates are angles and shifts");
    return;
  }
  if (!node.value().is_array()) {
    if (speeds > 1) {
      node.Fail(
          fmt::format("an array of {{\"coordinate\", \"value\"}}: a {} joint has {} coordinates",
                      ToString(joint.type), speeds));
      return;
    }
    joint.motions = {{0, ReadTimeFunction(node)}};
    return;
  }
  for (const JsonNode& element : node.Elements("motions", "at least one motion")) {
    PrescribedMotion motion{0, Polynomial{{0.0}}};
    FieldsOfMotion().Read(element, &motion, joint, draft);
    joint.motions.push_back(motion);
  }
}

Json WriteMotions(const Joint& joint, const Draft& draft) {
  Json motions = Json::array();
  for (const PrescribedMotion& motion : joint.motions) {
    motions.push_back(FieldsOfMotion().Write(motion, joint, draft));
  }
  const bool has_one = NumValues(joint.type, draft.space, true) == 1 && !motions.empty();
  return has_one ? WriteTimeFunction(joint.motions[0].value) : motions;
}

void ReadRotor(const JsonNode& node, Joint& joint, const Draft& draft) {
  joint.rotor_inertia = node.Number(kNotNegative);
  if (joint.rotor_inertia > 0.0 && NumValues(joint.type, draft.space, false) != 1) {
    node.FailAs(fmt::format("a rotor of a {} joint", ToString(joint.type)),
                "a joint with one coordinate (revolute, prismatic or helical)");
  }
}

Json WriteRotor(const Joint& joint, const Draft&) {
  return joint.rotor_inertia > 0.0 ? Json(joint.rotor_inertia) : Json();
}

bool IsMissingInPlane(const Joint& joint, const Draft& draft) {
  return draft.space == SpaceKind::kPlanar && !TraitsOf(joint.type).in_plane;
}

void ReadType(const JsonNode& node, Joint& joint, const Draft& draft) {
  joint.type = static_cast<JointType>(node.Choice(JointTypeNames(), "a joint type").value_or(0));
  if (IsMissingInPlane(joint, draft)) node.FailWithCure(kSpatialCure, "a joint of the plane");
}

Json WriteType(const Joint& joint, const Draft&) { return std::string(ToString(joint.type)); }

void CheckSides(const JsonNode& node, Joint& joint, const Draft& draft) {
  if (joint.from.body < 0 || joint.from.body != joint.to.body) return;
  node.FailAs(fmt::format("a joint of \"{}\" with itself", draft.bodies[joint.from.body].name),
              "two different bodies");
}

/// Adds parameters that some joint types require and others do not allow, with their rule.
void AddParameters(std::vector<PartField<Joint>>* rows) {
  Json rules = Json::array();
  for (const auto& [parameter, types] : ParameterKeys()) {
    const std::string key(parameter.key);
    const auto write = [key](const Joint& joint) {
      return TraitsOf(joint.type).parameter.key == key ? Json(joint.parameter) : Json();
    };
    rows->push_back(
        {key, FieldValue<Joint>(NumberSchema(RangeOf(parameter)), nullptr, nullptr, write),
         fmt::format("For a {} joint: {}.", fmt::join(types, " or "), parameter.meaning)});
    rules.push_back({{"if", {{"properties", {{"type", ChoiceSchema(types)}}}}},
                     {"then", Requires({key})},
                     {"else", {{"not", Requires({key})}}}});
  }
  rows->push_back({"", By({{"allOf", rules}}, ReadParameter)});
}

PartFields<Joint> MakeJointFields() {
  const Json motions =
      EitherSchema({TimeFunctionSchema(), ArraySchema(FieldsOfMotion().Schema(), 1)});
  std::vector<PartField<Joint>> rows = {
      {"name", NewName(&Joint::name, &Draft::joint_names), "Unique name of the joint.", "a name"},
      {"type", By(ChoiceSchema(JointTypeNames().all()), ReadType, WriteType), "Type of the joint.",
       "a joint type", IsMissingInPlane},
      {"from", Object(&Joint::from, SideFields()), "Frame F of the joint.",
       "an object with keys \"body\", \"at\", \"rotation\""},
      {"to", Object(&Joint::to, SideFields()), "Frame M of the joint.",
       "an object with keys \"body\", \"at\", \"rotation\""},
      {"", By(Json::object(), CheckSides)},
      {"axis", By(AxisSchema(), ReadAxis, WriteAxis),
       "Axis, not zero. Default: x for prismatic, pin-in-slot and point-on-line joints, otherwise "
       "z."}};
  AddParameters(&rows);
  rows.push_back({"motion", By(motions, ReadMotions, WriteMotions),
                  "Prescribed coordinates as functions of time [rad or m]: one function for a "
                  "joint with one coordinate, otherwise a list."});
  rows.push_back({"rotor_inertia", By(NumberSchema(kNotNegative), ReadRotor, WriteRotor),
                  "Inertia of a rotor along the joint's one coordinate, times the square of its "
                  "gear ratio [kg m^2, or kg]; default: 0."});
  rows.push_back({"cut", Bool(&Joint::cut),
                  "If true, the joint closes its loop and has no joint coordinate."});
  return {"joint", "Joint between frame F on one body and frame M on another.", std::move(rows)};
}

const PartFields<Joint>& JointFields() {
  static const PartFields<Joint> fields = MakeJointFields();
  return fields;
}

// "couplings" of a mechanism file.

using Coupling = CouplingDescription;

/// Limits of the sizes of coefficients: their squares must not overflow or vanish.
constexpr double kSmallestRatio = 1e-100, kLargestRatio = 1e100;

/// Reads {"joint": coefficient, ...}; the reader of files rejects a joint that appears twice.
void ReadCoefficients(const JsonNode& node, Coupling& coupling, const Draft& draft) {
  if (!node.ExpectObject(draft.joint_names)) return;
  bool all_driven = true;
  for (const auto& [name, value] : node.Members()) {
    const double ratio = value.Number();
    const bool is_usable = std::abs(ratio) > kSmallestRatio && std::abs(ratio) < kLargestRatio;
    if (!is_usable && value.value().is_number()) value.Fail("a size between 1e-100 and 1e100");
    const auto joint = draft.joint_names.Find(name);
    if (!joint) continue;
    const JointDescription& described = draft.joints[*joint];
    if (NumValues(described.type, draft.space, false) != 1) {
      value.FailAs(fmt::format("\"{}\" ({})", name, ToString(described.type)),
                   "a joint with one coordinate (revolute, prismatic or helical)");
    }
    all_driven = all_driven && !described.motions.empty();
    coupling.parts.push_back({*joint, ratio});
  }
  if (node.Members().size() < 2) {
    node.FailAs(node.Members().empty() ? "no joint" : "one joint", "two or more joints");
  } else if (all_driven) {
    node.FailAs("joints with prescribed motions only", "a joint without one");
  }
}

Json WriteCoefficients(const Coupling& coupling, const Draft& draft) {
  Json written = Json::object();
  for (const auto& [joint, ratio] : coupling.parts) {
    written[draft.joints[joint].name] = ratio;
  }
  return written;
}

const PartFields<Coupling>& CouplingFields() {
  Json ratio = NumberSchema();
  ratio["exclusiveMinimum"] = -kLargestRatio;
  ratio["exclusiveMaximum"] = kLargestRatio;
  ratio["not"] = {{"minimum", -kSmallestRatio}, {"maximum", kSmallestRatio}};
  Json coefficients = MapSchema(ratio);
  coefficients["minProperties"] = 2;
  static const PartFields<Coupling> fields(
      "coupling", "Linear relation of joint coordinates: sum of coefficient times q = offset.",
      {{"name", NewName(&Coupling::name, &Draft::coupling_names), "Unique name of the coupling.",
        "a name"},
       {"coefficients", By(coefficients, ReadCoefficients, WriteCoefficients),
        "Coefficients by joint: revolute, prismatic or helical joints, two or more.",
        "an object with a coefficient per joint"},
       {"offset", Number(&Coupling::offset),
        "Value of the sum [unit of coefficient times coordinate]."}});
  return fields;
}

}  // namespace

PartValue<Draft> GroundValue() { return Section(GroundFields()); }

PartValue<Draft> BodiesValue() {
  PartValue<Draft> bodies =
      PartList(&Draft::bodies, BodyFields(), &Draft::body_names, "bodies", "at least one body");
  bodies.write = [write = bodies.write](const Draft& draft, const Draft& all) {
    Json list = write(draft, all);
    list.erase(kGround);
    return list;
  };
  return bodies;
}

const NameList& JointTypeNames() {
  static const NameList kNames = [] {
    return Mapped<std::string>(AllJointTraits(), &JointTraits::name);
  }();
  return kNames;
}

PartValue<Draft> JointsValue() {
  JointDescription unread;
  unread.from.body = unread.to.body = -1;  // unknown: differs from every other side
  return PartList(&Draft::joints, JointFields(), &Draft::joint_names, "joints", "", unread);
}

PartValue<Draft> CouplingsValue() {
  PartValue<Draft> list =
      PartList(&Draft::couplings, CouplingFields(), &Draft::coupling_names, "couplings");
  list.read = [read = list.read](const JsonNode& node, Draft& draft, const Draft& all) {
    draft.coupling_names = draft.joint_names;  // records name both alike
    for (const CouplingDescription& known : draft.couplings) draft.coupling_names.Add(known.name);
    read(node, draft, all);
  };
  return list;
}

}  // namespace loopbench::harness
