#include "harness/config/published_series.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/base/fields.h"
#include "harness/config/file_schemas.h"
#include "mechanism/description/joint_type.h"

namespace loopbench::harness {
namespace {

/// Limit above any printed table; dense output is evaluated at each time.
constexpr std::size_t kMaxTimes = 10'000;

const NameList& Axes() {
  static const NameList axes({"x", "y", "z", "angle"});
  return axes;
}
constexpr int kAxisZ = 2, kTurning = 3;

/// A series while it is read.
struct SeriesDraft : PublishedSeries {
  std::string comment;
  const MechanismDescription* mechanism = nullptr;
};

using Quantity = PublishedQuantity;

void ReadTimes(const JsonNode& node, SeriesDraft& draft) {
  const std::vector<JsonNode> elements = node.Elements("times", "at least one time");
  if (elements.size() > kMaxTimes) {
    node.FailAs(fmt::format("{} times", elements.size()), fmt::format("at most {}", kMaxTimes));
    return;
  }
  for (const JsonNode& element : elements) {
    const double time = element.Number(kNotNegative);
    if (!draft.times.empty() && time <= draft.times.back()) {
      element.Fail(fmt::format("a time after {} s", draft.times.back()));
    }
    draft.times.push_back(time);
  }
}

void ReadValues(const JsonNode& node, Quantity& quantity, const SeriesDraft& series) {
  for (const JsonNode& element : node.Elements("values"))
    quantity.values.push_back(element.Number());
  const std::size_t wanted = series.times.size();
  if (!node.value().is_array() || wanted == 0 || quantity.values.size() == wanted) return;
  node.FailAs(fmt::format("{} values", quantity.values.size()),
              fmt::format("one for each of the {} times", wanted));
}

/// Returns the index of the name among `things` of the mechanism, or nothing.
template <class Things, class Name>
std::optional<int> Among(const JsonNode& node, const Things& things, Name name, std::size_t first,
                         const std::string& what) {
  NameList known;
  for (std::size_t i = first; i < things.size(); ++i) known.Add(things[i].*name);
  const auto found = node.Choice(known, what);
  return found ? std::optional<int>(*found + static_cast<int>(first)) : std::nullopt;
}

void ReadBody(const JsonNode& node, Quantity& quantity, const SeriesDraft& series) {
  quantity.body = node.Text();
  const MechanismDescription* mechanism = series.mechanism;
  if (mechanism == nullptr || quantity.body.empty()) return;
  const auto found = Among(node, mechanism->bodies, &BodyDescription::name, 1,
                           fmt::format("a body of mechanism \"{}\" that moves", mechanism->name));
  if (found) quantity.index = static_cast<std::size_t>(*found);
}

void ReadPoint(const JsonNode& node, Quantity& quantity, const SeriesDraft& series) {
  quantity.point = node.Text();
  if (series.mechanism == nullptr || quantity.index == 0) return;
  const BodyDescription& body = series.mechanism->bodies[quantity.index];
  NameList known;
  for (const auto& [name, at] : body.points) known.Add(name);
  if (node.Choice(known, fmt::format("a point of body \"{}\"", body.name))) {
    quantity.at = body.points.at(quantity.point);
  }
}

void ReadAxis(const JsonNode& node, Quantity& quantity, const SeriesDraft& series) {
  const auto found = node.Choice(Axes(), "an axis");
  if (!found) return;
  quantity.axis = Axes().all()[static_cast<std::size_t>(*found)];
  quantity.kind = *found == kTurning ? PublishedKind::kAngle : PublishedKind::kPoint;
  quantity.along = *found;
  const MechanismDescription* mechanism = series.mechanism;
  if (mechanism == nullptr) return;
  const bool in_plane = mechanism->space == SpaceKind::kPlanar;
  if (in_plane && *found == kAxisZ) node.Fail("x, y or angle: the mechanism is planar");
  if (!in_plane && *found == kTurning) node.Fail("x, y or z: the mechanism is spatial");
}

void ReadJoint(const JsonNode& node, Quantity& quantity, const SeriesDraft& series) {
  quantity.joint = node.Text();
  quantity.kind = PublishedKind::kJoint;
  const MechanismDescription* mechanism = series.mechanism;
  if (mechanism == nullptr || quantity.joint.empty()) return;
  const auto found = Among(node, mechanism->joints, &JointDescription::name, 0,
                           fmt::format("a joint of mechanism \"{}\"", mechanism->name));
  if (!found) return;
  quantity.index = static_cast<std::size_t>(*found);
  const JointType type = mechanism->joints[quantity.index].type;
  const std::size_t count = ValueWords(type, mechanism->space, false).size();
  if (count != 1) {
    node.FailAs(fmt::format("joint \"{}\" with {} coordinates", quantity.joint, count),
                "a joint with one, or points of its bodies");
  }
}

/// A body's point along an axis, a body's angle, or a joint.
void RequireOneThing(const JsonNode& node, Quantity& quantity) {
  const bool body = node.Optional("body").has_value(), joint = node.Optional("joint").has_value();
  const auto point = node.Optional("point"), axis = node.Optional("axis");
  if (body == joint) {
    node.FailAs(body ? "a body and a joint" : "neither a body nor a joint",
                "\"joint\", or \"body\" with its \"axis\"");
  } else if (joint && (point || axis)) {
    (point ? *point : *axis).Fail("none beside \"joint\"");
  } else if (body && !axis) {
    node.Required("axis", "x, y or z of a point, or angle");
  } else if (body && quantity.axis == "angle" && point) {
    point->Fail("none beside \"axis\": \"angle\": all points of a body turn alike");
  } else if (body && !quantity.axis.empty() && quantity.axis != "angle" && !point) {
    node.Required("point", "a named point of the body");
  }
}

Json OneThingSchema() {
  Json of_joint = Requires({"joint"}), turning = Requires({"body", "axis"});
  Json of_point = Requires({"body", "axis", "point"});
  of_joint["properties"] = {{"body", false}, {"point", false}, {"axis", false}};
  turning["properties"] = {{"joint", false}, {"point", false}, {"axis", {{"const", "angle"}}}};
  of_point["properties"] = {{"joint", false}, {"axis", {{"enum", {"x", "y", "z"}}}}};
  return {{"oneOf", {of_joint, turning, of_point}}};
}

const Fields<Quantity, const SeriesDraft>& QuantityFields() {
  static const Fields<Quantity, const SeriesDraft> fields(
      "quantity",
      "Values over time of a coordinate of a named point, of a planar body's angle, or of a "
      "joint.",
      {{"body", By(TextSchema(), ReadBody), "Name of a body of the mechanism, with axis."},
       {"point", By(TextSchema(), ReadPoint), "Name of a point of the body."},
       {"axis", By(ChoiceSchema(Axes().all()), ReadAxis),
        "Ground axis of the coordinate [m], or the angle of the body [rad]."},
       {"joint", By(TextSchema(), ReadJoint), "Name of a joint with one coordinate [rad or m]."},
       {"", By(OneThingSchema(), RequireOneThing)},
       {"speed", Bool(&Quantity::is_speed), "If true, the values are rates, per second."},
       {"values", By(ArraySchema(NumberSchema(), 1, kMaxTimes), ReadValues), "One per time.",
        "a list of numbers, one for each time"},
       {"uncertainty", Number(&Quantity::accuracy, kPositive),
        "Absolute uncertainty of every value, in the unit of the values: at least half a unit of "
        "the last printed digit.",
        "a number > 0 in the unit of the values"}});
  return fields;
}

void ReadQuantities(const JsonNode& node, SeriesDraft& draft) {
  for (const JsonNode& element : node.Elements("quantities", "at least one quantity")) {
    Quantity quantity;
    QuantityFields().Read(element, &quantity, draft);
    const auto same = [&](const PublishedQuantity& other) {
      return other.body == quantity.body && other.point == quantity.point &&
             other.axis == quantity.axis && other.joint == quantity.joint &&
             other.is_speed == quantity.is_speed;
    };
    if (std::ranges::any_of(draft.quantities, same)) {
      element.FailAs("the same quantity again", "each once");
    }
    draft.quantities.push_back(std::move(quantity));
  }
}

const Fields<SeriesDraft>& SeriesFileFields() {
  static const Fields<SeriesDraft> fields(
      "series",
      "Published data of a mechanism's motion, for \"reference\" in an experiment. The program "
      "also checks that times ascend, that each time has a value, and that the mechanism has the "
      "bodies, points and joints.",
      DocumentRows<SeriesDraft>(
          {{"name", Text(&SeriesDraft::name), "Name of the data, for tables.", "a name"},
           {"source", Text(&SeriesDraft::source), "Publication and origin of the values.",
            "where the numbers were published"},
           {"comment", Text(&SeriesDraft::comment), "Free text for readers."},
           {"times", By(ArraySchema(NumberSchema(kNotNegative), 1, kMaxTimes), ReadTimes),
            "Ascending times [s].", "a list of rising numbers >= 0 [s]"},
           {"quantities", By(ArraySchema(QuantityFields().Schema(), 1), ReadQuantities),
            "Quantities with values at these times.", "a list of quantities"}}));
  return fields;
}

}  // namespace

Json PublishedSeriesSchema() { return SeriesFileFields().OwnSchema(); }

std::size_t PublishedSeries::NumWithin(double horizon) const {
  return static_cast<std::size_t>(std::ranges::upper_bound(times, horizon) - times.begin());
}

PublishedSeries ReadPublishedSeries(const std::filesystem::path& path,
                                    const MechanismDescription* mechanism) {
  return ReadDocument(ReadTextFile(path), path.string(), [&](const JsonNode& root) {
    SeriesDraft draft;
    draft.mechanism = mechanism;
    if (ExpectDocument(root, FileKind::kSeries)) SeriesFileFields().ReadRows(root, &draft);
    draft.canonical = CompactText(root.value());
    return static_cast<PublishedSeries>(std::move(draft));
  });
}

}  // namespace loopbench::harness
