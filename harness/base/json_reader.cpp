#include "harness/base/json_reader.h"

#include <cmath>
#include <set>

#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

constexpr std::size_t kLongestShown = 60;  ///< bytes of a value in a message
constexpr std::size_t kMaxListed = 32;     ///< names in a message

/// Returns the value as in the file, or its type if it is too long.
std::string Shown(const Json& value) {
  if (value.is_object()) return value.empty() ? "an empty object" : "an object";
  if (value.is_array() && value.empty()) return "an empty array";
  std::string text = CompactText(value);
  if (text.size() <= kLongestShown) return text;
  if (value.is_array()) return fmt::format("an array of {} values", value.size());
  return Abbreviated(text, kLongestShown);
}

using LineNumbers = std::map<std::string, std::size_t>;

/// Returns "FILE:LINE: POINTERtext (note)".
std::string Located(const Origins::Place& place, const LineNumbers& lines,
                    const std::string& text) {
  const auto line = lines.find(place.line_pointer);
  return fmt::format("{}{}: {}{}{}", place.file,
                     line == lines.end() ? "" : fmt::format(":{}", line->second),
                     Printable(ShownPointer(place.pointer)), text,
                     place.note.empty() ? "" : " (" + place.note + ")");
}

/// Returns "a", "b", "c" without empty names.
std::string Listed(const std::vector<std::string>& names) {
  std::vector<std::string> quoted;
  for (const std::string& name : names) {
    if (name.empty()) continue;
    if (quoted.size() == kMaxListed) {
      quoted.push_back("...");
      break;
    }
    quoted.push_back('"' + Abbreviated(name) + '"');
  }
  return quoted.empty() ? "there is none" : fmt::format("{}", fmt::join(quoted, ", "));
}

// Lists of numbers in a file: one, several, or a range.

/// Returns the short decimal number up to round-off: 1e-08 for 1.0000000000000002e-08.
double Clean(double value) {
  const std::string text = fmt::format("{:.13g}", value);
  double rounded = value;
  std::from_chars(text.data(), text.data() + text.size(), rounded);
  constexpr double kRoundOff = 1e-15;  // some ulps: of lerp, log10 and pow
  return std::abs(rounded - value) <= kRoundOff * std::abs(value) ? rounded : value;
}

std::vector<double> Spread(double from, double to, int count, bool logarithmic) {
  std::vector<double> numbers(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / (count - 1);
    numbers[i] = logarithmic ? std::copysign(std::pow(10.0, std::lerp(std::log10(std::abs(from)),
                                                                      std::log10(std::abs(to)), t)),
                                             from)
                             : std::lerp(from, to, t);
  }
  for (double& number : numbers) number = Clean(number);
  numbers.front() = from;
  numbers.back() = to;
  return numbers;
}

}  // namespace

void ErrorList::Add(std::string_view pointer, std::string_view found, std::string_view expected,
                    std::string_view suggestion) {
  if (full()) {
    ++more_;
    return;
  }
  std::string text = fmt::format("found {}, expected {}", found, expected);
  if (!suggestion.empty()) text += fmt::format(" (did you mean \"{}\"?)", suggestion);
  messages_.push_back({false, std::string(pointer), Printable(text)});
}

void ErrorList::AddWithCure(std::string_view cure, std::string_view pointer, std::string_view found,
                            std::string_view expected) {
  const auto first = std::ranges::find(messages_, cure, &Message::cure);
  if (first == messages_.end()) {
    const bool room = !full();
    Add(pointer, found, fmt::format("{}, or {}", expected, cure));
    if (room) messages_.back().cure = cure;
    return;
  }
  constexpr std::size_t kMaxPlaces = 3;
  if (first->also.size() < kMaxPlaces) first->also.push_back(ShownPointer(std::string(pointer)));
  ++first->others;
}

void ErrorList::AddText(const std::string& text) {
  const bool again = std::any_of(messages_.begin(), messages_.end(), [&text](const Message& known) {
    return known.finished && known.text == text;
  });
  if (!again) messages_.push_back({true, "", text});
}

std::string ErrorList::PlaceOf(const std::string& pointer) const {
  const Origins::Place place = origins_.Find(pointer);
  const auto lines = place.text.empty() ? LineNumbers() : LinesOf(place.text, {place.line_pointer});
  return Located(place, lines, "");
}

void ErrorList::ThrowIfAny(const std::string& ending) const {
  if (messages_.empty()) return;
  // one pass through each text for all its lines
  std::map<std::string_view, std::vector<std::string>> wanted;
  std::vector<Origins::Place> places;
  for (const Message& message : messages_) {
    places.push_back(origins_.Find(message.pointer));
    if (!message.finished) wanted[places.back().text].push_back(places.back().line_pointer);
  }
  std::map<std::string_view, LineNumbers> lines;
  for (const auto& [text, pointers] : wanted) {
    if (!text.empty()) lines[text] = LinesOf(text, pointers);
  }
  std::vector<std::string> all;
  for (std::size_t i = 0; i < messages_.size(); ++i) {
    const Message& message = messages_[i];
    all.push_back(message.finished
                      ? message.text
                      : Located(places[i], lines[places[i].text], ": " + message.text));
    if (message.others > 0) {
      all.back() += fmt::format("; the same cure for {} more: {}{}", message.others,
                                Printable(fmt::format("{}", fmt::join(message.also, ", "))),
                                message.others > message.also.size() ? ", ..." : "");
    }
  }
  if (more_ > 0) all.push_back(fmt::format("{}: and {} more", origins_.Find("").file, more_));
  if (!ending.empty()) all.push_back(ending);
  throw ConfigError(fmt::format("{}", fmt::join(all, "\n")));
}

std::string Range::Text() const {
  if (std::isfinite(min) && std::isfinite(max)) {
    return fmt::format(" {} {}{} and <= {}", above_min ? ">" : ">=", min, why, max);
  }
  if (std::isfinite(min)) return fmt::format(" {} {}", above_min ? ">" : ">=", min);
  return std::isfinite(max) ? fmt::format(" <= {}", max) : "";
}

void JsonNode::Fail(std::string_view expected, std::string_view suggestion) const {
  FailAs(errors_->full() ? "" : Shown(*value_), expected, suggestion);
}

void JsonNode::FailWithCure(std::string_view cure, std::string_view expected) const {
  errors_->AddWithCure(cure, pointer_, errors_->full() ? "" : Shown(*value_), expected);
}

void JsonNode::FailAs(std::string_view found, std::string_view expected,
                      std::string_view suggestion) const {
  errors_->Add(pointer_, found, expected, suggestion);
}

JsonNode JsonNode::Child(const Json& value, std::string_view token) const {
  return JsonNode(value, pointer_ + "/" + PointerToken(token), *errors_);
}

bool JsonNode::ExpectObject(const NameList& known) const {
  if (!value_->is_object()) {
    Fail("an object with keys " + Listed(known.all()));
    return false;
  }
  for (const auto& [key, value] : value_->items()) {
    if (known.Find(key)) continue;
    // beyond the limit of messages, suggestions are not needed
    if (errors_->full()) {
      Child(value, key).FailAs("", "");
      continue;
    }
    Child(value, key)
        .FailAs(fmt::format("unknown key \"{}\"", Abbreviated(key)),
                "one of " + Listed(known.all()), NearestSpelling(key, known.all()));
  }
  return true;
}

std::optional<JsonNode> JsonNode::Optional(const std::string& key) const {
  if (!value_->is_object()) return std::nullopt;
  const auto found = value_->find(key);
  if (found == value_->end()) return std::nullopt;
  return Child(*found, key);
}

std::optional<JsonNode> JsonNode::Required(const std::string& key,
                                           std::string_view expected) const {
  std::optional<JsonNode> member = Optional(key);
  if (!member && value_->is_object()) FailAs(fmt::format("no \"{}\"", key), expected);
  return member;
}

std::vector<std::pair<std::string, JsonNode>> JsonNode::Members() const {
  std::vector<std::pair<std::string, JsonNode>> members;
  if (!value_->is_object()) {
    Fail("an object");
    return members;
  }
  for (const auto& [key, value] : value_->items()) members.emplace_back(key, Child(value, key));
  return members;
}

std::vector<JsonNode> JsonNode::Elements(std::string_view what, std::string_view least) const {
  std::vector<JsonNode> elements;
  if (!value_->is_array()) {
    Fail(fmt::format("an array of {}", what));
    return elements;
  }
  if (!least.empty() && value_->empty()) Fail(least);
  for (std::size_t i = 0; i < value_->size(); ++i) {
    elements.push_back(Child((*value_)[i], std::to_string(i)));
  }
  return elements;
}

std::vector<JsonNode> JsonNode::OneOrMore(std::string_view what) const {
  if (!value_->is_array()) return {*this};
  if (value_->empty()) Fail("an array that is not empty");
  return Elements(what);
}

double JsonNode::Number(const Range& range) const {
  if (value_->is_number() && range.Contains(value_->get<double>())) return value_->get<double>();
  Fail("a number" + range.Text());
  return 0.0;
}

std::int64_t JsonNode::Integer(std::int64_t min, std::int64_t max) const {
  // Through double for the comparison: get<int64_t> would cut 2.7 and wrap values beyond 2^63.
  if (value_->is_number()) {
    const double number = value_->get<double>();
    const bool inside = number >= static_cast<double>(min) && number <= static_cast<double>(max);
    if (inside && number == std::floor(number)) return value_->get<std::int64_t>();
  }
  Fail(fmt::format("an integer from {} to {}", min, max));
  return min;
}

bool JsonNode::Bool() const {
  if (value_->is_boolean()) return value_->get<bool>();
  Fail("true or false");
  return false;
}

std::string JsonNode::Text() const {
  if (value_->is_string() && !value_->get_ref<const std::string&>().empty()) {
    return value_->get<std::string>();
  }
  Fail("a string that is not empty");
  return "";
}

Eigen::Vector3d JsonNode::Vector() const {
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();
  if (!value_->is_array() || value_->size() < 2 || value_->size() > 3) {
    Fail("an array of 2 or 3 numbers");
    return vector;
  }
  const std::vector<double> numbers = Numbers(value_->size());
  for (std::size_t i = 0; i < numbers.size(); ++i) vector[static_cast<int>(i)] = numbers[i];
  return vector;
}

std::vector<double> JsonNode::Numbers(std::size_t count) const {
  std::vector<double> numbers;
  if (!value_->is_array() || value_->size() != count) {
    Fail("an array of " + WithCount(count, "number"));
    return std::vector<double>(count, 0.0);
  }
  for (const JsonNode& element : Elements("numbers")) numbers.push_back(element.Number());
  return numbers;
}

std::optional<int> JsonNode::Choice(const NameList& known, std::string_view what) const {
  if (value_->is_string()) {
    if (const auto found = known.Find(value_->get_ref<const std::string&>())) return found;
  }
  if (errors_->full()) {
    FailAs("", "");
    return std::nullopt;
  }
  Fail(fmt::format("{}: {}", what, Listed(known.all())),
       value_->is_string() ? NearestSpelling(value_->get_ref<const std::string&>(), known.all())
                           : "");
  return std::nullopt;
}

std::vector<std::size_t> JsonNode::Choices(const NameList& known, std::string_view what) const {
  std::vector<std::size_t> indices;
  for (const JsonNode& element : OneOrMore("names")) {
    const auto choice = element.Choice(known, what);
    if (!choice) continue;
    const auto index = static_cast<std::size_t>(*choice);
    if (std::ranges::find(indices, index) != indices.end()) {
      element.Fail("each value once");
    } else {
      indices.push_back(index);
    }
  }
  return indices;
}

std::vector<double> JsonNode::Spaced(const Range& range) const {
  if (!ExpectObject({"lin", "log"})) return {};
  const auto lin = Optional("lin"), log = Optional("log");
  if (lin.has_value() == log.has_value()) {
    if (lin || value_->empty()) {
      FailAs(lin ? "both \"lin\" and \"log\"" : "an empty object",
             "{\"lin\": [from, to, count]} or {\"log\": [from, to, count]}");
    }
    return {};
  }
  const JsonNode& ends = lin ? *lin : *log;
  if (!ends.value().is_array() || ends.value().size() != 3) {
    ends.Fail("an array of three numbers: from, to, count");
    return {};
  }
  const std::vector<JsonNode> three = ends.Elements("numbers");
  const double from = three[0].Number(range), to = three[1].Number(range);
  const auto count = static_cast<int>(three[2].Integer(2, kMaxInRange));
  if (!range.Contains(from) || !range.Contains(to)) return {};
  if (from == to) {
    ends.FailAs("a range that ends where it begins", "two different ends");
    return {};
  }
  if (log && !(from < 0.0 && to < 0.0) && !(from > 0.0 && to > 0.0)) {
    ends.FailAs(fmt::format("logarithms from {} to {}", from, to),
                "two ends of the same sign, neither of them 0");
    return {};
  }
  return Spread(from, to, count, log.has_value());
}

std::vector<double> JsonNode::NumberList(const Range& range) const {
  if (value_->is_object()) return Spaced(range);
  if (!value_->is_array() && !value_->is_number()) {
    Fail(
        fmt::format("a number{}, a list of such numbers, or a range: {{\"lin\" or \"log\": [from, "
                    "to, count]}}",
                    range.Text()));
    return {};
  }
  std::vector<double> numbers;
  std::set<double> known;
  for (const JsonNode& element : OneOrMore("numbers")) {
    const double number = element.Number(range);
    const bool again = !known.insert(number).second;
    if (again && range.Contains(number)) element.Fail("each value once");
    numbers.push_back(number);
  }
  return numbers;
}

std::vector<std::int64_t> JsonNode::IntegerList(std::int64_t min, std::int64_t max) const {
  std::vector<std::int64_t> integers;
  std::set<std::int64_t> known;
  if (value_->is_object()) {
    const Range range = {.min = static_cast<double>(min), .max = static_cast<double>(max)};
    for (const double number : Spaced(range)) {
      const std::int64_t integer = std::llround(number);
      if (!known.insert(integer).second) {
        FailAs(fmt::format("{} twice after rounding", integer), "a smaller count");
        break;
      }
      integers.push_back(integer);
    }
    return integers;
  }
  if (!value_->is_array() && !value_->is_number()) {
    Fail(
        fmt::format("an integer from {} to {}, a list of them, or a range: {{\"lin\" or \"log\": "
                    "[from, to, count]}}",
                    min, max));
    return {};
  }
  for (const JsonNode& element : OneOrMore("integers")) {
    const std::int64_t integer = element.Integer(min, max);
    const bool sound = element.value().is_number() &&
                       element.value().get<double>() == static_cast<double>(integer);
    if (known.insert(integer).second) {
      integers.push_back(integer);
    } else if (sound) {
      element.Fail("each value once");
    }
  }
  return integers;
}

}  // namespace loopbench::harness
