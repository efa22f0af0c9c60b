// What the commands that show records share: provenance, files that are kept, figures.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "harness/figures/figure_recipes.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

void AppendProvenance(Table& table, const std::string& typed);

/// A table for a file. CSV goes without the date of printing: the same records and command give the
/// same bytes.
std::string RenderKept(Table table, const std::string& format);

/// Draws those that can be drawn into a folder, as svg or pdf; the reasons of the others are
/// printed, and the exit code is 2.
int DrawAll(const std::vector<NamedFigure>& figures, const std::filesystem::path& folder,
            const std::string& format, FigureSize size);

/// By name: "one-column", "two-column".
const std::map<std::string, FigureSize>& FigureSizes();

}  // namespace loopbench::harness
