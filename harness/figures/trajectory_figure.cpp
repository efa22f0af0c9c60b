#include "harness/figures/trajectory_figure.h"

#include <fmt/format.h>

namespace loopbench::harness {
namespace {

/// "joint:A:angle" of "joint:A:angle [rad]".
std::string WithoutUnit(const std::string& label) { return label.substr(0, label.rfind(" [")); }

}  // namespace

Figure TrajectoryFigure(const Trajectory& ours, const Trajectory& theirs,
                        std::span<const SharedColumn> columns, const std::string& title) {
  const std::string unit = columns.empty() ? "" : columns.front().unit;
  Figure both{
      .title = title, .x_label = "time [s]", .y_label = fmt::format("[{}]", unit), .curves = {}};
  Figure apart{.title = "",
               .x_label = "time [s]",
               .y_label = fmt::format("theirs - ours [{}]", unit),
               .curves = {}};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const SharedColumn& column = columns[i];
    const std::string name = WithoutUnit(column.label);
    CurveStyle style = DistinctStyle(i);
    style.shape = Shape::kNone;
    Curve own{.label = name + ", ours", .style = style};
    Curve difference{.label = name, .style = style};
    style.dash = 1;
    Curve other{.label = name + ", theirs", .style = style};
    for (std::size_t row = 0; row < ours.rows(); ++row) {
      own.x.push_back(ours.At(row, ours.time));
      own.y.push_back(ours.At(row, column.in_ours));
    }
    for (std::size_t row = 0; row < theirs.rows(); ++row) {
      other.x.push_back(theirs.At(row, theirs.time));
      other.y.push_back(theirs.At(row, column.in_theirs));
    }
    difference.x = other.x;
    difference.y = Differences(ours, theirs, column);
    both.curves.push_back(std::move(own));
    both.curves.push_back(std::move(other));
    apart.curves.push_back(std::move(difference));
  }
  both.names_at_ends = true;
  both.below.push_back(std::move(apart));
  return both;
}

std::optional<std::string> DrawTrajectories(const std::filesystem::path& path,
                                            const Trajectory& ours, const Trajectory& theirs,
                                            std::span<const SharedColumn> columns,
                                            const std::string& title) {
  return WriteFigure(path, TrajectoryFigure(ours, theirs, columns, title));
}

}  // namespace loopbench::harness
