#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_set>
#include <utility>

#include "harness/base/text.h"
#include "harness/figures/view.h"

namespace loopbench::harness {
namespace {

using Eigen::Vector3d;

/// A point of the paper [px], y downwards, with its height towards the viewer [m].
struct ProjectedPoint {
  double x = 0.0, y = 0.0, depth = 0.0;
};

/// An orthographic projection keeps parallel links parallel and lengths comparable.
struct Camera {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  ///< rows: right, up, towards the viewer
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double scale = 1.0;                     ///< [px/m]
  double middle_x = 0.0, middle_y = 0.0;  ///< paper position of `centre` [px]

  ProjectedPoint See(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d v = R * (p - centre);
    return {middle_x + scale * v.x(), middle_y - scale * v.y(), v.z()};
  }
};

/// Returns a camera for paper of this `width`, as high as all points of `poses` require, within
/// limits, with a `margin` on each side. Sets `*height`. [px]
Camera FitTo(const Picture& picture, const std::vector<const Poses*>& poses,
             const Eigen::Matrix3d& R, double width, double margin, double* height) {
  Eigen::AlignedBox3d box;
  for (const PictureShape& shape : picture.shapes) {
    for (const PicturePlace& place : shape.places) {
      for (const Poses* one : poses) box.extend(R * place.In(*one));
    }
  }
  if (box.isEmpty()) box.extend(Vector3d::Zero());
  // half of a pin and of a bar
  const double around = 2.0 * picture.symbol;
  const Vector3d size = box.sizes() + Vector3d::Constant(2.0 * around);
  constexpr double kLowest = 90.0, kHighest = 560.0;
  const double across = width - 2.0 * margin;
  Camera camera{.R = R, .centre = R.transpose() * box.center()};
  camera.scale = std::min(across / size.x(), (kHighest - 2.0 * margin) / size.y());
  *height = std::max(kLowest, camera.scale * size.y() + 2.0 * margin);
  camera.middle_x = 0.5 * width;
  camera.middle_y = 0.5 * *height;
  return camera;
}

using ProjectedPoints = std::vector<ProjectedPoint>;

/// Colours of a shape, and the line width [px].
struct Ink {
  const char* stroke;
  const char* fill;
  double width;
  const char* dash = "";
  const char* opacity = "1";
};

Ink InkOf(const PictureItem& item, ShapeStyle style) {
  // in the order of ShapeStyle
  static constexpr Ink kInks[] = {
      {"#222", "#cfdcea", 1.1},    {"#444", "#e4e4e4", 0.9},          {"#111", "#fff", 1.3},
      {"#111", "#222", 0.8},       {"#333", "#ececec", 1.0},          {"#222", "#fff", 0.9},
      {"#444", "#fff", 0.8},       {"#14532d", "none", 1.2},          {"#5b2a86", "none", 1.2},
      {"#9a3412", "#9a3412", 1.5}, {"#0b4f9e", "#0b4f9e", 1.8, "5 2"}};
  const bool is_gone = !item.gone.empty();
  if (is_gone && style == ShapeStyle::kBody) return {"#777", "#f4f4f4", 1.0, "4 2"};
  if (is_gone && style == ShapeStyle::kJoint) return {"#777", "#f4f4f4", 1.0, "2 2"};
  return kInks[static_cast<std::size_t>(style)];
}

std::string Decimal(double value) {
  std::string text = fmt::format("{:.2f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string PathOf(const ProjectedPoints& spots, bool closed) {
  std::string path;
  for (const ProjectedPoint& spot : spots) {
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

/// Returns a line of width two radii with round ends and outline, or a polygon widened so.
std::string Thick(const ProjectedPoints& spots, bool closed, double radius, const Ink& ink) {
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

/// Points along the line from a to b and to its left, both in px.
class Along {
 public:
  Along(const ProjectedPoint& a, const ProjectedPoint& b)
      : a_(a), length_(std::hypot(b.x - a.x, b.y - a.y)) {
    if (length_ > 0.0) cos_ = (b.x - a.x) / length_, sin_ = (b.y - a.y) / length_;
  }
  double length() const { return length_; }
  ProjectedPoint At(double along, double left) const {
    return {a_.x + cos_ * along + sin_ * left, a_.y + sin_ * along - cos_ * left, 0.0};
  }

 private:
  ProjectedPoint a_;
  double length_, cos_ = 1.0, sin_ = 0.0;
};

std::string Spring(const ProjectedPoint& a, const ProjectedPoint& b, double radius, double aside,
                   const Ink& ink) {
  const Along way(a, b);
  const double lead = std::min(0.2 * way.length(), 2.0 * radius);
  const int coils = std::clamp(static_cast<int>((way.length() - 2 * lead) / (0.9 * radius)), 4, 24);
  ProjectedPoints spots = {way.At(0, 0), way.At(0, aside), way.At(lead, aside)};
  for (int i = 0; i < coils; ++i) {
    spots.push_back(way.At(lead + (way.length() - 2 * lead) * (i + 0.5) / coils,
                           aside + (i % 2 == 0 ? radius : -radius)));
  }
  spots.insert(spots.end(), {way.At(way.length() - lead, aside), way.At(way.length(), aside),
                             way.At(way.length(), 0)});
  return Path(PathOf(spots, false), ink, false);
}

std::string Damper(const ProjectedPoint& a, const ProjectedPoint& b, double radius, double aside,
                   const Ink& ink) {
  const Along way(a, b);
  const double middle = 0.5 * way.length(), cup = std::min(1.6 * radius, 0.3 * way.length());
  const auto line = [&](std::initializer_list<ProjectedPoint> spots) {
    return Path(PathOf(spots, false), ink, false);
  };
  return line({way.At(0, 0), way.At(0, aside), way.At(middle - cup, aside)}) +
         line({way.At(middle + cup, aside + radius), way.At(middle - cup, aside + radius),
               way.At(middle - cup, aside - radius), way.At(middle + cup, aside - radius)}) +
         line({way.At(middle, aside + 0.7 * radius), way.At(middle, aside - 0.7 * radius)}) +
         line({way.At(middle, aside), way.At(way.length(), aside), way.At(way.length(), 0)});
}

std::string Arrow(const ProjectedPoints& spots, double size, const Ink& ink) {
  const ProjectedPoint& tip = spots.back();
  const Along way(spots[spots.size() - 2], tip);
  const double head = std::max(5.0, size);
  const ProjectedPoints triangle = {tip, way.At(way.length() - head, 0.45 * head),
                                    way.At(way.length() - head, -0.45 * head)};
  Ink plain = ink;
  plain.dash = "";
  return Path(PathOf(spots, false), ink, false) + Path(PathOf(triangle, true), plain, true);
}

std::string Disc(const ProjectedPoint& c, double radius, const Ink& ink) {
  return fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"{}\"{}/>\n", Decimal(c.x),
                     Decimal(c.y), Decimal(radius), ink.fill, Stroke(ink));
}

/// Returns a circle with two opposite quarters black.
std::string Centre(const ProjectedPoint& c, double r, const Ink& ink) {
  const std::string x = Decimal(c.x), y = Decimal(c.y), left = Decimal(c.x - r),
                    right = Decimal(c.x + r), top = Decimal(c.y - r), bottom = Decimal(c.y + r),
                    radius = Decimal(r);
  return Disc(c, r, ink) +
         fmt::format(
             "<path d=\"M{0} {1}L{0} {2}A{3} {3} 0 0 1 {4} {1}ZM{0} {1}L{0} {5}A{3} {3} 0 "
             "0 1 {6} {1}Z\" fill=\"#222\"/>\n",
             x, y, top, radius, right, bottom, left);
}

/// Page of 160 mm at 96 px per inch; a font of 8 points.
constexpr double kWidth = 605.0, kMargin = 26.0, kFont = 10.7, kFooter = 52.0, kLine = 14.0;
constexpr const char* kFamily = "DejaVu Sans, Verdana, Arial, Helvetica, sans-serif";

/// Shortens long names, which would cover their parts.
std::string Shortened(const std::string& name, std::size_t most) {
  const std::string shown = EscapeTerminal(name);
  std::size_t characters = 0, bytes = 0;
  while (bytes < shown.size() && characters < most) {
    ++bytes;
    while (bytes < shown.size() && ContinuesCharacter(shown[bytes])) ++bytes;
    ++characters;
  }
  return bytes < shown.size() ? shown.substr(0, bytes) + "\u2026" : shown;
}

class Document {
 public:
  Document(const Picture& picture, const SvgOptions& options)
      : picture_(picture), options_(options) {}

  std::string Write() {
    const bool ghost = ShowsGhost();
    std::vector<const Poses*> seen = {&picture_.start};
    if (ghost) seen.push_back(&picture_.given);
    camera_ = FitTo(picture_, seen, ViewNamed(picture_, options_.view), kWidth, kMargin, &height_);
    if (ghost) DrawGhost();
    DrawShapes();
    // text comes last, so that nothing covers it
    if (!options_.plain) DrawRedundant();
    if (!options_.plain) DrawGaps();
    DrawNames();
    double bottom = height_;
    DrawFooter(bottom);
    bottom += kFooter;
    if (!options_.plain) {
      for (const std::string& line : Legend(ghost)) {
        Text(kMargin, bottom + kFont, line, "start", "#222");
        bottom += kLine;
      }
      bottom += 6.0;
    }
    const std::string title = EscapeXml(picture_.name);
    return fmt::format(
               "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
               "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"160mm\" height=\"{:.2f}mm\" "
               "viewBox=\"0 0 {} {:.1f}\" role=\"img\" aria-label=\"{}\" font-family=\"{}\" "
               "font-size=\"{}\">\n<title>{}</title>\n"
               "<rect width=\"{}\" height=\"{:.1f}\" fill=\"#fff\"/>\n",
               bottom * 160.0 / kWidth, kWidth, bottom, title, kFamily, kFont, title, kWidth,
               bottom) +
           body_ + "</svg>\n";
  }

 private:
  struct Box {
    double left, top, right, bottom;
    bool Meets(const Box& other) const {
      return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
    }
  };

  /// Draws dashed outlines of bodies and sliders as in the file.
  void DrawGhost() {
    constexpr std::size_t kMost = 2000;
    std::size_t drawn = 0;
    for (const PictureShape& shape : picture_.shapes) {
      const bool area = shape.kind == ShapeKind::kArea;
      const bool outline = (shape.style == ShapeStyle::kBody && shape.kind == ShapeKind::kBar) ||
                           (area && shape.style != ShapeStyle::kGround);
      if (!outline || ++drawn > kMost) continue;
      const auto spots = Mapped<ProjectedPoint>(shape.places, [&](const PicturePlace& place) {
        return camera_.See(place.In(picture_.given));
      });
      body_ += Path(PathOf(spots, area), {"#8a8a8a", "none", 1.0, "6 3"}, false);
    }
  }

  void DrawShapes() {
    std::vector<std::pair<double, const PictureShape*>> order;
    for (const PictureShape& shape : picture_.shapes) {
      double depth = 0.0;
      for (const PicturePlace& place : shape.places) {
        depth += camera_.See(place.In(picture_.start)).depth;
      }
      depth /= static_cast<double>(shape.places.size());
      order.emplace_back(depth + picture_.symbol * TraitsOf(shape.style).lift, &shape);
    }
    if (!picture_.planar) {
      std::ranges::stable_sort(order, {}, &std::pair<double, const PictureShape*>::first);
    }
    for (const auto& [depth, shape] : order) Draw(*shape);
    if (dots_.empty()) return;
    body_ += fmt::format("<path d=\"{}\" stroke=\"#333\" stroke-width=\"1\"/>\n", dots_);
  }

  /// Draws a shape, or a dot if it is too small to be visible.
  void Draw(const PictureShape& shape) {
    ProjectedPoints spots;
    double left = 1e300, right = -1e300, top = 1e300, bottom = -1e300;
    for (const PicturePlace& place : shape.places) {
      const ProjectedPoint& spot = spots.emplace_back(camera_.See(place.In(picture_.start)));
      if (!std::isfinite(spot.x + spot.y)) return;
      left = std::min(left, spot.x), right = std::max(right, spot.x);
      top = std::min(top, spot.y), bottom = std::max(bottom, spot.y);
    }
    const double radius = shape.radius * camera_.scale, aside = shape.aside * camera_.scale;
    constexpr double kSeen = 0.8;
    if (std::max(right - left, bottom - top) + 2.0 * radius < kSeen) return Dot(spots.front());
    const PictureItem& item = picture_.items[static_cast<std::size_t>(shape.item)];
    Ink ink = InkOf(item, shape.style);
    // in space, parts behind a plate show through
    if (shape.style == ShapeStyle::kBody && !picture_.planar) ink.opacity = "0.8";
    body_ += Drawn(shape.kind, spots, radius, aside, ink);
  }

  std::string Drawn(ShapeKind kind, const ProjectedPoints& spots, double radius, double aside,
                    const Ink& ink) const {
    switch (kind) {
      case ShapeKind::kArea:
        return Thick(spots, true, radius, ink);
      case ShapeKind::kBar:
        return Thick(spots, false, radius, ink);
      case ShapeKind::kDisc:
        return Disc(spots.front(), radius, ink);
      case ShapeKind::kCentre:
        return Centre(spots.front(), radius, ink);
      case ShapeKind::kSpring:
        return Spring(spots[0], spots[1], radius, aside, ink);
      case ShapeKind::kDamper:
        return Damper(spots[0], spots[1], radius, aside, ink);
      case ShapeKind::kArrow:
        return Arrow(spots, 1.3 * picture_.symbol * camera_.scale, ink);
      default:
        return Path(PathOf(spots, false), ink, false);
    }
  }

  /// Adds at most one dot per pixel: a picture of 10^5 shapes stays small.
  void Dot(const ProjectedPoint& spot) {
    const long x = std::lround(spot.x), y = std::lround(spot.y);
    if (cells_.insert(y * 100000L + x).second) dots_ += fmt::format("M{} {}h1", x, y);
  }

  ProjectedPoint SpotOf(const PictureItem& item) const {
    return camera_.See(item.anchor.In(picture_.start));
  }

  void Text(double x, double y, const std::string& text, const char* anchor, const char* colour) {
    body_ += fmt::format(
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"{}\" stroke=\"#fff\" "
        "stroke-width=\"2.5\" stroke-linejoin=\"round\" paint-order=\"stroke\">{}</text>\n",
        x, y, anchor, colour, EscapeXml(text));
  }

  /// Returns true if the assembly moved a part visibly, by more than a symbol's size.
  bool ShowsGhost() const {
    if (options_.plain || !picture_.assembled) return false;
    return std::ranges::any_of(picture_.items, [&](const PictureItem& item) {
      return (item.anchor.In(picture_.given) - item.anchor.In(picture_.start)).norm() >
             3.0 * picture_.symbol;
    });
  }

  /// Draws a dashed ring about joints with redundant constraints, and a line through the joints of
  /// their loops.
  void DrawRedundant() {
    for (const PictureLoop& loop : picture_.loops) {
      if (loop.redundant.empty()) continue;
      std::string path;
      for (const int joint : loop.joints) {
        const ProjectedPoint spot = SpotOf(picture_.items[picture_.ItemOfJoint(joint)]);
        path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", spot.x, spot.y);
      }
      body_ += fmt::format(
          "<path d=\"{}Z\" fill=\"none\" stroke=\"#e08a2e\" stroke-opacity=\"0.45\" "
          "stroke-width=\"4\" stroke-linejoin=\"round\"/>\n",
          path);
    }
    for (const PictureItem& item : picture_.items) {
      if (item.redundant.empty()) continue;
      const ProjectedPoint spot = SpotOf(item);
      body_ += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"none\" stroke=\"#b45309\" "
          "stroke-width=\"1.6\" stroke-dasharray=\"3 2\"/>\n",
          spot.x, spot.y, std::max(7.0, 2.4 * picture_.symbol * camera_.scale));
    }
  }

  void DrawGaps() {
    // a nearly correct initial guess is no mistake
    const double least = (picture_.assembled ? 3.0 : 0.1) * picture_.symbol;
    for (const PictureLoop& loop : picture_.loops) {
      if (!(loop.gap > least)) continue;
      const ProjectedPoint a = camera_.See(loop.from.In(picture_.given)),
                           b = camera_.See(loop.to.In(picture_.given));
      body_ += fmt::format(
          "<path d=\"M{0:.1f} {1:.1f}L{2:.1f} {3:.1f}\" stroke=\"#c00000\" stroke-width=\"2\" "
          "stroke-dasharray=\"2 2\"/>\n<path d=\"M{4:.1f} {5:.1f}l7 7m0 -7l-7 7M{6:.1f} {7:.1f}l7 "
          "7m0 -7l-7 7\" stroke=\"#c00000\" stroke-width=\"1.5\"/>\n",
          a.x, a.y, b.x, b.y, a.x - 3.5, a.y - 3.5, b.x - 3.5, b.y - 3.5);
      const std::string& joint = picture_.items[picture_.ItemOfJoint(loop.cut_joint)].name;
      PlaceText(0.5 * (a.x + b.x), 0.5 * (a.y + b.y),
                fmt::format("{} open by {:.3g} m", Shortened(joint, 24), loop.gap), "#c00000", 4.0);
    }
  }

  /// Places text next to a point without overlap; omits it if there is no room.
  void PlaceText(double x, double y, const std::string& text, const char* colour, double off) {
    const double wide = 0.6 * kFont * static_cast<double>(CountCharacters(text)), high = kFont;
    constexpr double kSides[][2] = {{1, -1}, {-1, -1}, {1, 1},    {-1, 1},    {0, -1},  {0, 1},
                                    {1, 0},  {-1, 0},  {1, -2.2}, {-1, -2.2}, {1, 2.2}, {-1, 2.2}};
    for (const auto& [right, down] : kSides) {
      const double left = x + (right > 0 ? off : right < 0 ? -off - wide : -0.5 * wide);
      const double above = down < 0 ? high : 0.0;
      const double top = y + down * (off + above) - (down == 0 ? 0.5 * high : 0.0);
      const Box box = {left, top, left + wide, top + high};
      const bool inside =
          box.left > 2 && box.right < kWidth - 2 && box.top > 2 && box.bottom < height_ - 2;
      const bool is_free = std::ranges::none_of(taken_, [&](const Box& b) { return b.Meets(box); });
      if (!inside || !is_free) continue;
      taken_.push_back(box);
      return Text(left, top + 0.85 * high, text, "start", colour);
    }
  }

  void DrawNames() {
    constexpr std::size_t kMaxNames = 120;
    if (picture_.bodies + picture_.joints > kMaxNames) return;
    const double pin = std::max(3.0, 1.1 * picture_.symbol * camera_.scale);
    for (const PictureItem& item : picture_.items) {
      if (item.kind == ItemKind::kForce) continue;
      const ProjectedPoint spot = SpotOf(item);
      taken_.push_back(
          {spot.x - 0.7 * pin, spot.y - 0.7 * pin, spot.x + 0.7 * pin, spot.y + 0.7 * pin});
    }
    for (std::size_t i = 1; i < picture_.bodies + picture_.joints; ++i) {
      const PictureItem& item = picture_.items[i];
      const bool body = item.kind == ItemKind::kBody;
      const ProjectedPoint spot = SpotOf(item);
      PlaceText(spot.x, spot.y, Shortened(item.name, 20), body ? "#1e3a5f" : "#111",
                body ? 1.2 * pin : pin);
    }
  }

  void DrawFooter(double top) {
    const double length = RoundLength(0.25 * kWidth / camera_.scale), px = length * camera_.scale;
    const double y = top + 0.5 * kFooter;
    body_ += fmt::format(
        "<path d=\"M{0} {1}v6m0 -3h{2:.2f}m0 -3v6\" stroke=\"#111\" stroke-width=\"1.2\" "
        "fill=\"none\"/>\n",
        kMargin, y - 3.0, px);
    Text(kMargin + px + 6.0, y + 4.0, fmt::format("{:g} m", length), "start", "#111");
    const double x0 = kWidth - 120.0, y0 = y + 8.0;
    const char* const names[] = {"x", "y", "z"};
    for (int i = 0; i < (picture_.planar ? 2 : 3); ++i) {
      const Vector3d e = camera_.R.col(i);
      Pointer(x0, y0, e.x(), -e.y(), 24.0, "#111", names[i]);
    }
    const Vector3d g = camera_.R * picture_.gravity;
    const double size = picture_.gravity.norm();
    if (size > 0.0)
      Pointer(kWidth - 40.0, y - 10.0, g.x() / size, -g.y() / size, 26.0, "#555", "g");
  }

  void Pointer(double x, double y, double dx, double dy, double length, const char* colour,
               const char* name) {
    const double tx = x + length * dx, ty = y + length * dy, foreshortened = std::hypot(dx, dy);
    const double head = 6.0 * std::min(1.0, foreshortened);
    if (foreshortened < 0.05) {
      body_ += fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"2\" fill=\"{}\"/>\n", x, y, colour);
    } else {
      const double ux = dx / foreshortened, uy = dy / foreshortened;
      body_ += fmt::format(
          "<path d=\"M{0:.1f} {1:.1f}L{2:.1f} {3:.1f}M{4:.1f} {5:.1f}L{2:.1f} {3:.1f}L{6:.1f} "
          "{7:.1f}\" fill=\"none\" stroke=\"{8}\" stroke-width=\"1.2\"/>\n",
          x, y, tx, ty, tx - head * ux - 0.5 * head * uy, ty - head * uy + 0.5 * head * ux,
          tx - head * ux + 0.5 * head * uy, ty - head * uy - 0.5 * head * ux, colour);
    }
    Text(tx + 8.0 * (foreshortened > 0.05 ? dx : 1.0), ty + 8.0 * dy + 4.0, name, "middle", colour);
  }

  /// Returns one line for each fact that cannot be drawn.
  std::vector<std::string> Legend(bool ghost) const {
    constexpr std::size_t kMaxLines = 10, kMaxCharacters = 98;
    std::vector<std::string> lines;
    if (!picture_.assembled) {
      lines = {"NOT ASSEMBLED, drawn as in the file; red: what should meet", picture_.message};
    }
    if (!picture_.freedom.empty()) lines.push_back("degrees of freedom: " + picture_.freedom);
    for (const PictureLoop& loop : picture_.loops) {
      const std::string& joint = picture_.items[picture_.ItemOfJoint(loop.cut_joint)].name;
      for (const std::string& one : loop.redundant) {
        lines.push_back("redundant (dashed ring, loop in orange): " + joint + ": " + one);
      }
    }
    if (ghost)
      lines.push_back("grey, dashed: as in the file, before the assembly closed the loops");
    std::vector<PictureItem> gone;
    std::ranges::copy_if(picture_.items, std::back_inserter(gone),
                         [](const PictureItem& item) { return !item.gone.empty(); });
    // parts with equal text share a line
    for (const auto& [what, items] : GroupBy(gone, &PictureItem::gone)) {
      lines.push_back("dashed outline, " + what + ": " + Joined(items, ", ", &PictureItem::name));
    }
    if (lines.size() > kMaxLines) {
      const std::size_t more = lines.size() - kMaxLines + 1;
      lines.resize(kMaxLines - 1);
      lines.push_back(fmt::format("and {} more lines: --format text has them", more));
    }
    for (std::string& line : lines) line = Shortened(line, kMaxCharacters);
    return lines;
  }

  const Picture& picture_;
  const SvgOptions& options_;
  Camera camera_;
  double height_ = 0.0;
  std::string body_, dots_;
  std::unordered_set<long> cells_;  ///< pixels with a dot
  std::vector<Box> taken_;
};

}  // namespace

double RoundLength(double longest) {
  if (!(longest > 0.0) || !std::isfinite(longest)) return 1.0;
  const double decade = std::pow(10.0, std::floor(std::log10(longest)));
  for (const double step : {5.0, 2.0}) {
    if (step * decade <= longest) return step * decade;
  }
  return decade;
}

const std::vector<std::string>& ViewNames() {
  static const std::vector<std::string> names = {"oblique", "front", "side", "top"};
  return names;
}

Eigen::Matrix3d ViewNamed(const Picture& picture, const std::string& name) {
  if (picture.planar) return Eigen::Matrix3d::Identity();
  // azimuth and elevation of the viewer [degrees] about `up`
  double azimuth = -62.0, elevation = 22.0;
  if (name == "front") azimuth = -90.0, elevation = 0.0;
  if (name == "side") azimuth = 0.0, elevation = 0.0;
  if (name == "top") azimuth = -90.0, elevation = 89.999;  // right stays defined
  const Vector3d& up = picture.up;
  const Vector3d axis = std::abs(up.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d a = (axis - axis.dot(up) * up).normalized(), b = up.cross(a);
  constexpr double kDegree = std::numbers::pi / 180.0;
  const Vector3d level = std::cos(azimuth * kDegree) * a + std::sin(azimuth * kDegree) * b;
  const Vector3d viewer =
      std::cos(elevation * kDegree) * level + std::sin(elevation * kDegree) * up;
  Eigen::Matrix3d R;
  R.row(0) = up.cross(viewer).normalized();
  R.row(2) = viewer;
  R.row(1) = viewer.cross(Vector3d(R.row(0)));
  return R;
}

std::string ToSvg(const Picture& picture, const SvgOptions& options) {
  return Document(picture, options).Write();
}

}  // namespace loopbench::harness
