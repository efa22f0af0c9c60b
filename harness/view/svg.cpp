#include "harness/view/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/text/escape.h"
#include "harness/view/svg_shapes.h"

namespace loopbench::harness {
namespace {

using Eigen::Vector3d;

/// 160 mm of paper at 96 px per inch; a font of 8 points.
constexpr double kWidth = 605.0, kMargin = 26.0, kFont = 10.7, kFooter = 52.0, kLine = 14.0;
constexpr const char* kFamily = "DejaVu Sans, Verdana, Arial, Helvetica, sans-serif";

/// Longer names are cut short: they would cover what they name.
std::string Shortened(const std::string& name, std::size_t most) {
  const std::string shown = EscapeTerminal(name);
  std::size_t characters = 0, bytes = 0;
  while (bytes < shown.size() && characters < most) {
    ++bytes;
    while (bytes < shown.size() && (static_cast<unsigned char>(shown[bytes]) & 0xC0) == 0x80) {
      ++bytes;
    }
    ++characters;
  }
  return bytes < shown.size() ? shown.substr(0, bytes) + "\u2026" : shown;
}

std::size_t CharactersOf(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(
      text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
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
    SvgPen pen(picture_, camera_);
    if (ghost) pen.DrawGhost(picture_.given);
    pen.DrawAll(picture_.start);
    body_ += pen.Take();
    // what is written goes last, so that nothing covers it
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

  void Text(double x, double y, const std::string& text, const char* anchor, const char* colour) {
    body_ += fmt::format(
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"{}\" stroke=\"#fff\" "
        "stroke-width=\"2.5\" stroke-linejoin=\"round\" paint-order=\"stroke\">{}</text>\n",
        x, y, anchor, colour, EscapeXml(text));
  }

  /// Whether the assembly moved anything by more than a symbol's size, to be seen.
  bool ShowsGhost() const {
    if (options_.plain || !picture_.assembled) return false;
    return std::ranges::any_of(picture_.items, [&](const PictureItem& item) {
      return (item.anchor.In(picture_.given) - item.anchor.In(picture_.start)).norm() >
             3.0 * picture_.symbol;
    });
  }

  /// A dashed ring about joints that impose what others impose, and a line through the joints of
  /// the loops that these are in.
  void DrawRedundant() {
    for (const PictureLoop& loop : picture_.loops) {
      if (loop.redundant.empty()) continue;
      std::string path;
      for (const int joint : loop.joints) {
        const Spot spot =
            camera_.See(picture_.items[picture_.ItemOfJoint(joint)].anchor.In(picture_.start));
        path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", spot.x, spot.y);
      }
      body_ += fmt::format(
          "<path d=\"{}Z\" fill=\"none\" stroke=\"#e08a2e\" stroke-opacity=\"0.45\" "
          "stroke-width=\"4\" stroke-linejoin=\"round\"/>\n",
          path);
    }
    for (const PictureItem& item : picture_.items) {
      if (item.redundant.empty()) continue;
      const Spot spot = camera_.See(item.anchor.In(picture_.start));
      body_ += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"none\" stroke=\"#b45309\" "
          "stroke-width=\"1.6\" stroke-dasharray=\"3 2\"/>\n",
          spot.x, spot.y, std::max(7.0, 2.4 * picture_.symbol * camera_.scale));
    }
  }

  void DrawGaps() {
    // a guess that is nearly right is no mistake
    const double least = (picture_.assembled ? 3.0 : 0.1) * picture_.symbol;
    for (const PictureLoop& loop : picture_.loops) {
      if (!(loop.gap > least)) continue;
      const Spot a = camera_.See(loop.from.In(picture_.given)),
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

  /// Beside a point, where nothing is written yet; nowhere if there is no room.
  void PlaceText(double x, double y, const std::string& text, const char* colour, double off) {
    const double wide = 0.6 * kFont * static_cast<double>(CharactersOf(text)), high = kFont;
    constexpr double kSides[][2] = {{1, -1}, {-1, -1}, {1, 1},    {-1, 1},    {0, -1},  {0, 1},
                                    {1, 0},  {-1, 0},  {1, -2.2}, {-1, -2.2}, {1, 2.2}, {-1, 2.2}};
    for (const auto& [right, down] : kSides) {
      const double left = x + (right > 0 ? off : right < 0 ? -off - wide : -0.5 * wide);
      const double top = y +
                         down * (off + (down > 0   ? 0.0
                                        : down < 0 ? high
                                                   : 0.0)) -
                         (down == 0 ? 0.5 * high : 0.0);
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
    constexpr std::size_t kMostNames = 120;
    if (picture_.bodies + picture_.joints > kMostNames) return;
    const double pin = std::max(3.0, 1.1 * picture_.symbol * camera_.scale);
    const auto at = [&](const PictureItem& item) {
      return camera_.See(item.anchor.In(picture_.start));
    };
    for (const PictureItem& item : picture_.items) {
      if (item.kind == ItemKind::kForce) continue;
      const Spot spot = at(item);
      taken_.push_back(
          {spot.x - 0.7 * pin, spot.y - 0.7 * pin, spot.x + 0.7 * pin, spot.y + 0.7 * pin});
    }
    for (std::size_t i = 1; i < picture_.bodies + picture_.joints; ++i) {
      const PictureItem& item = picture_.items[i];
      const bool body = item.kind == ItemKind::kBody;
      const Spot spot = at(item);
      PlaceText(spot.x, spot.y, Shortened(item.name, 20), body ? "#1e3a5f" : "#111",
                body ? 1.2 * pin : pin);
    }
  }

  /// Scale, axes and gravity.
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

  /// What cannot be drawn, one thing per line.
  std::vector<std::string> Legend(bool ghost) const {
    constexpr std::size_t kMostLines = 10, kMostCharacters = 98;
    std::vector<std::string> lines;
    if (!picture_.assembled) {
      lines = {"NOT ASSEMBLED, drawn as the file says it; red: what should meet", picture_.message};
    }
    if (!picture_.freedom.empty()) lines.push_back("degrees of freedom: " + picture_.freedom);
    for (const PictureLoop& loop : picture_.loops) {
      const std::string& joint = picture_.items[picture_.ItemOfJoint(loop.cut_joint)].name;
      for (const std::string& one : loop.redundant) {
        lines.push_back("redundant (dashed ring, loop in orange): " + joint + ": " + one);
      }
    }
    if (ghost)
      lines.push_back("grey, dashed: as the file says it, before the assembly closed the loops");
    // those of which the same is to say, together
    std::vector<std::pair<std::string, std::string>> gone;
    for (const PictureItem& item : picture_.items) {
      if (item.gone.empty()) continue;
      const auto same =
          std::ranges::find(gone, item.gone, &std::pair<std::string, std::string>::first);
      if (same == gone.end()) {
        gone.emplace_back(item.gone, item.name);
      } else {
        same->second += ", " + item.name;
      }
    }
    for (const auto& [what, names] : gone)
      lines.push_back("dashed outline, " + what + ": " + names);
    if (lines.size() > kMostLines) {
      const std::size_t more = lines.size() - kMostLines + 1;
      lines.resize(kMostLines - 1);
      lines.push_back(fmt::format("and {} more lines: --format text has them", more));
    }
    for (std::string& line : lines) line = Shortened(line, kMostCharacters);
    return lines;
  }

  const Picture& picture_;
  const SvgOptions& options_;
  Camera camera_;
  double height_ = 0.0;
  std::string body_;
  std::vector<Box> taken_;
};

}  // namespace

std::string EscapeXml(std::string_view text) {
  std::string escaped;
  for (const char c : EscapeTerminal(text)) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

double RoundLength(double longest) {
  if (!(longest > 0.0) || !std::isfinite(longest)) return 1.0;
  const double decade = std::pow(10.0, std::floor(std::log10(longest)));
  for (const double step : {5.0, 2.0}) {
    if (step * decade <= longest) return step * decade;
  }
  return decade;
}

std::string ToSvg(const Picture& picture, const SvgOptions& options) {
  return Document(picture, options).Write();
}

}  // namespace loopbench::harness
