#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/base/text.h"
#include "harness/figures/figures.h"

namespace loopbench::harness {
namespace {

std::string PowerOfTen(int exponent) {
  constexpr const char* kDigits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string power = exponent < 0 ? "10⁻" : "10";
  for (const char digit : std::to_string(std::abs(exponent))) power += kDigits[digit - '0'];
  return power;
}

int ExponentOf(double value) { return static_cast<int>(std::floor(std::log10(std::abs(value)))); }

bool IsPlain(double value) {
  return value == 0.0 || (std::abs(value) >= 0.01 && std::abs(value) < 1e5);
}

double NiceStep(double least) {
  const double power = std::pow(10.0, ExponentOf(least));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= least * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

/// Returns multiples of one step, all with the same digits and power of ten.
std::vector<Tick> EvenTicks(double low, double high, int most) {
  const double step = NiceStep((high - low) / most);
  const double largest = std::max(std::abs(low), std::abs(high));
  const int power = IsPlain(largest) ? 0 : ExponentOf(largest);
  const int decimals = std::clamp(power - ExponentOf(step * (1.0 + 1e-9)), 0, 15);
  std::vector<Tick> ticks;
  const double first = std::ceil(low / step - 1e-9);
  for (int i = 0; i <= most && (first + i) * step <= high + 1e-9 * step; ++i) {
    const double at = (first + i) * step;
    std::string label = fmt::format("{:.{}f}", at / std::pow(10.0, power), decimals);
    if (first + i == 0.0) label = "0";
    if (power != 0 && first + i != 0.0) label += "·" + PowerOfTen(power);
    ticks.push_back({at, label});
  }
  return ticks;
}

/// Returns the longest part of an axis without a label, as a fraction of the axis.
double WidestGap(const Axis& axis, const std::vector<Tick>& ticks) {
  double widest = 0.0, last = 0.0;
  for (const Tick& tick : ticks) {
    if (tick.label.empty()) continue;
    widest = std::max(widest, axis.Place(tick.at) - last);
    last = axis.Place(tick.at);
  }
  return std::max(widest, 1.0 - last);
}

/// Returns ticks for a logarithmic axis with too few powers of ten: labels at some digits of each
/// decade, or evenly spaced ones. The choice with the shortest gaps is used.
std::vector<Tick> TicksBetweenDecades(const Axis& axis, int first, int last, int most) {
  constexpr std::string_view kDigits[] = {"123456789", "12357", "125", "13", "1"};
  std::vector<Tick> best = EvenTicks(axis.low, axis.high, most);
  for (const std::string_view labelled : kDigits) {
    std::vector<Tick> ticks;
    int labels = 0;
    for (int decade = first; decade <= last; ++decade) {
      for (int digit = 1; digit < 10; ++digit) {
        const double at = digit * std::pow(10.0, decade);
        if (at < axis.low * (1.0 - 1e-9) || at > axis.high * (1.0 + 1e-9)) continue;
        Tick& tick = ticks.emplace_back(Tick{at, ""});
        if (labelled.find(static_cast<char>('0' + digit)) == std::string_view::npos) continue;
        ++labels;
        tick.label =
            IsPlain(axis.high) ? fmt::format("{:.{}f}", at, std::max(0, -decade)) : NumberText(at);
      }
    }
    if (labels <= most && WidestGap(axis, ticks) < WidestGap(axis, best)) best = std::move(ticks);
  }
  return best;
}

}  // namespace

std::string NumberText(double value) {
  if (!std::isfinite(value) || IsPlain(value)) return fmt::format("{:.6g}", value);
  const std::string text = fmt::format("{:.5e}", value);
  const std::size_t e = text.find('e');
  std::string mantissa = text.substr(0, e);
  mantissa.erase(mantissa.find_last_not_of('0') + 1);
  if (mantissa.ends_with('.')) mantissa.pop_back();
  const std::string power = PowerOfTen(std::stoi(text.substr(e + 1)));
  if (mantissa == "1") return power;
  return mantissa == "-1" ? "-" + power : mantissa + "·" + power;
}

Axis AxisRange::WithMargin(double margin) const {
  if (low_ > high_)
    return {.low = logarithmic_ ? 0.1 : 0.0, .high = 1.0, .logarithmic = logarithmic_};
  if (logarithmic_) {
    const double extent = std::log(high_ / low_);
    const double room = std::max(margin * extent, extent < 0.2 ? 0.2 : 0.0);
    return {std::max(low_ * std::exp(-room), std::numeric_limits<double>::min()),
            std::min(high_ * std::exp(room), std::numeric_limits<double>::max()), true};
  }
  const double magnitude = std::max(std::abs(low_), std::abs(high_));
  const double least = magnitude > 0.0 ? 1e-3 * magnitude : 1.0;
  const double room = std::max(margin * (high_ - low_), high_ - low_ < least ? least : 0.0);
  return {low_ - room, high_ + room, false};
}

std::vector<Tick> Ticks(const Axis& axis, int most) {
  if (!axis.logarithmic) return EvenTicks(axis.low, axis.high, most);
  const int first = static_cast<int>(std::ceil(std::log10(axis.low) - 1e-9));
  const int last = static_cast<int>(std::floor(std::log10(axis.high) + 1e-9));
  if (last - first < 2) return TicksBetweenDecades(axis, first - 1, last, most);
  const int step = (last - first) / most + 1;
  std::vector<Tick> ticks;
  for (int decade = first - 1; decade <= last; ++decade) {
    const double at = std::pow(10.0, decade);
    if (decade >= first) ticks.push_back({at, decade % step == 0 ? PowerOfTen(decade) : ""});
    for (int digit = 2; step == 1 && digit < 10; ++digit) {
      if (digit * at >= axis.low && digit * at <= axis.high) ticks.push_back({digit * at, ""});
    }
  }
  return ticks;
}
namespace {

double DistanceToSegment(const Point& point, const Point& from, const Point& to) {
  const double dx = to.first - from.first, dy = to.second - from.second;
  const double length = dx * dx + dy * dy;
  const double along =
      length > 0.0
          ? std::clamp(
                ((point.first - from.first) * dx + (point.second - from.second) * dy) / length, 0.0,
                1.0)
          : 0.0;
  return std::hypot(point.first - from.first - along * dx, point.second - from.second - along * dy);
}

std::vector<Point> Placed(const PlotArea& area, std::span<const Point> points) {
  return Mapped<Point>(points, [&](const Point& point) { return area.Place(point); });
}

/// Width of a curve [pt], a third of a millimetre: closer features cannot be distinguished.
constexpr double kDrawnWidth = 1.0;

/// Returns true if all points lie on the line, or on its points; both are page positions.
bool LieOn(std::span<const Point> points, std::span<const Point> line, bool joined) {
  return std::ranges::all_of(points, [&](const Point& point) {
    auto at = std::ranges::lower_bound(line, point.first - kDrawnWidth, {}, &Point::first);
    if (at != line.begin()) --at;
    for (; at != line.end() && at->first <= point.first + kDrawnWidth; ++at) {
      const auto next = !joined || at + 1 == line.end() ? at : at + 1;
      if (DistanceToSegment(point, *at, *next) <= kDrawnWidth) return true;
    }
    return false;
  });
}

}  // namespace

std::vector<Point> Decimated(const PlotArea& area, std::span<const Point> points) {
  std::vector<Point> kept;
  for (std::size_t begin = 0; begin < points.size();) {
    const auto column = [&](std::size_t i) {
      return std::floor(3.0 * area.Place(points[i]).first / kDrawnWidth);
    };
    std::size_t end = begin + 1, low = begin, high = begin;
    for (; end < points.size() && column(end) == column(begin); ++end) {
      if (points[end].second < points[low].second) low = end;
      if (points[end].second > points[high].second) high = end;
    }
    std::size_t last = points.size();
    for (const std::size_t i : {begin, std::min(low, high), std::max(low, high), end - 1}) {
      if (i != last) kept.push_back(points[i]);
      last = i;
    }
    begin = end;
  }
  return kept;
}

bool Coincide(const PlotArea& area, std::span<const Point> one, std::span<const Point> other,
              bool joined) {
  if (one.empty() || other.empty()) return false;
  const std::vector<Point> a = Placed(area, one), b = Placed(area, other);
  return LieOn(a, b, joined) && LieOn(b, a, joined);
}

namespace {

std::vector<std::string> PartsOf(const std::string& label) {
  std::vector<std::string> parts;
  for (std::size_t from = 0; from <= label.size();) {
    const std::size_t end = std::min(label.find(", ", from), label.size());
    parts.push_back(label.substr(from, end - from));
    from = end + 2;
  }
  return parts;
}

/// Values of each property: {{"odca", "lagrange"}, {"joint"}} is "odca = lagrange, joint".
using Product = std::vector<std::vector<std::string>>;

/// Returns the only property in which both differ; their number if none or several differ.
std::size_t PlaceApart(const Product& one, const Product& other) {
  std::size_t place = one.size();
  if (one.size() != other.size()) return place;
  for (std::size_t i = 0; i < one.size(); ++i) {
    if (one[i] == other[i]) continue;
    if (place != one.size()) return one.size();
    place = i;
  }
  return place;
}

/// Returns the fewest products that contain exactly all `labels`.
std::vector<Product> ProductsOf(const std::vector<std::string>& labels) {
  std::vector<Product> products;
  for (const std::string& label : labels) {
    Product& product = products.emplace_back();
    for (const std::string& part : PartsOf(label)) product.push_back({part});
  }
  for (std::size_t i = 0; i < products.size();) {
    const auto other = std::find_if(
        products.begin() + static_cast<std::ptrdiff_t>(i) + 1, products.end(),
        [&](const Product& one) { return PlaceApart(products[i], one) < products[i].size(); });
    if (other == products.end()) {
      ++i;
      continue;
    }
    const std::size_t place = PlaceApart(products[i], *other);
    for (const std::string& value : (*other)[place]) products[i][place].push_back(value);
    products.erase(other);
    i = 0;
  }
  return products;
}

std::size_t NumberOfValues(const std::vector<std::string>& labels, std::size_t place) {
  std::set<std::string> values;
  for (const std::string& label : labels) {
    const std::vector<std::string> parts = PartsOf(label);
    if (place < parts.size()) values.insert(parts[place]);
  }
  return values.size();
}

}  // namespace

std::string LabelOfSeveral(const std::vector<std::string>& labels,
                           const std::vector<std::string>& all) {
  std::vector<std::string> products;
  for (const Product& product : ProductsOf(labels)) {
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < product.size(); ++i) {
      const bool is_any =
          i > 0 && product[i].size() > 1 && product[i].size() == NumberOfValues(all, i);
      texts.push_back(is_any ? "all" : Joined(product[i], " = "));
    }
    products.push_back(Joined(texts, ", "));
  }
  return Joined(products, " and ");
}

double HeightOfPanel(FigureSize size, std::size_t panels) {
  const double alone = size == FigureSize::kOneColumn ? 135.0 : 200.0;
  return panels == 1 ? alone : 0.7 * alone;
}

namespace {

/// Returns the points that the axes can show.
std::vector<Point> Drawable(const Axis& x, const Axis& y, const Curve& curve) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < std::min(curve.x.size(), curve.y.size()); ++i) {
    if (x.CanShow(curve.x[i]) && y.CanShow(curve.y[i])) points.emplace_back(curve.x[i], curve.y[i]);
  }
  return points;
}

}  // namespace

std::vector<Point> DrawnPoints(const PlotArea& area, const Curve& curve) {
  const std::vector<Point> all = Drawable(area.x, area.y, curve);
  return curve.line ? Decimated(area, all) : all;
}

PlotArea AreaOf(const Figure& panel, FigureSize size) {
  AxisRange x(panel.log_x), y(panel.log_y);
  const auto include = [&](const Point& point) {
    x.Include(point.first);
    y.Include(point.second);
  };
  for (const Curve& curve : panel.curves) {
    std::ranges::for_each(
        Drawable({.logarithmic = panel.log_x}, {.logarithmic = panel.log_y}, curve), include);
    if (curve.ends_early && !curve.x.empty()) x.Include(curve.x.back());
    std::ranges::for_each(curve.crosses, include);
  }
  const bool has_points = std::ranges::any_of(
      panel.curves, [](const Curve& curve) { return curve.points || !curve.crosses.empty(); });
  PlotArea area{.x = x.WithMargin(has_points ? 0.04 : 0.0),
                .y = y.WithMargin(has_points ? 0.08 : 0.04),
                .width = WidthOfPage(size) - 80.0,
                .height = HeightOfPanel(size, 1)};
  if (!panel.x_ticks.empty()) {
    area.x = {.low = 0.5, .high = static_cast<double>(panel.x_ticks.size()) + 0.5};
  }
  return area;
}

namespace {

bool MayMerge(const Curve& curve) {
  return curve.merges && !curve.label.empty() && !curve.ends_early;
}

/// Keeps the style of `one` where `other` has the same, else black, solid, unmarked.
void KeepCommon(const CurveStyle& other, CurveStyle* one) {
  const CurveStyle several;
  if (one->color != other.color) one->color = several.color;
  if (one->dash != other.dash) one->dash = several.dash;
  if (one->shape != other.shape) one->shape = several.shape;
  one->width = std::max(one->width, other.width);
}

}  // namespace

std::vector<Curve> MergedCurves(const Figure& panel, FigureSize size) {
  const PlotArea area = AreaOf(panel, size);
  struct Group {
    Curve curve;
    std::vector<Point> points;
    std::vector<std::string> labels;
  };
  std::vector<Group> groups;
  std::vector<Curve> failures;  // they keep the colour of their curves
  std::vector<std::string> all;
  for (Curve curve : panel.curves) {
    if (curve.merges && !curve.label.empty()) all.push_back(curve.label);
    const std::vector<Point> points = DrawnPoints(area, curve);
    const auto same = std::ranges::find_if(groups, [&](const Group& group) {
      return MayMerge(curve) && MayMerge(group.curve) && curve.line == group.curve.line &&
             curve.style.flagged == group.curve.style.flagged &&
             Coincide(area, points, group.points, curve.line);
    });
    if (same == groups.end()) {
      groups.push_back({curve, points, {curve.label}});
      continue;
    }
    Curve& merged = same->curve;
    AddOnce(same->labels, curve.label);
    for (Curve* one : {&merged, &curve}) {
      if (one->crosses.empty()) continue;
      failures.push_back({.style = one->style, .merges = false});
      failures.back().crosses.swap(one->crosses);
    }
    merged.hollow.insert(merged.hollow.end(), curve.hollow.begin(), curve.hollow.end());
    KeepCommon(curve.style, &merged.style);
    if (merged.remark.ends_with('?') && !curve.remark.ends_with('?')) {
      merged.remark = curve.remark;  // the resolved one
      merged.guide = curve.guide;
    }
  }
  std::vector<Curve> drawn;
  for (Group& group : groups) {
    group.curve.several = group.labels.size() > 1;
    if (group.curve.several) group.curve.label = LabelOfSeveral(group.labels, all);
    drawn.push_back(std::move(group.curve));
  }
  drawn.insert(drawn.end(), failures.begin(), failures.end());
  return drawn;
}

}  // namespace loopbench::harness
