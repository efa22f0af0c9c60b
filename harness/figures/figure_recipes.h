// The standard figures of a store, and figures of precision runs and trajectories.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/figures/figures.h"
#include "harness/record/record.h"
#include "harness/trajectory/check.h"

namespace loopbench::harness {

// Figures made of records: motion, drift, and drift through singular configurations. The contents
// of the records decide, never a name.

/// A figure and the name of its file without extension.
struct NamedFigure {
  std::string name;
  Figure figure;
};

/// Joint coordinates of one run against time. Angles [rad] are "series.angle.JOINT" against
/// "series.t"; displacements [m] have their own panel, "series.displacement.JOINT". If the run has
/// series of its opening, they are used (harness/observers/observer.h). The title names this and
/// the run.
Figure MotionFigure(const Record& record);

/// Drift [m] of several runs of one mechanism against time on logarithmic axes: the running maximum
/// "series.drift" against "series.drift_t", in the styles of figures.h. At the end of a curve is
/// the fitted power with its spread, and '?' if it is not resolved. A thin line shows a resolved
/// power over its fit window. A failed run ends in a cross with its outcome.
Figure DriftFigure(std::span<const Record> records);

/// Drift on a linear time axis, without fits: effect of passing a singular configuration.
Figure SingularFigure(std::span<const Record> records);

/// All figures of the records with series. Each mechanism and horizon has the motion of one run:
/// finished, without warnings, at level projection, at the finest tolerance, if possible. Each
/// mechanism, horizon and tolerance has a drift figure, or one of singular configurations if a run
/// came near one. Runs that differ in integrator, experiment or a parameter have separate figures,
/// named with its value.
std::vector<NamedFigure> AllFigures(std::span<const Record> records);

// Error and drift of runs in several scalars, against tolerance.

/// Draws error (lines) and drift (dashes) of each ladder against tolerance, one colour per scalar.
/// Failed runs are crosses at the lower edge.
std::vector<NamedFigure> PrecisionFigures(std::span<const Record> records);

// Two trajectories: both in the upper panel, their difference in the lower one.

/// Makes both panels; columns that coincide are one curve. `columns` have one unit.
Figure TrajectoryFigure(const Trajectory& ours, const Trajectory& theirs,
                        std::span<const SharedColumn> columns, const std::string& title);

}  // namespace loopbench::harness
