// Common data of every entry that a program adds before it calls loopbench::Main(): a joint kind or
// a force (mechanism/model/registry.h), a level (mechanism/formulation/level.h), a formulation
// (harness/config/formulations.h) or an observer (harness/observers/registry.h).
#pragma once

#include <Eigen/Core>
#include <string_view>

namespace loopbench {

struct NewRow {
  std::string_view kind;  ///< "level"
  std::string_view name;
  bool is_taken = false;  ///< the name
  bool has_sentence = true;
  bool has_factories = true;
  int alignment = 0;  ///< EIGEN_MAX_STATIC_ALIGN_BYTES at compilation of the entry
};

/// Throws std::invalid_argument if a name is no word or already used, or if the sentence or factory
/// is missing. Also throws if the entry has another alignment of Eigen's types than this library.
/// Memory layouts then differ because the target loopbench::loopbench was not linked
/// (cmake/install.cmake).
void RequireSound(const NewRow& row);

/// Throws std::invalid_argument: KIND "NAME": found FOUND, expected EXPECTED.
[[noreturn]] void RefuseRow(std::string_view kind, std::string_view name, std::string_view found,
                            std::string_view expected);

}  // namespace loopbench
