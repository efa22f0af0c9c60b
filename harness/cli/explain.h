// What the parts of explain share: how its tables fit the terminal.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/record/record.h"
#include "harness/tables/table.h"
#include "harness/text/terminal.h"
#include "mechanism/simplify/structure.h"

namespace loopbench::harness {

// What the parts of explain share: how its tables fit the terminal.

/// How much of a mechanism explain shows, and how wide.
struct ExplainView {
  bool all = false;  ///< else the first rows of long tables, and how many more there are
  /// Of the terminal [cells], 0: as wide as it takes; none: there is no terminal.
  std::optional<std::size_t> width = {};
  /// Where sections go instead, under their keys: --json.
  JsonObject* document = nullptr;
};

/// Of standard output.
ExplainView ViewOfOutput(bool all);

/// A sentence for people.
template <typename... Values>
void Say(const ExplainView& view, fmt::format_string<internal::PrintedAs<Values>...> format,
         const Values&... values) {
  if (view.document == nullptr) Print<Values...>(format, values...);
}

/// Title and table, indented, as wide as the terminal; without one the last column is broken into
/// lines that end at 100 characters.
/// In a document all rows stand under `key`, if it has one.
void PrintSection(const std::string& title, const Table& table, const ExplainView& view,
                  const char* key = "");

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
