// Which figures are made of records: joint coordinates, drift, and drift through singular
// positions.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/figures/figures.h"
#include "harness/record/record.h"

namespace loopbench::harness {

/// A figure and the name of its file without extension.
struct NamedFigure {
  std::string name;
  Figure figure;
};

/// How figures draw a run: hue by formulation, its strength by coordinates, marks by level, filled
/// for a rank-revealing solver, dashed where it is in doubt.
CurveStyle StyleOf(const Record& record);

/// Angles [rad] of the joints of one run against time: "series.angle.JOINT" against "series.t", or
/// those of the run's opening where it has them (harness/observers/observer.h); the title says so,
/// and names the run.
Figure AnglesFigure(const Record& record);

/// The same of displacements [m], "series.displacement.JOINT".
Figure DisplacementsFigure(const Record& record);

/// Drift [m] of several runs of one mechanism against time on logarithmic axes: "series.drift", the
/// running maximum, against "series.drift_t". The legend gives the fitted exponent with its spread
/// (and a '?' when it is not resolved);
/// a grey line shows its slope. Hue tells the formulation, its strength the coordinates, marks the
/// level (circle acceleration, triangle velocity, square position, diamond baumgarte), filled ones
/// a rank-revealing solver; dashes a doubtful run. Formulations that agree to round-off hide each
/// other; so multipliers are drawn first and wide, and the others lie on them (FormulationLook). A
/// run that failed ends in a cross and is named in the legend.
Figure DriftFigure(std::span<const Record> records);

/// The same on a linear time axis, without fits: what a passage through a singular position does.
Figure SingularFigure(std::span<const Record> records);

/// All figures of the records that have series: for each mechanism and horizon one of angles and
/// one of displacements, as far as there are any, of one run (that finished and is not in doubt, at
/// level position, at the finest tolerance, as far as there is one), and for each mechanism,
/// horizon and tolerance one of drift; through singular positions where a run of them came near
/// one.
std::vector<NamedFigure> AllFigures(std::span<const Record> records);

}  // namespace loopbench::harness
