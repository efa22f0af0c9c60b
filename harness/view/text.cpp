#include "harness/view/text.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

namespace loopbench::harness {
namespace {

using Eigen::Vector3d;

TableColumn Words(const char* key, const char* header) {
  return {.key = key, .header = header, .format = Format::kText};
}

/// Six digits; what is round-off of the picture's size is zero.
std::string Number(double value, double round_off) {
  return fmt::format("{:.6g}", std::abs(value) < round_off ? 0.0 : value);
}

class Writer {
 public:
  explicit Writer(const Picture& picture) : picture_(picture), small_(1e-12 * picture.extent) {}

  std::vector<Table> Write() const { return {Bodies(), Joints(), Forces(), Loops(), Motions()}; }

 private:
  /// Columns x, y and in space z.
  void AddPlace(const std::string& prefix, const std::string& what, Table* table) const {
    for (const char axis : {'x', 'y', 'z'}) {
      if (axis == 'z' && picture_.planar) continue;
      table->columns.push_back(
          {.key = prefix + axis, .header = what + axis + " [m]", .format = Format::kText});
    }
  }
  void SetPlace(const std::string& prefix, const Vector3d& p, Record* row) const {
    for (int i = 0; i < (picture_.planar ? 2 : 3); ++i) {
      row->Set(prefix + static_cast<char>('x' + i), Number(p[i], small_));
    }
  }

  Table Bodies() const {
    Table table{.title = picture_.assembled ? "Bodies, as assembled" : "Bodies, as the file says"};
    table.columns = {Words("name", "body")};
    AddPlace("", "", &table);
    table.columns.push_back(Words("turn", picture_.planar ? "angle [rad]" : "turn [rad]"));
    AddPlace("com", "com ", &table);
    table.columns.push_back(Words("gone", "in a run"));
    for (std::size_t b = 1; b < picture_.bodies; ++b) {
      const Frame& X = picture_.start[b];
      Record& row = table.rows.emplace_back();
      row.Set("name", picture_.items[b].name);
      SetPlace("", X.p, &row);
      row.Set("turn", TurnText(X.R));
      SetPlace("com", picture_.centres[b].In(picture_.start), &row);
      row.Set("gone", picture_.items[b].gone);
    }
    return table;
  }

  /// The angle, or the rotation vector.
  std::string TurnText(const Eigen::Matrix3d& R) const {
    if (picture_.planar) return Number(std::atan2(R(1, 0), R(0, 0)), 1e-12);
    const Eigen::AngleAxisd turn(R);
    const Vector3d vector = turn.angle() * turn.axis();
    return fmt::format("{} {} {}", Number(vector.x(), 1e-12), Number(vector.y(), 1e-12),
                       Number(vector.z(), 1e-12));
  }

  Table Joints() const {
    Table table{.title = "Joints"};
    table.columns = {Words("name", "joint"), Words("what", "what")};
    AddPlace("", "", &table);
    table.columns.push_back(Words("redundant", "redundant"));
    table.columns.push_back(Words("gone", "in a run"));
    for (std::size_t j = 0; j < picture_.joints; ++j) {
      const PictureItem& item = picture_.items[picture_.ItemOfJoint(static_cast<int>(j))];
      Record& row = table.rows.emplace_back();
      row.Set("name", item.name);
      row.Set("what", item.detail);
      SetPlace("", item.anchor.In(picture_.start), &row);
      row.Set("redundant", fmt::format("{}", fmt::join(item.redundant, "; ")));
      row.Set("gone", item.gone);
    }
    return table;
  }

  Table Forces() const {
    Table table{.title = "Forces"};
    table.columns = {Words("name", "force"), Words("what", "what")};
    AddPlace("", "", &table);
    AddPlace("to", "to ", &table);
    for (std::size_t i = picture_.bodies + picture_.joints; i < picture_.items.size(); ++i) {
      const PictureItem& item = picture_.items[i];
      Record& row = table.rows.emplace_back();
      row.Set("name", item.name);
      row.Set("what", item.detail);
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
    Table table{.title = "Loops"};
    table.columns = {Words("name", "cut joint"), Words("gap", "open as the file says [m]"),
                     Words("turn", "[rad]"), Words("left", "assembled [m]"),
                     Words("bodies", "bodies")};
    for (const PictureLoop& loop : picture_.loops) {
      Record& row = table.rows.emplace_back();
      row.Set("name", picture_.items[picture_.ItemOfJoint(loop.cut_joint)].name);
      row.Set("gap", Number(loop.gap, small_));
      row.Set("turn", Number(loop.turn, 1e-12));
      row.Set("left", Number(loop.left, small_));
      std::vector<std::string> names;
      for (const int b : loop.bodies)
        names.push_back(picture_.items[static_cast<std::size_t>(b)].name);
      row.Set("bodies", fmt::format("{}", fmt::join(names, " ")));
    }
    return table;
  }

  Table Motions() const {
    Table table{.title = "Motions"};
    table.columns = {Words("name", "motion"), Words("what", "how far")};
    for (const PictureMotion& motion : picture_.motions) {
      Record& row = table.rows.emplace_back();
      row.Set("name", motion.name);
      row.Set("what", motion.text);
    }
    return table;
  }

  const Picture& picture_;
  double small_;
};

}  // namespace

std::vector<Table> ToTables(const Picture& picture) { return Writer(picture).Write(); }

}  // namespace loopbench::harness
