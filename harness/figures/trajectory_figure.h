// Two trajectories beside each other: both above, their difference below.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "harness/figures/figures.h"
#include "harness/trajectory/compare.h"

namespace loopbench::harness {

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
