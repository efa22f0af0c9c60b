// Sections of a mechanism: forces, and functions of time.

#include "harness/base/text.h"
#include "harness/config/mechanism_sections.h"

namespace loopbench::harness {
namespace {

using Force = ForceDescription;
using Rows = std::vector<PartField<Force>>;

/// Reads the joint of a force, which must have exactly one coordinate.
int ReadJoint(const JsonNode& node, const Draft& draft) {
  const auto index = ReadJointName(node, draft);
  if (!index) return 0;
  const JointDescription& found = draft.joints[*index];
  if (NumValues(found.type, draft.space, true) != 1) {
    node.FailAs(fmt::format("\"{}\" ({})", found.name, ToString(found.type)),
                "a joint with one coordinate (revolute, prismatic or helical)");
  }
  return *index;
}

Json WriteJoint(int joint, const Draft& draft) { return draft.joints[joint].name; }

constexpr const char* kPlaceOnBody =
    "Name of a point of the body, or coordinates in body axes [m]; default: the body's origin.";

/// Adds the body and point of a force on one body, without an enclosing object.
void AddPoint(Rows* rows) {
  const auto body = [](Force& force) -> int& { return PartsOf(force).points[0]->body; };
  const auto at = [](Force& force) -> Eigen::Vector3d& { return PartsOf(force).points[0]->at; };
  rows->push_back(
      {"body", BodyOf<Force>(body, false), "Name of a moving body.", "the name of a body"});
  rows->push_back({"at", PlaceOf<Force>(body, at), kPlaceOnBody});
}

const PartFields<BodyPoint>& EndFields() {
  static const PartFields<BodyPoint> fields(
      "end", "Point of a body.",
      {{"body", BodyOf<BodyPoint>(&BodyPoint::body, true), "Name of a body, or \"ground\".",
        "the name of a body or \"ground\""},
       {"at", PlaceOf<BodyPoint>(&BodyPoint::body, &BodyPoint::at), kPlaceOnBody}});
  return fields;
}

void CheckEnds(const JsonNode& node, Force& force, const Draft& draft) {
  const ForceParts parts = PartsOf(force);
  const int from = parts.points[0]->body, to = parts.points[1]->body;
  if (from < 0 || from != to) return;
  std::string name(parts.name);
  std::ranges::replace(name, '_', '-');
  node.FailAs(fmt::format("a {} of \"{}\" with itself", name, draft.bodies[from].name),
              "two different bodies");
}

void AddEnds(Rows* rows) {
  constexpr const char* kEnd = "an object with keys \"body\", \"at\"";
  const auto end = [](std::size_t i) {
    return Coded<Force>(
        [i](Force& force) -> BodyPoint& { return *PartsOf(force).points[i]; }, EndFields().Schema(),
        [](const JsonNode& node, const Draft& draft) {
          BodyPoint point{.body = -1};  // unknown
          EndFields().Read(node, &point, draft);
          return point;
        },
        [](const BodyPoint& point, const Draft& draft) { return EndFields().Write(point, draft); });
  };
  rows->push_back({"from", end(0), "First end point.", kEnd});
  rows->push_back({"to", end(1), "Second end point, on another body.", kEnd});
  rows->push_back({"", By(Json::object(), CheckEnds)});
}

/// Requires at least one of these keys; without them a force has no effect.
FieldValue<Force> OneOf(const std::vector<std::string>& keys) {
  std::vector<Json> required;
  for (const std::string& key : keys) required.push_back(Requires({key}));
  return {EitherSchema(required), [=](const JsonNode& node, Force&) {
            const auto has = [&](const std::string& key) { return node.value().contains(key); };
            if (std::ranges::any_of(keys, has)) return;
            node.FailAs(fmt::format("none of \"{}\"", fmt::join(keys, "\", \"")),
                        "at least one of them");
          }};
}

void AddVector(Rows* rows) {
  rows->push_back(
      {"force",
       Coded<Force>([](Force& force) -> Eigen::Vector3d& { return *PartsOf(force).force; },
                    VectorSchema(), ReadVector, WriteVector),
       "Force [N].", "an array of 2 or 3 numbers [N]"});
  static const NameList axes = {"ground", "body"};
  PartValue<Force> value = Coded<Force>(
      [](Force& force) -> bool& { return *PartsOf(force).in_body_axes; }, ChoiceSchema(axes.all()),
      [](const JsonNode& node, const Draft&) {
        return node.Choice(axes, "the axes of the force").value_or(0) == 1;
      },
      [](bool in_body_axes, const Draft&) {
        return in_body_axes ? Json(axes.all().back()) : Json();
      });
  value.show = [](const Force&) { return Json(axes.all().front()); };
  rows->push_back({"axes", value, "Axes of the force; body: the force turns with the body."});
}

void AddNumber(const ForceParts& parts, std::size_t i, Rows* rows) {
  const ForceNumber& number = parts.numbers[i];
  const Range range = number.any_sign ? Range{} : kNotNegative;
  const std::string_view of_angle = number.quantity.of_angle;
  const std::string_view of_length = number.quantity.of_length;
  std::string units = fmt::format("[{}]", of_angle);
  if (of_length != of_angle) units += fmt::format(" or [{}]", of_length);
  const double standard = *number.value;
  rows->push_back({std::string(number.key),
                   {NumberSchema(range),
                    [=](const JsonNode& node, Force& force, const Draft&) {
                      *PartsOf(force).numbers[i].value = node.Number(range);
                    },
                    [=](const Force&) { return Json(standard); },
                    [=](Force force, const Draft&) {
                      const ForceNumber written = PartsOf(force).numbers[i];
                      const bool may_lack = written.need != Need::kAlways;
                      return may_lack && *written.value == standard ? Json() : Json(*written.value);
                    }},
                   number.sentence.empty() ? units : fmt::format("{} {}.", number.sentence, units),
                   number.need == Need::kAlways ? "a number" + range.Text() : ""});
}

PartFields<Force> FieldsOf(Force kind) {
  const ForceParts parts = PartsOf(kind);
  Rows rows = {{"type", Constant<Force>(std::string(parts.name)), "Force type.", "a force type"}};
  if (parts.joint != nullptr) {
    const auto joint = [](Force& force) -> int& { return *PartsOf(force).joint; };
    rows.push_back({"joint", Coded<Force>(joint, TextSchema(), ReadJoint, WriteJoint),
                    "Revolute, prismatic or helical joint.", "the name of a joint"});
  }
  if (parts.points.size() == 1) AddPoint(&rows);
  if (parts.points.size() == 2) AddEnds(&rows);
  std::vector<std::string> one_of;
  for (const ForceNumber& number : parts.numbers) {
    if (number.need == Need::kOneOf) one_of.emplace_back(number.key);
  }
  if (!one_of.empty()) rows.push_back({"", OneOf(one_of)});
  if (parts.force != nullptr) AddVector(&rows);
  if (parts.value != nullptr) {
    const auto value = [](Force& force) -> TimeFunctionDescription& {
      return *PartsOf(force).value;
    };
    rows.push_back({"value", TimeFunctionOf<Force>(value),
                    "Moment [N m] or force [N] on the joint's second body.",
                    "a number or a function of time"});
  }
  for (std::size_t i = 0; i < parts.numbers.size(); ++i) AddNumber(parts, i, &rows);
  return {std::string(parts.name), std::string(parts.sentence), std::move(rows)};
}

/// Returns fields in the order of ForceKinds().
const std::vector<PartFields<Force>>& AllFields() {
  static const auto all = Mapped<PartFields<Force>>(ForceKinds(), FieldsOf);
  return all;
}

/// Returns the names of types, in the same order.
const NameList& TypesOfForces() {
  static const NameList names =
      Mapped<std::string>(ForceKinds(), [](Force kind) { return std::string(PartsOf(kind).name); });
  return names;
}

void ReadForces(const JsonNode& list, Draft& draft, const Draft& all) {
  for (const JsonNode& node : list.Elements("forces")) {
    draft.forces.emplace_back(JointTorque{});
    if (!node.value().is_object()) {
      node.Fail("an object that describes a force");
      continue;
    }
    const auto name = node.Required("type", "a force type");
    const auto type = name ? name->Choice(TypesOfForces(), "a force type") : std::nullopt;
    if (!type) continue;
    const auto kind = static_cast<std::size_t>(*type);
    Force& force = draft.forces.back() = ForceKinds()[kind];
    const std::vector<BodyPoint*> points = PartsOf(force).points;
    // ends are unknown: -1 differs from every body
    for (BodyPoint* end : points) end->body = points.size() > 1 ? -1 : end->body;
    AllFields()[kind].Read(node, &force, all);
  }
}

Json WriteForces(const Draft& draft, const Draft& all) {
  Json forces = Json::array();
  for (Force force : draft.forces) {
    const auto kind = TypesOfForces().Find(std::string(PartsOf(force).name)).value();
    forces.push_back(AllFields()[static_cast<std::size_t>(kind)].Write(force, all));
  }
  return forces;
}

// Functions of time in a mechanism file.

/// Returns an array with at least `least` numbers.
template <class T>
FieldValue<T> Numbers(std::vector<double> T::*member, std::size_t least, std::string expected) {
  return {ArraySchema(NumberSchema(), least),
          [=](const JsonNode& node, T& owner) {
            if (!node.value().is_array() || node.value().size() < least) {
              node.Fail(expected);
              return;
            }
            std::vector<double>& numbers = owner.*member;
            numbers.clear();
            for (const JsonNode& one : node.Elements("numbers")) numbers.push_back(one.Number());
          },
          nullptr, [=](const T& owner) { return Json(owner.*member); }};
}

const Fields<Polynomial>& PolynomialFields() {
  constexpr const char* kExpected = "an array of one or more numbers, constant first";
  static const Fields<Polynomial> fields(
      "polynomial", "Polynomial in time t [s].",
      {{"type", Constant<Polynomial>("polynomial"), "Function type.", "a function of time"},
       {"coefficients", Numbers(&Polynomial::coefficients, 1, kExpected),
        "Factors of 1, t, t^2, ...", kExpected}});
  return fields;
}

const Fields<Harmonic>& HarmonicFields() {
  static const Fields<Harmonic> fields(
      "harmonic", "Harmonic function mean + amplitude sin(omega t + phase).",
      {{"type", Constant<Harmonic>("harmonic"), "Function type.", "a function of time"},
       {"mean", Number(&Harmonic::mean), "Mean value."},
       {"amplitude", Number(&Harmonic::amplitude), "Amplitude of the sine.", "a number"},
       {"omega", Number(&Harmonic::omega), "Angular frequency [rad/s].", "a number"},
       {"phase", Number(&Harmonic::phase), "Phase at t = 0 [rad]."}});
  return fields;
}

/// Checks that times ascend and that each time has a value.
void CheckTable(const JsonNode& node, TimeTable& table) {
  if (table.times.empty() || table.values.empty()) return;
  const std::vector<JsonNode> times = node.Optional("times")->Elements("times");
  for (std::size_t i = 1; i < times.size(); ++i) {
    const bool numbers = times[i - 1].value().is_number() && times[i].value().is_number();
    if (!numbers || table.times[i] > table.times[i - 1]) continue;
    times[i].Fail(fmt::format("more than the time before it, {}", table.times[i - 1]));
  }
  if (table.values.size() != table.times.size()) {
    node.Optional("values")->FailAs(fmt::format("{} values", table.values.size()),
                                    fmt::format("{}, one per time", table.times.size()));
  }
}

void ReadInterpolation(const JsonNode& node, TimeTable& table) {
  table.cubic = node.Choice({"cubic", "linear"}, "an interpolation").value_or(0) == 0;
}

Json WriteInterpolation(const TimeTable& table) { return table.cubic ? Json() : Json("linear"); }

const Fields<TimeTable>& TableFields() {
  constexpr const char* kTimes = "an array of two or more numbers that ascend [s]";
  constexpr const char* kValues = "an array of two or more numbers";
  static const Fields<TimeTable> fields(
      "table", "Table of values at given times, with interpolation.",
      {{"type", Constant<TimeTable>("table"), "Function type.", "a function of time"},
       {"times", Numbers(&TimeTable::times, 2, kTimes), "Ascending times [s].", kTimes},
       {"values", Numbers(&TimeTable::values, 2, kValues), "One value per time.", kValues},
       {"interpolation",
        By(ChoiceSchema({"cubic", "linear"}), ReadInterpolation, WriteInterpolation),
        "cubic (default): natural spline, linear outside; linear: constant outside."},
       {"", By(Json::object(), CheckTable)}});
  return fields;
}

/// Reads an object of one type.
template <class T>
TimeFunctionDescription ReadAs(const Fields<T>& fields, const JsonNode& node) {
  T function{};
  fields.Read(node, &function);
  return function;
}

Json Written(const Polynomial& function) {
  // a constant is written as a number, other polynomials with all coefficients
  if (function.coefficients.size() == 1) return function.coefficients[0];
  return PolynomialFields().Write(function);
}
Json Written(const Harmonic& function) { return HarmonicFields().Write(function); }
Json Written(const TimeTable& function) { return TableFields().Write(function); }

}  // namespace

PartValue<Draft> ForcesValue() {
  const auto kinds = Mapped<Json>(AllFields(), &PartFields<Force>::Schema);
  return By(ArraySchema(Named("force", EitherSchema(kinds))), ReadForces, WriteForces);
}

Json WriteTimeFunction(const TimeFunctionDescription& function) {
  return std::visit([](const auto& one) { return Written(one); }, function);
}

Json TimeFunctionSchema() {
  return Named("timeFunction", EitherSchema({NumberSchema(), PolynomialFields().Schema(),
                                             HarmonicFields().Schema(), TableFields().Schema()}));
}

TimeFunctionDescription ReadTimeFunction(const JsonNode& node) {
  if (node.value().is_number()) return Polynomial{{node.Number()}};
  if (!node.value().is_object()) {
    node.Fail("a number, or an object that describes a function of time");
    return Polynomial{{0.0}};
  }
  const auto name = node.Required("type", "a function of time");
  if (!name) return Polynomial{{0.0}};
  const auto type = name->Choice({"polynomial", "harmonic", "table"}, "a function of time");
  if (type == 0) return ReadAs(PolynomialFields(), node);
  if (type == 1) return ReadAs(HarmonicFields(), node);
  if (type == 2) return ReadAs(TableFields(), node);
  return Polynomial{{0.0}};
}

}  // namespace loopbench::harness
