#include "harness/view/svg_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "harness/view/svg.h"

namespace loopbench::harness {
namespace {

using Spots = std::vector<Spot>;

/// Colours of what is drawn; a line of `width` px.
struct Ink {
  const char* stroke;
  const char* fill;
  double width;
  const char* dash = "";
  const char* opacity = "1";
};

Ink InkOf(const PictureItem& item, ShapeStyle style) {
  const bool gone = !item.gone.empty();
  switch (style) {
    case ShapeStyle::kBody:
      return gone ? Ink{"#777", "#f4f4f4", 1.0, "4 2"} : Ink{"#222", "#cfdcea", 1.1};
    case ShapeStyle::kGround:
      return {"#444", "#e4e4e4", 0.9};
    case ShapeStyle::kJoint:
      return gone ? Ink{"#777", "#f4f4f4", 1.0, "2 2"} : Ink{"#111", "#fff", 1.3};
    case ShapeStyle::kSolid:
      return {"#111", "#222", 0.8};
    case ShapeStyle::kGuide:
      return {"#333", "#ececec", 1.0};
    case ShapeStyle::kRod:
      return {"#222", "#fff", 0.9};
    case ShapeStyle::kCentre:
      return {"#444", "#fff", 0.8};
    case ShapeStyle::kSpring:
      return {"#14532d", "none", 1.2};
    case ShapeStyle::kDamper:
      return {"#5b2a86", "none", 1.2};
    case ShapeStyle::kForce:
      return {"#9a3412", "#9a3412", 1.5};
    case ShapeStyle::kDrive:
      return {"#0b4f9e", "#0b4f9e", 1.8, "5 2"};
  }
  return {"#000", "none", 1.0};
}

std::string Decimal(double value) {
  std::string text = fmt::format("{:.2f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string PathOf(const Spots& spots, bool closed) {
  std::string path;
  for (const Spot& spot : spots) {
    path += fmt::format("{}{} {}", path.empty() ? "M" : "L", Decimal(spot.x), Decimal(spot.y));
  }
  return closed ? path + "Z" : path;
}

std::string Stroke(const Ink& ink) {
  return fmt::format(" stroke=\"{}\" stroke-width=\"{}\"{}", ink.stroke, Decimal(ink.width),
                     *ink.dash == '\0' ? "" : fmt::format(" stroke-dasharray=\"{}\"", ink.dash));
}

std::string Path(const std::string& d, const Ink& ink, bool filled) {
  const std::string_view opacity = ink.opacity;
  return fmt::format(
      "<path d=\"{}\" fill=\"{}\"{}{} stroke-linejoin=\"round\"/>\n", d, filled ? ink.fill : "none",
      opacity == "1" ? "" : fmt::format(" fill-opacity=\"{}\"", opacity), Stroke(ink));
}

/// A line as thick as two radii, round at its ends and with an outline; or a polygon widened so.
std::string Thick(const Spots& spots, bool closed, double radius, const Ink& ink) {
  const std::string d = PathOf(spots, closed);
  if (radius < 0.8) return Path(d, ink, closed);
  const auto stroked = [&](const char* colour, const char* fill, double width) {
    return fmt::format(
        "<path d=\"{}\" fill=\"{}\" stroke=\"{}\" stroke-width=\"{}\" "
        "stroke-linecap=\"round\" stroke-linejoin=\"round\"/>\n",
        d, closed ? fill : "none", colour, Decimal(width));
  };
  const double inner = std::max(0.5, 2.0 * radius - ink.width);
  return stroked(ink.stroke, ink.stroke, 2.0 * radius + ink.width) +
         stroked(ink.fill, ink.fill, inner);
}

/// Places along the way from a to b and to its left, both in px.
class Along {
 public:
  Along(const Spot& a, const Spot& b) : a_(a), length_(std::hypot(b.x - a.x, b.y - a.y)) {
    if (length_ > 0.0) cos_ = (b.x - a.x) / length_, sin_ = (b.y - a.y) / length_;
  }
  double length() const { return length_; }
  Spot At(double along, double left) const {
    return {a_.x + cos_ * along + sin_ * left, a_.y + sin_ * along - cos_ * left, 0.0};
  }

 private:
  Spot a_;
  double length_, cos_ = 1.0, sin_ = 0.0;
};

std::string Spring(const Spot& a, const Spot& b, double radius, double aside, const Ink& ink) {
  const Along way(a, b);
  const double lead = std::min(0.2 * way.length(), 2.0 * radius);
  const int coils = std::clamp(static_cast<int>((way.length() - 2 * lead) / (0.9 * radius)), 4, 24);
  Spots spots = {way.At(0, 0), way.At(0, aside), way.At(lead, aside)};
  for (int i = 0; i < coils; ++i) {
    spots.push_back(way.At(lead + (way.length() - 2 * lead) * (i + 0.5) / coils,
                           aside + (i % 2 == 0 ? radius : -radius)));
  }
  spots.insert(spots.end(), {way.At(way.length() - lead, aside), way.At(way.length(), aside),
                             way.At(way.length(), 0)});
  return Path(PathOf(spots, false), ink, false);
}

std::string Damper(const Spot& a, const Spot& b, double radius, double aside, const Ink& ink) {
  const Along way(a, b);
  const double middle = 0.5 * way.length(), cup = std::min(1.6 * radius, 0.3 * way.length());
  const auto line = [&](std::initializer_list<Spot> spots) {
    return Path(PathOf(spots, false), ink, false);
  };
  return line({way.At(0, 0), way.At(0, aside), way.At(middle - cup, aside)}) +
         line({way.At(middle + cup, aside + radius), way.At(middle - cup, aside + radius),
               way.At(middle - cup, aside - radius), way.At(middle + cup, aside - radius)}) +
         line({way.At(middle, aside + 0.7 * radius), way.At(middle, aside - 0.7 * radius)}) +
         line({way.At(middle, aside), way.At(way.length(), aside), way.At(way.length(), 0)});
}

std::string Arrow(const Spots& spots, double size, const Ink& ink) {
  const Spot& tip = spots.back();
  const Along way(spots[spots.size() - 2], tip);
  const double head = std::max(5.0, size);
  const Spots triangle = {tip, way.At(way.length() - head, 0.45 * head),
                          way.At(way.length() - head, -0.45 * head)};
  Ink plain = ink;
  plain.dash = "";
  return Path(PathOf(spots, false), ink, false) + Path(PathOf(triangle, true), plain, true);
}

std::string Disc(const Spot& c, double radius, const Ink& ink) {
  return fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"{}\"{}/>\n", Decimal(c.x),
                     Decimal(c.y), Decimal(radius), ink.fill, Stroke(ink));
}

/// A circle, two opposite quarters of it black.
std::string Centre(const Spot& c, double r, const Ink& ink) {
  const std::string x = Decimal(c.x), y = Decimal(c.y), left = Decimal(c.x - r),
                    right = Decimal(c.x + r), top = Decimal(c.y - r), bottom = Decimal(c.y + r),
                    radius = Decimal(r);
  return Disc(c, r, ink) +
         fmt::format(
             "<path d=\"M{0} {1}L{0} {2}A{3} {3} 0 0 1 {4} {1}ZM{0} {1}L{0} {5}A{3} {3} 0 "
             "0 1 {6} {1}Z\" fill=\"#222\"/>\n",
             x, y, top, radius, right, bottom, left);
}

}  // namespace

void SvgPen::Dot(const Spot& spot) {
  const long x = std::lround(spot.x), y = std::lround(spot.y);
  if (cells_.insert(y * 100000L + x).second) dots_ += fmt::format("M{} {}h1", x, y);
}

void SvgPen::Draw(const PictureShape& shape, const Poses& poses) {
  Spots spots;
  double left = 1e300, right = -1e300, top = 1e300, bottom = -1e300;
  for (const PicturePlace& place : shape.places) {
    const Spot& spot = spots.emplace_back(camera_.See(place.In(poses)));
    if (!std::isfinite(spot.x + spot.y)) return;
    left = std::min(left, spot.x), right = std::max(right, spot.x);
    top = std::min(top, spot.y), bottom = std::max(bottom, spot.y);
  }
  const double radius = shape.radius * camera_.scale, aside = shape.aside * camera_.scale;
  constexpr double kSeen = 0.8;
  if (std::max(right - left, bottom - top) + 2.0 * radius < kSeen) return Dot(spots.front());
  const PictureItem& item = picture_.items[static_cast<std::size_t>(shape.item)];
  Ink ink = InkOf(item, shape.style);
  // what is behind a plate in space shows through
  if (shape.style == ShapeStyle::kBody && !picture_.planar) ink.opacity = "0.8";
  switch (shape.kind) {
    case ShapeKind::kLine:
      text_ += Path(PathOf(spots, false), ink, false);
      break;
    case ShapeKind::kArea:
      text_ += Thick(spots, true, radius, ink);
      break;
    case ShapeKind::kBar:
      text_ += Thick(spots, false, radius, ink);
      break;
    case ShapeKind::kDisc:
      text_ += Disc(spots.front(), radius, ink);
      break;
    case ShapeKind::kCentre:
      text_ += Centre(spots.front(), radius, ink);
      break;
    case ShapeKind::kSpring:
      text_ += Spring(spots[0], spots[1], radius, aside, ink);
      break;
    case ShapeKind::kDamper:
      text_ += Damper(spots[0], spots[1], radius, aside, ink);
      break;
    case ShapeKind::kArrow:
      text_ += Arrow(spots, 1.3 * picture_.symbol * camera_.scale, ink);
      break;
  }
}

void SvgPen::DrawAll(const Poses& poses) {
  std::vector<double> depths;
  for (const PictureShape& shape : picture_.shapes) {
    double depth = 0.0;
    for (const PicturePlace& place : shape.places) depth += camera_.See(place.In(poses)).depth;
    depth /= static_cast<double>(shape.places.size());
    depths.push_back(depth + picture_.symbol * Lift(shape.style));
  }
  std::vector<std::size_t> order(depths.size());
  std::iota(order.begin(), order.end(), 0u);
  if (!picture_.planar) {
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return depths[i]; });
  }
  for (const std::size_t i : order) Draw(picture_.shapes[i], poses);
}

void SvgPen::DrawGhost(const Poses& poses) {
  constexpr std::size_t kMost = 2000;
  std::size_t drawn = 0;
  for (const PictureShape& shape : picture_.shapes) {
    const bool area = shape.kind == ShapeKind::kArea;
    const bool outline = (shape.style == ShapeStyle::kBody && shape.kind == ShapeKind::kBar) ||
                         (area && shape.style != ShapeStyle::kGround);
    if (!outline || ++drawn > kMost) continue;
    Spots spots;
    for (const PicturePlace& place : shape.places) spots.push_back(camera_.See(place.In(poses)));
    text_ +=
        Path(PathOf(spots, shape.kind == ShapeKind::kArea), {"#8a8a8a", "none", 1.0, "6 3"}, false);
  }
}

std::string SvgPen::Take() {
  if (!dots_.empty()) {
    text_ += fmt::format("<path d=\"{}\" stroke=\"#333\" stroke-width=\"1\"/>\n", dots_);
  }
  dots_.clear();
  return std::exchange(text_, "");
}

}  // namespace loopbench::harness
