#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "harness/base/text.h"
#include "harness/figures/view.h"

namespace loopbench::harness {
namespace {

using Eigen::Vector3d;

std::string_view NameOf(ShapeKind kind) {
  constexpr std::string_view kNames[] = {"line",   "area",   "bar",    "disc",
                                         "centre", "spring", "damper", "arrow"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string_view NameOf(ItemKind kind) {
  constexpr std::string_view kNames[] = {"body", "joint", "force"};
  return kNames[static_cast<std::size_t>(kind)];
}

/// Returns a JSON number; non-finite numbers become 0, since JSON has none.
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
      NameOf(shape.kind), TraitsOf(shape.style).name, shape.item, Number(shape.radius),
      Number(shape.aside), Number(TraitsOf(shape.style).lift), ListOf(shape.places, PlaceText),
      offsets);
}

std::string PointText(const PicturePoint& point) {
  return fmt::format(R"({{"name":{},"at":[{}]}})", ScriptString(point.name),
                     PlaceText(point.place));
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
  text += ",\"points\":" + ListOf(picture.points, PointText);
  text += ",\"loops\":" + ListOf(picture.loops, LoopText);
  text += ",\"start\":" + poses(picture.start) + ",\"given\":" + poses(picture.given);
  text += ",\"motions\":" + ListOf(picture.motions, [&](const PictureMotion& motion) {
            return fmt::format(R"({{"name":{},"text":{},"start":{},"returns":{},"frames":{}}})",
                               ScriptString(motion.name), ScriptString(motion.text), motion.start,
                               motion.returns, ListOf(motion.frames, poses));
          });
  return text + ",\"notes\":" + Strings(picture.notes) + "}";
}

std::string PageHead(std::string_view title) {
  std::string head = fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<link rel=\"icon\" href=\"data:,\">\n<title>{}</title>\n<style>\n",
      title);
  head += kSceneStyle;
  return head;
}

std::string ToHtml(const Picture& picture) {
  const std::string title = EscapeXml(picture.name);
  const std::string subtitle = EscapeXml(
      fmt::format("{}{}, {}, {}{}", picture.file.empty() ? "" : picture.file + ": ",
                  WithCount(picture.bodies - 1, "body"), WithCount(picture.joints, "joint"),
                  WithCount(picture.loops.size(), "loop"),
                  picture.freedom.empty() ? "" : "; degrees of freedom: " + picture.freedom));
  const std::string failure =
      picture.assembled
          ? ""
          : "<p class=\"failed\" role=\"alert\">Not assembled, drawn as in the file: " +
                EscapeXml(picture.message) + "</p>\n";
  std::string page = PageHead(title);
  page += "</style>\n</head>\n<body>\n";
  // the box of the poses in the file is checked where the others are not assembled
  page += fmt::format(fmt::runtime(kViewBody), fmt::arg("title", title),
                      fmt::arg("subtitle", subtitle), fmt::arg("failure", failure),
                      fmt::arg("given", picture.assembled ? "" : " checked"));
  page += "<script type=\"application/json\" id=\"picture\">" + ToJson(picture) + "</script>\n";
  page += "<script>\n";
  page += kSceneScript;
  page += kViewScript;
  return page + "</script>\n</body>\n</html>\n";
}
namespace {

/// Returns six digits; zero below `round_off`.
std::string Number(double value, double round_off) {
  return fmt::format("{:.6g}", std::abs(value) < round_off ? 0.0 : value);
}

class Writer {
 public:
  explicit Writer(const Picture& picture) : picture_(picture), small_(1e-12 * picture.extent) {}

  std::vector<Table> Write() const { return {Bodies(), Joints(), Forces(), Loops(), Motions()}; }

 private:
  /// Returns columns x, y and, in space, z, for Columns().
  std::string PlaceColumns(const std::string& prefix = "") const {
    std::string columns;
    for (const char axis : std::string_view(picture_.planar ? "xy" : "xyz")) {
      columns += fmt::format("{0}{1}={0}{2}{1} [m], ", prefix, axis, prefix.empty() ? "" : " ");
    }
    return columns;
  }
  void SetPlace(const std::string& prefix, const Vector3d& p, Record* row) const {
    for (int i = 0; i < (picture_.planar ? 2 : 3); ++i) {
      row->Set(prefix + static_cast<char>('x' + i), Number(p[i], small_));
    }
  }

  Table Bodies() const {
    Table table{.title = picture_.assembled ? "Bodies, as assembled" : "Bodies, as in the file",
                .columns = Columns("name=body, " + PlaceColumns() +
                                   (picture_.planar ? "turn=angle [rad], " : "turn=turn [rad], ") +
                                   PlaceColumns("com") + "gone=in a run")};
    for (std::size_t b = 1; b < picture_.bodies; ++b) {
      const Frame& X = picture_.start[b];
      Record& row = AddRow({picture_.items[b].name}, &table);
      SetPlace("", X.p, &row);
      row.Set("turn", TurnText(X.R));
      SetPlace("com", picture_.centres[b].In(picture_.start), &row);
      row.Set("gone", picture_.items[b].gone);
    }
    return table;
  }

  std::string TurnText(const Eigen::Matrix3d& R) const {
    if (picture_.planar) return Number(std::atan2(R(1, 0), R(0, 0)), 1e-12);
    const Eigen::AngleAxisd turn(R);
    const Vector3d vector = turn.angle() * turn.axis();
    return fmt::format("{} {} {}", Number(vector.x(), 1e-12), Number(vector.y(), 1e-12),
                       Number(vector.z(), 1e-12));
  }

  Table Joints() const {
    Table table{
        .title = "Joints",
        .columns = Columns("name=joint, what, " + PlaceColumns() + "redundant, gone=in a run")};
    for (std::size_t j = 0; j < picture_.joints; ++j) {
      const PictureItem& item = picture_.items[picture_.ItemOfJoint(static_cast<int>(j))];
      Record& row = AddRow({item.name, item.detail}, &table);
      SetPlace("", item.anchor.In(picture_.start), &row);
      row.Set("redundant", Joined(item.redundant, "; "));
      row.Set("gone", item.gone);
    }
    return table;
  }

  Table Forces() const {
    Table table{.title = "Forces",
                .columns = Columns("name=force, what, " + PlaceColumns() + PlaceColumns("to"))};
    for (std::size_t i = picture_.bodies + picture_.joints; i < picture_.items.size(); ++i) {
      const PictureItem& item = picture_.items[i];
      Record& row = AddRow({item.name, item.detail}, &table);
      SetPlace("", item.anchor.In(picture_.start), &row);
      for (const PictureShape& shape : picture_.shapes) {
        const bool between = shape.places.size() == 2 &&
                             (shape.kind == ShapeKind::kSpring || shape.kind == ShapeKind::kDamper);
        if (shape.item != static_cast<int>(i) || !between) continue;
        SetPlace("to", shape.places.back().In(picture_.start), &row);
      }
    }
    return table;
  }

  Table Loops() const {
    Table table{.title = "Loops",
                .columns = Columns("name=cut joint, gap=open in the file [m], turn=[rad], "
                                   "left=assembled [m], bodies")};
    for (const PictureLoop& loop : picture_.loops) {
      AddRow({picture_.items[picture_.ItemOfJoint(loop.cut_joint)].name, Number(loop.gap, small_),
              Number(loop.turn, 1e-12), Number(loop.left, small_),
              Joined(loop.bodies, " ", [&](int b) { return picture_.items[b].name; })},
             &table);
    }
    return table;
  }

  Table Motions() const {
    Table table{.title = "Motions", .columns = Columns("name=motion, what=how far")};
    for (const PictureMotion& motion : picture_.motions) AddRow({motion.name, motion.text}, &table);
    return table;
  }

  const Picture& picture_;
  double small_;
};

}  // namespace

std::vector<Table> ToTables(const Picture& picture) { return Writer(picture).Write(); }

}  // namespace loopbench::harness
