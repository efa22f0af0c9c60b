// Output of explain: tables that fit the terminal.
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

// Output of explain: tables that fit the terminal.

/// Amount and width of the output of explain.
struct ExplainView {
  bool all = false;  ///< all rows; else the first rows of long tables and the number of others
  /// Width of the terminal [cells]; 0: unlimited; nullopt: there is no terminal.
  std::optional<std::size_t> width = {};
  /// Document that gets the sections under their keys (--json) instead of the terminal.
  JsonObject* document = nullptr;
};

/// Returns the view of standard output.
ExplainView ViewOfOutput(bool all);

/// Prints a sentence for people, unless there is a document.
template <typename... Values>
void Say(const ExplainView& view, fmt::format_string<internal::PrintedAs<Values>...> format,
         const Values&... values) {
  if (view.document == nullptr) Print<Values...>(format, values...);
}

/// Prints a title and an indented table, as wide as the terminal. Without a terminal, breaks the
/// last column into lines that end at 100 characters. In a document, stores all rows under `key`,
/// if it has one.
void PrintSection(const std::string& title, const Table& table, const ExplainView& view,
                  const char* key = "");

/// Formats a number with six digits; -0 is 0.
std::string ShortNumber(double value);
/// Formats a vector as "1 0.5 -2".
template <class Vector>
std::string Spaced(const Vector& vector) {
  std::string text;
  for (Eigen::Index i = 0; i < vector.size(); ++i) {
    text += (i == 0 ? "" : " ") + ShortNumber(vector[i]);
  }
  return text;
}

/// Prints the model, the start and the structure of a mechanism. Returns 2, after all other output,
/// if the start cannot be assembled.
int ExplainMechanism(const std::filesystem::path& path, const ExplainView& view);

/// Prints the contents of a file: gravity, bodies, joints, their frames, forces.
void PrintModel(const MechanismDescription& description, const Structure& structure,
                const ExplainView& view);

/// Prints the assembled start: coordinates and speeds of all joints, energy.
void PrintStart(const MechanismDescription& description, const Structure& structure,
                const ExplainView& view);

}  // namespace loopbench::harness
