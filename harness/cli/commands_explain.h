// What the parts of explain share: how its tables fit the terminal.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "harness/tables/table.h"
#include "mechanism/simplify/structure.h"

namespace loopbench::harness {

/// How much of a mechanism explain shows, and how wide.
struct ExplainView {
  bool all = false;         ///< else the first rows of long tables, and how many more there are
  std::size_t width = 100;  ///< of the terminal [characters]
};

/// The terminal's own width where there is one.
ExplainView ViewOfTerminal(bool all);

/// Title and table, indented; the last column is broken into several lines where it is too wide.
void PrintSection(const std::string& title, const Table& table, const ExplainView& view);

/// Six digits; -0 is 0.
std::string ShortNumber(double value);
/// "1 0.5 -2".
template <class Vector>
std::string Spaced(const Vector& vector) {
  std::string text;
  for (Eigen::Index i = 0; i < vector.size(); ++i) {
    text += (i == 0 ? "" : " ") + ShortNumber(vector[i]);
  }
  return text;
}

/// Prints what a mechanism is made of, its start and its structure; 2 when the start cannot be
/// assembled, after all else.
int ExplainMechanism(const std::filesystem::path& path, const ExplainView& view);

/// What a file says: gravity, bodies, joints, their frames, forces.
void PrintModel(const MechanismDescription& description, const Structure& structure,
                const ExplainView& view);

/// What the assembly made of it: coordinates and speeds of all joints, energy.
void PrintStart(const MechanismDescription& description, const Structure& structure,
                const ExplainView& view);

}  // namespace loopbench::harness
