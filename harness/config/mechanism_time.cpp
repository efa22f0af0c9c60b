// Functions of time in a mechanism file.
#include <fmt/format.h>

#include "harness/config/mechanism_sections.h"

namespace loopbench::harness {
namespace {

/// An array with at least `least` numbers.
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
      "polynomial", "A polynomial in t.",
      {{"type", Constant<Polynomial>("polynomial"), "What it is.", "a function of time"},
       {"coefficients", Numbers(&Polynomial::coefficients, 1, kExpected), "Of 1, t, t^2, ...",
        kExpected}});
  return fields;
}

const Fields<Harmonic>& HarmonicFields() {
  static const Fields<Harmonic> fields(
      "harmonic", "mean + amplitude sin(omega t + phase)",
      {{"type", Constant<Harmonic>("harmonic"), "What it is.", "a function of time"},
       {"mean", Number(&Harmonic::mean), "About which it swings."},
       {"amplitude", Number(&Harmonic::amplitude), "Of the sine.", "a number"},
       {"omega", Number(&Harmonic::omega), "Angular frequency [rad/s].", "a number"},
       {"phase", Number(&Harmonic::phase), "At t = 0 [rad]."}});
  return fields;
}

/// Times ascend, and each has a value.
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
      "table", "Values at given times, and between them.",
      {{"type", Constant<TimeTable>("table"), "What it is.", "a function of time"},
       {"times", Numbers(&TimeTable::times, 2, kTimes), "Ascending [s].", kTimes},
       {"values", Numbers(&TimeTable::values, 2, kValues), "One per time.", kValues},
       {"interpolation",
        By(ChoiceSchema({"cubic", "linear"}), ReadInterpolation, WriteInterpolation),
        "Cubic, the default: a natural spline that goes on straight; linear: end values hold."},
       {"", By(Json::object(), CheckTable)}});
  return fields;
}

/// Of an object of one type.
template <class T>
TimeFunctionDescription ReadAs(const Fields<T>& fields, const JsonNode& node) {
  T function{};
  fields.Read(node, &function);
  return function;
}

Json Written(const Polynomial& function) {
  // a file says a constant as a number, and any other list of coefficients in full
  if (function.coefficients.size() == 1) return function.coefficients[0];
  return PolynomialFields().Write(function);
}
Json Written(const Harmonic& function) { return HarmonicFields().Write(function); }
Json Written(const TimeTable& function) { return TableFields().Write(function); }

}  // namespace

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
