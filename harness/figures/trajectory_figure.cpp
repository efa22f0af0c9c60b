#include "harness/figures/trajectory_figure.h"

#include <fmt/format.h>

#include "harness/figures/figures.h"
#include "harness/figures/gnuplot.h"

namespace loopbench::harness {
namespace {

/// "joint:A:angle" of "joint:A:angle [rad]".
std::string WithoutUnit(const std::string& label) { return label.substr(0, label.rfind(" [")); }

}  // namespace

std::string TrajectoryScript(const Trajectory& ours, const Trajectory& theirs,
                             std::span<const SharedColumn> columns, const std::string& title) {
  const std::string unit = columns.empty() ? "" : columns.front().unit;
  Figure both{
      .title = title, .x_label = "time [s]", .y_label = fmt::format("[{}]", unit), .curves = {}};
  Figure apart{.title = "theirs - ours",
               .x_label = "time [s]",
               .y_label = fmt::format("difference [{}]", unit),
               .curves = {}};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const SharedColumn& column = columns[i];
    const std::string name = WithoutUnit(column.label);
    Curve own{.label = name + ", ours", .style = DistinctStyle(2 * i)};
    Curve other{.label = name + ", theirs", .style = DistinctStyle(2 * i + 1)};
    Curve difference{.label = name, .style = DistinctStyle(2 * i)};
    // theirs lies on top, and thin, so that ours is seen on both sides of it
    own.style.width = 4.0;
    other.style.width = 1.5;
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
  return "set multiplot layout 2,1\n" + GnuplotScript(both) + "reset\n" + GnuplotScript(apart) +
         "unset multiplot\n";
}

std::optional<std::string> DrawTrajectories(const std::filesystem::path& path,
                                            const Trajectory& ours, const Trajectory& theirs,
                                            std::span<const SharedColumn> columns,
                                            const std::string& title) {
  constexpr GnuplotPage kPage = {.width = 960, .height = 900};
  return DrawWithGnuplot(path, kPage, TrajectoryScript(ours, theirs, columns, title));
}

}  // namespace loopbench::harness
