#include "mechanism/formulation/options.h"

#include <algorithm>

#include "mechanism/description/registration.h"
#include "mechanism/formulation/level.h"

namespace loopbench {

namespace {

/// In the order of Enforcement.
std::deque<LevelTraits>& Rows() {
  static std::deque<LevelTraits> rows = {
      {"acceleration",
       "constraints of accelerations are imposed (index 1); errors of positions and speeds "
       "accumulate.",
       DriftGrowth::kSquare, "acc", true},
      {"velocity", "speeds satisfy the constraints, too; positions follow by integration.",
       DriftGrowth::kLinear, "vel", true},
      {"projection",
       "as acceleration; after each accepted step, positions and speeds are projected onto the "
       "constraints.",
       DriftGrowth::kNone, "proj", true},
      {"baumgarte",
       "as acceleration, with feedback: a violation e obeys e'' + 2 alpha e' + beta^2 e = 0; by "
       "default alpha = beta = 0.05 / longest step.",
       DriftGrowth::kForgotten, "baumgarte", true}};
  return rows;
}

}  // namespace

const std::deque<LevelTraits>& Levels() { return Rows(); }

std::vector<std::string> LevelNames() {
  std::vector<std::string> names;
  for (const LevelTraits& level : Rows()) names.push_back(level.name);
  return names;
}

const LevelTraits& TraitsOf(Enforcement level) {
  return Rows().at(static_cast<std::size_t>(level));
}

std::optional<Enforcement> FindLevel(std::string_view name) {
  const auto level = std::ranges::find(Rows(), name, &LevelTraits::name);
  if (level == Rows().end()) return std::nullopt;
  return static_cast<Enforcement>(level - Rows().begin());
}

Enforcement RegisterLevel(LevelRow row, int alignment) {
  LevelTraits& traits = row.traits;
  RequireSound({.kind = "level",
                .name = traits.name,
                .is_taken = FindLevel(traits.name).has_value(),
                .has_sentence = !traits.sentence.empty(),
                .has_factories = row.planar && row.spatial,
                .alignment = alignment});
  if (traits.abbreviation.empty()) traits.abbreviation = traits.name;
  LevelFactories<Planar, double>().push_back(std::move(row.planar));
  LevelFactories<Spatial, double>().push_back(std::move(row.spatial));
  Rows().push_back(std::move(traits));
  return static_cast<Enforcement>(Rows().size() - 1);
}

std::string_view ToString(Enforcement level) { return TraitsOf(level).name; }

std::string_view ToString(SolverKind solver) {
  return solver == SolverKind::kAsPublished ? "plain" : "rank-revealing";
}

}  // namespace loopbench
