// The standard figures of a store, and figures of precision runs and trajectories.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/figures/figures.h"
#include "harness/record/record.h"
#include "harness/trajectory/check.h"

namespace loopbench::harness {

// Which figures are made of records: motion, drift, and drift through singular positions. What
// they contain decides, never a name.

/// A figure and the name of its file without extension.
struct NamedFigure {
  std::string name;
  Figure figure;
};

/// Joint coordinates of one run against time: angles [rad], "series.angle.JOINT" against
/// "series.t", and displacements [m], "series.displacement.JOINT", in a panel of their own; or
/// those of the run's opening where it has them (harness/observers/observer.h). The title says so,
/// and names the run.
Figure MotionFigure(const Record& record);

/// Drift [m] of several runs of one mechanism against time on logarithmic axes: "series.drift", the
/// running maximum, against "series.drift_t", each run as figures.h has it. At its end stands the
/// fitted power with its spread, and a '?' when it is not resolved; a thin line through the data
/// shows a resolved one over the window that it was fitted in. A run that failed ends in a cross,
/// with its outcome.
Figure DriftFigure(std::span<const Record> records);

/// The same on a linear time axis, without fits: what a passage through a singular position does.
Figure SingularFigure(std::span<const Record> records);

/// All figures of the records that have series: for each mechanism and horizon the motion of one
/// run (that finished and is not in doubt, at level projection, at the finest tolerance, as far as
/// there is one), and for each mechanism, horizon and tolerance one of drift; through singular
/// positions where a run of them came near one. Runs that differ in integrator, experiment or a
/// parameter have figures of their own, with its value in their names.
std::vector<NamedFigure> AllFigures(std::span<const Record> records);

// Error and drift of runs in several scalars, against tolerance.

/// For each ladder error (lines) and drift (dashes) against tolerance, one colour per scalar. Runs
/// that failed are crosses at the lower edge.
std::vector<NamedFigure> PrecisionFigures(std::span<const Record> records);

// Two trajectories beside each other: both above, their difference below.

/// Both panels; columns that coincide are one curve. `columns` have one unit.
Figure TrajectoryFigure(const Trajectory& ours, const Trajectory& theirs,
                        std::span<const SharedColumn> columns, const std::string& title);

/// Draws them; nothing on success, else the reason (figures.h).
[[nodiscard]] std::optional<std::string> DrawTrajectories(const std::filesystem::path& path,
                                                          const Trajectory& ours,
                                                          const Trajectory& theirs,
                                                          std::span<const SharedColumn> columns,
                                                          const std::string& title);

}  // namespace loopbench::harness
