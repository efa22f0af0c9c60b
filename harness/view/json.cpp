#include "harness/view/json.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "harness/text/escape.h"
#include "harness/view/camera.h"

namespace loopbench::harness {
namespace {

using Eigen::Vector3d;

std::string_view NameOf(ShapeKind kind) {
  constexpr std::string_view kNames[] = {"line",   "area",   "bar",    "disc",
                                         "centre", "spring", "damper", "arrow"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string_view NameOf(ShapeStyle style) {
  constexpr std::string_view kNames[] = {"body",   "ground", "joint",  "solid", "guide", "rod",
                                         "centre", "spring", "damper", "force", "drive"};
  return kNames[static_cast<std::size_t>(style)];
}

std::string_view NameOf(ItemKind kind) {
  constexpr std::string_view kNames[] = {"body", "joint", "force"};
  return kNames[static_cast<std::size_t>(kind)];
}

/// JSON knows no number that is not finite.
std::string Number(double value, int digits = 10) {
  return std::isfinite(value) ? fmt::format("{:.{}g}", value + 0.0, digits) : "0";
}

std::string Numbers(const Vector3d& v, int digits = 10) {
  return Number(v.x(), digits) + "," + Number(v.y(), digits) + "," + Number(v.z(), digits);
}

std::string Indices(const std::vector<int>& list) {
  return ListOf(list, [](int one) { return std::to_string(one); });
}

std::string PlaceText(const PicturePlace& place) {
  return fmt::format("{},{}", place.body, Numbers(place.at));
}

std::string ItemText(const PictureItem& item) {
  return fmt::format(
      R"({{"kind":"{}","name":{},"detail":{},"anchor":[{}],"gone":{},"redundant":{}}})",
      NameOf(item.kind), ScriptString(item.name), ScriptString(item.detail), PlaceText(item.anchor),
      ScriptString(item.gone), Strings(item.redundant));
}

std::string ShapeText(const PictureShape& shape) {
  bool shifted = false;
  for (const PicturePlace& place : shape.places) shifted = shifted || !place.offset.isZero(0.0);
  const std::string offsets =
      shifted ? ",\"offsets\":" +
                    ListOf(shape.places, [](const PicturePlace& p) { return Numbers(p.offset); })
              : "";
  return fmt::format(
      R"({{"kind":"{}","style":"{}","item":{},"radius":{},"aside":{},"lift":{},"at":{}{}}})",
      NameOf(shape.kind), NameOf(shape.style), shape.item, Number(shape.radius),
      Number(shape.aside), Number(Lift(shape.style)), ListOf(shape.places, PlaceText), offsets);
}

std::string LoopText(const PictureLoop& loop) {
  return fmt::format(
      R"({{"joint":{},"bodies":{},"joints":{},"from":[{}],"offset":[{}],"to":[{}],"gap":{},"turn":{},"left":{},"redundant":{}}})",
      loop.cut_joint, Indices(loop.bodies), Indices(loop.joints), PlaceText(loop.from),
      Numbers(loop.from.offset), PlaceText(loop.to), Number(loop.gap), Number(loop.turn),
      Number(loop.left), Strings(loop.redundant));
}

}  // namespace

std::string ScriptString(std::string_view text) {
  std::string escaped = "\"";
  for (const char c : EscapeTerminal(text)) {
    if (c == '"' || c == '\\') {
      escaped += {'\\', c};
    } else if (c == '<' || c == '>' || c == '&') {
      escaped += fmt::format("\\u{:04x}", static_cast<int>(c));
    } else {
      escaped += c;
    }
  }
  return escaped + "\"";
}

std::string PosesJson(const Poses& poses, bool planar, int digits) {
  const auto number = [digits](double value) { return Number(value, digits); };
  return ListOf(poses, [&](const Frame& X) {
    if (planar) {
      return fmt::format("{},{},{}", number(X.p.x()), number(X.p.y()),
                         number(std::atan2(X.R(1, 0), X.R(0, 0))));
    }
    const Eigen::Quaterniond q(X.R);
    return fmt::format("{},{},{},{},{}", Numbers(X.p, digits), number(q.w()), number(q.x()),
                       number(q.y()), number(q.z()));
  });
}

std::string ToJson(const Picture& picture) {
  const auto poses = [&](const Poses& one) { return PosesJson(one, picture.planar); };
  const Eigen::Matrix3d R = ViewNamed(picture, ViewNames().front());
  std::string text = fmt::format(
      R"({{"name":{},"file":{},"planar":{},"assembled":{},"message":{},"freedom":{},"bodies":{},"joints":{},)",
      ScriptString(picture.name), ScriptString(picture.file), picture.planar, picture.assembled,
      ScriptString(picture.message), ScriptString(picture.freedom), picture.bodies, picture.joints);
  text += fmt::format(
      R"("gravity":[{}],"up":[{}],"view":[[{}],[{}],[{}]],"symbol":{},"extent":{},)",
      Numbers(picture.gravity), Numbers(picture.up), Numbers(R.row(0)), Numbers(R.row(1)),
      Numbers(R.row(2)), Number(picture.symbol), Number(picture.extent));
  text += "\"items\":" + ListOf(picture.items, ItemText);
  text += ",\"shapes\":" + ListOf(picture.shapes, ShapeText);
  text += ",\"loops\":" + ListOf(picture.loops, LoopText);
  text += ",\"start\":" + poses(picture.start) + ",\"given\":" + poses(picture.given);
  text += ",\"motions\":" + ListOf(picture.motions, [&](const PictureMotion& motion) {
            return fmt::format(R"({{"name":{},"text":{},"start":{},"returns":{},"frames":{}}})",
                               ScriptString(motion.name), ScriptString(motion.text), motion.start,
                               motion.returns, ListOf(motion.frames, poses));
          });
  return text + ",\"notes\":" + Strings(picture.notes) + "}";
}

}  // namespace loopbench::harness
