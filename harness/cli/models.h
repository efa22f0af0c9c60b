// Models of one scene: the whole one, one for each idea that applies, and all of them together.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "harness/config/scene.h"
#include "mechanism/simplify/model.h"

namespace loopbench::harness {

/// A model as it is written.
struct SceneModel {
  std::string name;  ///< "full", an idea's, "combined"; with a number where it has parts
  bool is_exact = true;
  MechanismDescription description;
  SceneObservation observe;
  std::vector<std::string> done, dropped;
  std::string assumption;
  Eigen::Matrix3d R_WC = Eigen::Matrix3d::Identity();
  std::string error;  ///< how far it moves from the whole model [m], where that was asked for
  std::string worst;  ///< the point that does, or why nothing is known
  std::int64_t rhs_evaluations = -1;
};

/// What each idea makes of the whole model, whether it applies or not, in the order of the ideas.
struct SceneModels {
  std::vector<std::pair<const Idea*, Simplified>> ideas;
  /// The whole model first, alone where nothing applies; all ideas together where several do.
  std::vector<SceneModel> models;
};

SceneModels MakeModels(const MechanismFile& file, const std::vector<const Idea*>& ideas,
                       const ShortRun& run, const SimplifyOptions& options);

/// Runs all models for `horizon` seconds in tight steps, each in at most `cpu_s`, and sets what
/// they are off by.
void MeasureErrors(double horizon, double cpu_s, SceneModels* ladder);

/// Bodies and named points of the whole model that another does not have, a line for each body:
/// where its points are by now, and which are gone.
std::vector<std::string> Gone(const MechanismDescription& whole,
                              const MechanismDescription& simplified);

/// The file of the experiment that runs all of them: NAME-ladder.json.
std::string LadderFileName(const SceneModels& ladder);

/// Writes NAME.json of all models, the experiment and ladder.md. All of them are written beside
/// the folder and read back before it takes its place; with `force` they take the places of files
/// of these names in a folder that is there, each at once.
///
/// @throws ConfigError when the folder is there and not empty, unless `force`;
/// std::runtime_error when something cannot be written.
void WriteModels(const SceneModels& ladder, double horizon, const std::string& typed,
                 const std::filesystem::path& folder, bool force);

}  // namespace loopbench::harness
