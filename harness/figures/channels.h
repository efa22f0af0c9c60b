// How runs look in all figures: one channel of a curve for each property of a method.
//
// | channel | property |
// |---|---|
// | colour | formulation (FormulationRow::color) |
// | dashes | level of enforcement: solid acceleration, long dashes velocity, dots position, ... |
// | marks | coordinates: circles joint, triangles absolute |
// | width | solver: thin as published, else thick |
// | hollow marks | in doubt |
#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/figures/figures.h"
#include "harness/record/record.h"

namespace loopbench::harness {

/// The keys of records that have a channel, in the order of labels.
inline constexpr const char* kChannelKeys[] = {"formulation", "enforcement", "coordinates",
                                               "solver"};

CurveStyle StyleOf(const Record& record);

/// The values of those channel keys that vary among `all`: "odca, joint". The formulation if none
/// does.
std::string MethodLabel(const Record& record, std::span<const Record> all);

/// What colours, dashes, marks and widths mean, of the values that `records` have: a row for
/// formulations, one for levels, one for coordinates and solvers; of levels, coordinates and
/// solvers only where they vary.
std::vector<LegendRow> ChannelLegend(std::span<const Record> records);

/// Whether the values of a key differ.
bool Varies(std::span<const Record> records, const std::string& key);

}  // namespace loopbench::harness
