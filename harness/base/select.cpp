#include <array>
#include <cmath>

#include "harness/base/record.h"
#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

bool Holds(const Record& record, const Condition& condition) {
  const Value* value = record.Find(condition.key);
  if (value == nullptr || std::holds_alternative<std::monostate>(*value)) return false;
  const bool numeric =
      std::holds_alternative<double>(*value) || std::holds_alternative<std::int64_t>(*value);
  const double number = record.Number(condition.key);
  if (numeric && std::isnan(number)) return false;
  const auto is = [&](const std::string& wanted) {
    return numeric ? WholeNumber<double>(wanted) == number : record.Text(condition.key) == wanted;
  };
  // ParseCondition() ensures that an order operator has one number
  const auto bound = [&] { return WholeNumber<double>(condition.values.front()).value(); };
  switch (condition.op) {
    case Operator::kEqual:
      return std::ranges::any_of(condition.values, is);
    case Operator::kUnequal:
      return std::ranges::none_of(condition.values, is);
    case Operator::kLess:
      return numeric && number < bound();
    case Operator::kAtMost:
      return numeric && number <= bound();
    case Operator::kGreater:
      return numeric && number > bound();
    case Operator::kAtLeast:
      return numeric && number >= bound();
  }
  return false;
}

constexpr std::array<std::string_view, 6> kOperators = {"=", "!=", "<", "<=", ">", ">="};

// Returns the longest operator at the beginning of `text`; nothing for a "!" alone.
std::optional<Operator> OperatorAt(std::string_view text) {
  std::optional<Operator> found;
  for (std::size_t i = 0; i < kOperators.size(); ++i) {
    const bool longer = !found || kOperators[i].size() > ToString(*found).size();
    if (text.starts_with(kOperators[i]) && longer) found = static_cast<Operator>(i);
  }
  return found;
}

void RequireOneNumber(std::string_view text, const Condition& condition) {
  if (condition.op == Operator::kEqual || condition.op == Operator::kUnequal) return;
  if (condition.values.size() > 1) {
    throw ConfigError(fmt::format("filter '{}': found {} values, expected one number behind {}",
                                  text, condition.values.size(), ToString(condition.op)));
  }
  const std::string& value = condition.values.front();
  const auto number = WholeNumber<double>(value);
  if (number && !std::isnan(*number)) return;
  throw ConfigError(fmt::format("filter '{}': found \"{}\", expected a number behind {}", text,
                                value, ToString(condition.op)));
}

// Returns -1, 0 or 1; NaN is larger than every number, so that the order is total.
int Compare(double a, double b) {
  if (std::isnan(a) || std::isnan(b)) return int{std::isnan(a)} - int{std::isnan(b)};
  return int{a > b} - int{a < b};
}

// Compares texts with numbers in natural order: chain-3 before chain-10.
int CompareNaturally(const std::string& a, const std::string& b) {
  const auto digits = [](const std::string& text, std::size_t from) {
    const std::size_t end = text.find_first_not_of("0123456789", from);
    return text.substr(from, std::min(end, text.size()) - from);
  };
  std::size_t i = 0;
  while (i < a.size() && i < b.size()) {
    const std::string one = digits(a, i), other = digits(b, i);
    if (one != other && !one.empty() && !other.empty()) {
      // by number of digits first: any length of number, no overflow
      if (one.size() != other.size()) return one.size() < other.size() ? -1 : 1;
      return one.compare(other);
    }
    if (a[i] != b[i]) break;
    i += std::max<std::size_t>(1, one.size());
  }
  return a.compare(b);
}

// Compares all keys of a case: a mechanism at two levels, the parameters of a sweep. For cases with
// equal keys, those of the command's first file come first.
int CompareKeys(const Record& a, const Record& b) {
  const auto ends = [](const Record& record, std::size_t i) {
    if (i == record.items().size()) return true;
    const std::string& key = record.items()[i].first;
    return key == "config_hash" || key == "case_id" || key == "outcome";
  };
  for (std::size_t i = 0; !ends(a, i) || !ends(b, i); ++i) {
    if (ends(a, i) || ends(b, i)) return ends(a, i) ? -1 : 1;
    const std::string &key = a.items()[i].first, &other = b.items()[i].first;
    if (const int order = key.compare(other)) return order;
    if (const int order = Compare(a.Number(key), b.Number(key))) return order;
    if (const int order = CompareNaturally(a.Text(key), b.Text(key))) return order;
  }
  return Compare(a.Number("experiment_index"), b.Number("experiment_index"));
}

bool ComesBefore(const Record& a, const Record& b) {
  if (const int order = CompareNaturally(a.Text("mechanism"), b.Text("mechanism"))) {
    return order < 0;
  }
  if (const int order = Compare(a.Number("horizon"), b.Number("horizon"))) return order < 0;
  for (const char* key : {"formulation", "coordinates", "solver"}) {
    if (const int order = a.Text(key).compare(b.Text(key))) return order < 0;
  }
  if (const int order = Compare(-a.Number("rtol"), -b.Number("rtol"))) return order < 0;
  if (const int order = Compare(-a.Number("step"), -b.Number("step"))) return order < 0;
  return CompareKeys(a, b) < 0;
}

// Value in the order of SortRowsBy(): 0 numbers, 1 texts, 2 missing values.
struct SortKey {
  int rank;
  double number;
  std::string text;
};

SortKey SortKeyOf(const Record& record, const std::string& key) {
  const double number = record.Number(key);
  if (!std::isnan(number)) return {0, number, ""};
  const Value* value = record.Find(key);
  if (value != nullptr && std::holds_alternative<std::string>(*value)) {
    return {1, 0.0, record.Text(key)};
  }
  return {2, 0.0, ""};
}

}  // namespace

std::string_view ToString(Operator op) { return kOperators[static_cast<std::size_t>(op)]; }

Condition ParseCondition(std::string_view text) {
  const std::size_t at = std::min(text.find_first_of("=!<>"), text.size());
  const auto op = OperatorAt(text.substr(at));
  const std::size_t behind = at + (op ? ToString(*op).size() : 0);
  if (!op || at == 0 || behind == text.size()) {
    throw ConfigError(fmt::format(
        "filter '{}': expected key=value, key=value,value, key!=value or key<number (<=, >, >=)",
        text));
  }
  Condition condition{std::string(text.substr(0, at)), {}, *op};
  std::string_view rest = text.substr(behind);
  for (;;) {
    const std::size_t comma = rest.find(',');
    condition.values.emplace_back(rest.substr(0, comma));
    if (comma == std::string_view::npos) break;
    rest.remove_prefix(comma + 1);
  }
  RequireOneNumber(text, condition);
  return condition;
}

bool Matches(const Record& record, const Selection& selection) {
  return std::ranges::all_of(selection,
                             [&](const Condition& condition) { return Holds(record, condition); });
}

std::vector<Record> Filter(std::span<const Record> records, const Selection& selection) {
  std::vector<Record> matching;
  std::ranges::copy_if(records, std::back_inserter(matching),
                       [&](const Record& record) { return Matches(record, selection); });
  return matching;
}

std::string ToText(const Selection& selection) {
  return Joined(selection, " ", [](const Condition& one) {
    return fmt::format("{}{}{}", one.key, ToString(one.op), fmt::join(one.values, ","));
  });
}

void SortRows(std::vector<Record>* records) { std::ranges::stable_sort(*records, ComesBefore); }

void SortRowsBy(std::vector<Record>* records, const std::string& key, bool descending) {
  std::ranges::stable_sort(*records, [&](const Record& a, const Record& b) {
    const SortKey one = SortKeyOf(a, key), other = SortKeyOf(b, key);
    if (one.rank != other.rank) return one.rank < other.rank;
    const int order =
        one.rank == 0 ? Compare(one.number, other.number) : CompareNaturally(one.text, other.text);
    return descending ? order > 0 : order < 0;
  });
}

}  // namespace loopbench::harness
