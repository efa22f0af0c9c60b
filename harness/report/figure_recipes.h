// Which figures are made of records: angles, drift, and drift through singular positions.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/record.h"
#include "harness/report/figures.h"

namespace loopbench::harness {

/// A figure and the name of its file without extension.
struct NamedFigure {
  std::string name;
  Figure figure;
};

/// Angles [rad] of one run against time: "series.angle.<joint>" against "series.t".
Figure AnglesFigure(const Record& record);

/// Drift [m] of several runs of one mechanism against time on logarithmic axes: "series.drift", the
/// running maximum, against "series.drift_t". The legend gives the fitted exponent with its spread
/// (and a '?' when it is not resolved);
/// a grey line shows its slope. Colour tells formulation and level, dashes tell coordinates and
/// solver. Formulations that agree to round-off hide each other; so multipliers are drawn first and
/// wide, and the others lie on them. A run that failed ends in a cross and is named in the legend.
Figure DriftFigure(std::span<const Record> records);

/// The same on a linear time axis, without fits: what a passage through a singular position does.
Figure SingularFigure(std::span<const Record> records);

/// All figures of the records that have series: for each mechanism and horizon one of angles (of
/// O-DCA in joint coordinates at the finest tolerance where there is one), and for each mechanism,
/// horizon and tolerance one of drift; through singular positions for the scenes that have them.
std::vector<NamedFigure> AllFigures(std::span<const Record> records);

}  // namespace loopbench::harness
