#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ranges>
#include <set>
#include <utility>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/figures/figures.h"
#include "harness/judge/analysis.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

std::vector<std::string> KeysIn(const std::string& list) {
  std::vector<std::string> parts;
  for (const auto part : std::views::split(list, ',')) {
    if (!part.empty()) parts.emplace_back(part.begin(), part.end());
  }
  return parts;
}

template <class T>
const T* FindAs(const Record& record, const std::string& key) {
  const Value* value = record.Find(key);
  return value == nullptr ? nullptr : std::get_if<T>(value);
}

std::string ValueText(const Record& record, const std::string& key) {
  const auto* number = FindAs<double>(record, key);
  return number == nullptr ? record.Text(key) : NumberText(*number);
}

bool IsEmpty(const Record& record, const std::string& key) {
  if (record.Find(key) == nullptr || FindAs<std::monostate>(record, key)) return true;
  const auto* number = FindAs<double>(record, key);
  return number != nullptr && std::isnan(*number);
}

bool IsSeries(const Record& record, const std::string& key) { return !record.Numbers(key).empty(); }

bool IsText(const Record& record, const std::string& key) {
  return FindAs<std::string>(record, key) != nullptr;
}

// Returns the participating records: with a value of x, and of the kinds that have y values.
std::vector<Record> Participants(std::span<const Record> records, const FreeFigure& wanted) {
  std::set<std::string> kinds;
  for (const Record& record : records) {
    if (IsEmpty(record, wanted.y) || IsEmpty(record, wanted.x)) continue;
    if (IsText(record, wanted.y)) {
      throw ConfigError(
          fmt::format("--y {}: found \"{}\", expected numbers", wanted.y, record.Text(wanted.y)));
    }
    if (IsSeries(record, wanted.x) != IsSeries(record, wanted.y)) {
      throw ConfigError(
          fmt::format("--x {} --y {}: found a series and a single value, expected two "
                      "series or two values",
                      wanted.x, wanted.y));
    }
    kinds.insert(record.Text("kind"));
  }
  if (kinds.empty()) {
    throw ConfigError(fmt::format("no record has values of both {} and {}", wanted.x, wanted.y));
  }
  std::vector<Record> rows;
  for (const Record& record : records) {
    if (!kinds.contains(record.Text("kind")) || IsEmpty(record, wanted.x)) continue;
    if (!IsEmpty(record, wanted.y) || HasFailed(record)) rows.push_back(record);
  }
  return rows;
}

std::string TitleOf(std::span<const Record> rows, const FreeFigure& wanted) {
  if (wanted.title) return *wanted.title;
  std::string common;
  for (const std::string key : kCaseKeys) {
    if (key == wanted.x || !IsAlike(rows, key) || rows[0].Text(key).empty()) continue;
    const bool is_text = IsText(rows[0], key);
    common += fmt::format("{}{}{}", common.empty() ? ": " : ", ", is_text ? "" : key + " ",
                          ValueText(rows[0], key));
    if (key == "horizon") common += " s";
  }
  return fmt::format("{} over {}{}", wanted.y, wanted.x, common);
}

/// Returns the texts of a key, sorted: the names of x = 1, 2, ...; none for numbers.
std::vector<std::string> TextsOf(std::span<const Record> rows, const std::string& key) {
  std::set<std::string> texts;
  for (const Record& row : rows) {
    if (IsText(row, key)) texts.insert(row.Text(key));
  }
  return {texts.begin(), texts.end()};
}

/// Returns true if all keys have a channel (figures.h), so that curves have their usual styles.
bool HaveChannels(const std::vector<std::string>& keys) {
  return !keys.empty() && std::ranges::all_of(keys, [](const std::string& key) {
    return Contains(kChannelKeys, key);
  });
}

Record Only(const std::vector<std::string>& keys, const Record& row) {
  Record shown;
  for (const std::string& key : keys) shown.Set(key, row.Text(key));
  return shown;
}

/// Returns the style of a run by those of these keys that have a channel, or of the index-th curve.
CurveStyle StyleBy(const std::vector<std::string>& keys, const Record& row, std::size_t index) {
  if (!HaveChannels(keys)) return DistinctStyle(index);
  CurveStyle style = StyleOf(Only(keys, row));
  if (!Contains(keys, "formulation")) style.color = "#000000";
  return style;
}

// Makes a curve; `rows` are in order of x.
Curve ValueCurve(const std::vector<Record>& rows, const FreeFigure& wanted,
                 const std::vector<std::string>& x_ticks, const std::string& label,
                 std::size_t index) {
  Curve curve{
      .label = label, .style = StyleBy(KeysIn(wanted.group), rows.front(), index), .points = true};
  for (const Record& row : rows) {
    const auto tick = std::ranges::find(x_ticks, row.Text(wanted.x)) - x_ticks.begin();
    const double x = x_ticks.empty() ? row.Number(wanted.x) : 1.0 + static_cast<double>(tick);
    if (HasFailed(row)) {
      curve.crosses.push_back({x, row.Number(wanted.y)});
    } else {
      curve.x.push_back(x);
      curve.y.push_back(row.Number(wanted.y));
      if (HasWarning(row)) curve.hollow.emplace_back(curve.x.back(), curve.y.back());
    }
  }
  return curve;
}

// Joins points by lines only if no curve has two of them at one x. Dashes and widths, which lines
// would show, then become colours and marks.
void JoinPoints(Figure& figure) {
  const bool joins =
      figure.x_ticks.empty() && std::ranges::none_of(figure.curves, [](const Curve& curve) {
        return curve.points && std::ranges::adjacent_find(curve.x) != curve.x.end();
      });
  std::set<std::pair<std::string, Shape>> seen;
  bool is_distinct = true;
  for (Curve& curve : figure.curves) {
    curve.line = joins || !curve.points;
    is_distinct &= curve.line || seen.emplace(curve.style.color, curve.style.shape).second;
  }
  if (is_distinct) return;
  figure.legend.clear();
  for (std::size_t i = 0; i < figure.curves.size(); ++i) figure.curves[i].style = DistinctStyle(i);
}

struct Range {
  double least_positive = INFINITY, largest = -INFINITY;
  bool all_positive = true;

  void Include(double value) {
    if (!std::isfinite(value)) return;
    largest = std::max(largest, value);
    if (value > 0) least_positive = std::min(least_positive, value);
    all_positive = all_positive && value > 0;
  }
  bool SpansDecades() const { return all_positive && largest >= 100 * least_positive; }
};

void ChooseScales(Figure& figure, const FreeFigure& wanted, bool is_series) {
  Range x, y;
  for (const Curve& curve : figure.curves) {
    // a series starts at t = 0 with zero drift, which must not prevent logarithmic axes
    for (const double value : curve.x) {
      if (!is_series || value > 0) x.Include(value);
    }
    for (const double value : curve.y) {
      if (!is_series || value != 0) y.Include(value);
    }
    for (const auto& [at, value] : curve.crosses) {
      x.Include(at);
      y.Include(value);
    }
  }
  const auto choose = [&](char axis, const Range& range) {
    if (wanted.log.empty()) return range.SpansDecades();
    if (wanted.log.find(axis) == std::string::npos) return false;
    if (range.largest > 0) return true;
    throw ConfigError(fmt::format("--log {}: no value of {} is positive", wanted.log,
                                  axis == 'x' ? wanted.x : wanted.y));
  };
  figure.log_x = figure.x_ticks.empty() && choose('x', x);
  figure.log_y = choose('y', y);
}

/// Splits curves at points that a logarithmic axis cannot show, and removes curves without others.
/// Returns the number of these points.
std::ptrdiff_t LeaveGaps(Figure& figure) {
  const Axis x{.logarithmic = figure.log_x}, y{.logarithmic = figure.log_y};
  std::ptrdiff_t omitted = 0;
  std::vector<Curve> parts;
  for (const Curve& curve : figure.curves) {
    Curve part = curve;
    part.x.clear();
    part.y.clear();
    const auto end_part = [&] {
      if (part.x.empty() && part.crosses.empty()) return;
      parts.push_back(part);
      part.label.clear();
      part.crosses.clear();
      part.x.clear();
      part.y.clear();
    };
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      if (x.CanShow(curve.x[i]) && y.CanShow(curve.y[i])) {
        part.x.push_back(curve.x[i]);
        part.y.push_back(curve.y[i]);
      } else {
        ++omitted;
        end_part();
      }
    }
    end_part();
  }
  figure.curves = std::move(parts);
  return omitted;
}

void Relabel(const FreeFigure& wanted, Figure* figure) {
  std::vector<std::pair<std::string, std::string*>> texts = {{wanted.x, &figure->x_label},
                                                             {wanted.y, &figure->y_label}};
  for (Curve& curve : figure->curves) texts.emplace_back(curve.label, &curve.label);
  for (LegendRow& row : figure->legend) {
    for (LegendItem& item : row) texts.emplace_back(item.text, &item.text);
  }
  for (const std::string& label : wanted.labels) {
    const std::size_t cut = std::min(label.find('='), label.size());
    const std::string name = label.substr(0, cut);
    bool found = false;
    for (const auto& [named, text] : texts) {
      if (cut == label.size() || name.empty() || named != name) continue;
      *text = label.substr(cut + 1);
      found = true;
    }
    if (!found) {
      throw ConfigError(fmt::format(
          "--label {}: expected NAME=TEXT, where NAME is {}, {} or the label of a curve", label,
          wanted.x, wanted.y));
    }
  }
}

std::vector<std::string> RemarksOn(std::span<const Record> rows, const Figure& figure,
                                   std::set<std::string> mixed) {
  std::vector<std::string> remarks;
  // a joined curve may include several tolerances; a cloud of points needs a choice
  const bool is_cloud = std::ranges::any_of(
      figure.curves, [](const Curve& curve) { return curve.points && !curve.line; });
  if (!is_cloud) {
    for (const char* key : {"rtol", "atol", "step"}) mixed.erase(key);
  }
  if (!mixed.empty()) {
    remarks.push_back(
        fmt::format("curves mix values of {}; --group KEY,KEY separates and "
                    "--where KEY=VALUE selects them",
                    fmt::join(mixed, ", ")));
  }
  const auto failed = std::ranges::count_if(rows, HasFailed);
  if (failed > 0) {
    remarks.push_back(fmt::format("{} of {} runs failed and {} drawn as {}", failed, rows.size(),
                                  failed == 1 ? "is" : "are", failed == 1 ? "a cross" : "crosses"));
  }
  const auto flagged =
      std::ranges::count_if(rows, [](const Record& row) { return HasWarning(row); });
  if (flagged > 0) {
    remarks.push_back(
        fmt::format("{} of {} runs finished with warnings (column warnings of "
                    "tables); their marks are hollow",
                    flagged, rows.size()));
  }
  return remarks;
}

}  // namespace

void RequireKeys(const FreeFigure& wanted, std::span<const Record> records) {
  RequireKey("--x", wanted.x, records);
  RequireKey("--y", wanted.y, records);
  for (const std::string& key : KeysIn(wanted.group)) RequireKey("--group", key, records);
}

FreeFigureResult MakeFreeFigure(std::span<const Record> records, const FreeFigure& wanted) {
  const std::vector<std::string> group_keys = KeysIn(wanted.group);
  RequireKeys(wanted, records);
  std::vector<Record> rows = Participants(records, wanted);
  SortRows(&rows);
  SortRowsBy(&rows, wanted.x, false);
  for (auto key = group_keys.rbegin(); key != group_keys.rend(); ++key) {
    SortRowsBy(&rows, *key, false);
  }
  const auto groups = GroupBy(rows, [&](const Record& row) { return ValuesOf(row, group_keys); });

  FreeFigureResult result;
  Figure& figure = result.figure;
  figure.title = TitleOf(rows, wanted);
  figure.x_label = ColumnOf(wanted.x, rows).header;
  figure.y_label = ColumnOf(wanted.y, rows).header;
  if (HaveChannels(group_keys) && groups.size() > kLegendRows) {
    figure.legend = ChannelLegend(Mapped<Record>(
        groups, [&](const auto& group) { return Only(group_keys, group.second.front()); }));
  }
  if (!group_keys.empty()) {
    figure.legend_title = fmt::format("curves by {}", fmt::join(group_keys, ", "));
  }
  figure.x_ticks = TextsOf(rows, wanted.x);
  const bool is_series = IsSeries(rows[0], wanted.x);
  std::vector<std::string> telling(kCaseKeys.begin(), kCaseKeys.end());
  std::ranges::copy(ParametersOf(rows), std::back_inserter(telling));
  std::set<std::string> mixed;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto& members = groups[g].second;
    const std::string label = Joined(
        group_keys, ", ", [&](const std::string& key) { return ValueText(members.front(), key); });
    for (std::size_t i = 0; is_series && i < members.size(); ++i) {
      CurveStyle style = StyleBy(group_keys, members[i], g);
      style.flagged = HasWarning(members[i]);
      figure.curves.push_back(
          CurveOverTime(members[i], wanted.x, wanted.y, i == 0 ? label : "", style));
    }
    if (!is_series) figure.curves.push_back(ValueCurve(members, wanted, figure.x_ticks, label, g));
    for (const std::string& key : telling) {
      if (key != wanted.x && key != wanted.y && !IsAlike(members, key)) mixed.insert(key);
    }
  }
  JoinPoints(figure);
  ChooseScales(figure, wanted, is_series);
  const std::ptrdiff_t omitted = is_series ? 0 : LeaveGaps(figure);
  Relabel(wanted, &figure);
  result.remarks = RemarksOn(rows, figure, mixed);
  if (omitted > 0) {
    result.remarks.push_back(
        fmt::format("{} of {} runs cannot be drawn on logarithmic axes: {} or {} is not positive",
                    omitted, rows.size(), wanted.x, wanted.y));
  }
  std::set<std::string> kinds;
  for (const Record& row : rows) kinds.insert(row.Text("kind"));
  const auto of_kind = std::ranges::count_if(
      records, [&](const Record& record) { return kinds.contains(record.Text("kind")); });
  if (const auto left_out = of_kind - std::ssize(rows); left_out > 0) {
    result.remarks.push_back(fmt::format("{} of {} runs are not drawn: no value of {} or {}",
                                         left_out, of_kind, wanted.x, wanted.y));
  }
  return result;
}

DistinctPoints::DistinctPoints(const FreeFigure& wanted, std::size_t most)
    : axes_{wanted.x, wanted.y}, group_(KeysIn(wanted.group)), most_(most) {
  keys_ = {"kind", "outcome", "warnings", wanted.x, wanted.y};
  keys_.insert(keys_.end(), group_.begin(), group_.end());
  keys_.insert(keys_.end(), kCaseKeys.begin(), kCaseKeys.end());
}

void DistinctPoints::Add(const Record& record) {
  ++seen_;
  Record slim;
  for (const auto& [key, value] : record.items()) {
    // keys without a measure are parameters, which labels and remarks contain
    if (!Contains(keys_, key) && FindMeasure(key)) continue;
    if (std::holds_alternative<std::vector<double>>(value)) {
      throw ConfigError(
          fmt::format("{}: found a series, expected single values of more than {} "
                      "records: choose some with --where",
                      key, most_));
    }
    slim.Set(key, value);
  }
  if (!cells_.insert(KeyOf(slim)).second) return;
  kept_.push_back(std::move(slim));
  while (kept_.size() > most_) Coarsen();
}

std::string DistinctPoints::CellOf(const Record& record, std::size_t axis) const {
  const double value = record.Number(axes_[axis]);
  if (!std::isfinite(value)) return record.Text(axes_[axis]);  // a text, or no value
  std::string cell;
  for (const Axis& scale : scales_[axis]) {
    const double part = scale.high > scale.low ? std::floor(scale.Place(value) * parts_) : 0.0;
    cell += fmt::format("{},", scale.CanShow(value) ? part : -1.0);
  }
  return cell;
}

std::string DistinctPoints::KeyOf(const Record& record) const {
  std::string key = fmt::format("{}{}|", HasFailed(record), HasWarning(record));
  for (const std::string& one : group_) key += record.Text(one) + "|";
  // while all records are kept, each has its own cell
  if (parts_ == 0) return key + std::to_string(seen_);
  return key + CellOf(record, 0) + "|" + CellOf(record, 1);
}

void DistinctPoints::Coarsen() {
  constexpr int kFinest = 4096;  // cells of an axis: finer than any screen
  parts_ = parts_ == 0 ? kFinest : parts_ / 2;
  if (parts_ == 0) {
    throw ConfigError(
        fmt::format("found more than {} curves, expected fewer: choose another --group", most_));
  }
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    for (const bool logarithmic : {false, true}) {
      AxisRange range(logarithmic);
      for (const Record& record : kept_) range.Include(record.Number(axes_[axis]));
      scales_[axis][logarithmic ? 1 : 0] = range.Exact();
    }
  }
  cells_.clear();
  std::erase_if(kept_, [this](const Record& one) { return !cells_.insert(KeyOf(one)).second; });
}

}  // namespace loopbench::harness
