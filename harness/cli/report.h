// What the commands that show records share: colour, provenance, files that are kept, figures.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/figures/figure_recipes.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

/// Colour only where a person looks: a terminal that has it, unless https://no-color.org is obeyed.
bool TerminalHasColour();

void AppendProvenance(Table& table, const std::string& typed);

/// A table for a file. CSV goes without the date of printing: the same records and command give the
/// same bytes.
std::string RenderKept(Table table, const std::string& format);

/// Draws those that can be drawn into a folder, as svg or pdf; the reasons of the others are
/// printed, and the exit code is 2.
int DrawAll(const std::vector<NamedFigure>& figures, const std::filesystem::path& folder,
            const std::string& format);

}  // namespace loopbench::harness
