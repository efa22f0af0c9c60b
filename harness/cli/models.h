// Models of one scene: the whole one and simpler ones, their certified motions, errors and
// records.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "harness/advise/advise.h"
#include "harness/config/mechanism_reader.h"
#include "harness/record/record.h"
#include "harness/reference/reference.h"
#include "mechanism/simplify/model.h"

namespace loopbench::harness {

// Models of one scene: the whole one, one for each idea that applies, and all of them together.

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

/// Writes NAME.json of all models, the experiment and models.md. All of them are written beside
/// the folder and read back before it takes its place; with `force` they take the places of files
/// of these names in a folder that is there, each at once.
///
/// @throws ConfigError when the folder is there and not empty, unless `force`;
/// std::runtime_error when something cannot be written.
void WriteModels(const SceneModels& ladder, double horizon, const std::string& typed,
                 const std::filesystem::path& folder, bool force);

// What simpler models of one mechanism cause and what they take, as records of kind "model"
// (docs/reference/records.md).

struct ModelQuestion {
  double horizon = 0.0;  ///< [s]
  double accept = 0.0;   ///< error that a model may cause [m]
  double cpu_s = 0.0;    ///< of one integration [s]
  std::string what;      ///< "my.json: --store", for messages
};

/// A record for the whole model and one for each other, all run alike (O-DCA, level projection,
/// joint coordinates, ode45 at 1e-8), bare and in turn. The error that a model causes is the
/// largest distance of a named point of its certified motion from the whole one's; both
/// certificates are part of what it is accepted by. A model that cannot be judged is refused with
/// the reason.
std::vector<Record> RecordsOfModels(const MechanismFile& file, const SceneModels& models,
                                    const ModelQuestion& question);

// The motion of a mechanism as far as it is certified: what advice and models are judged by.

struct CertainMotion {
  ReferenceOptions options = {};  ///< an experiment with them makes the same reference
  Reference reference = {};
  double horizon = 0.0;  ///< [s], its trust horizon, which errors are taken up to; 0: there is none
};

/// Each of the witnesses may take `cpu_s`. Where certification ends before `horizon` the reference
/// is made again up to there, until it is certified to its end. Throws ConfigError in a program
/// without wide scalars, which `what` needs.
CertainMotion MakeCertainMotion(const MechanismDescription& user, double horizon, double cpu_s,
                                const std::string& what);

// advise --simplify: which simpler models of a scene keep the error that was asked for, and what
// they save.

/// How far a model's certified motion gets from the whole one's.
struct CausedError {
  double largest = 0.0;  ///< of the points compared, at times that both are certified at [m]
  std::string point;     ///< which
  int points = 0;        ///< compared
  double until = 0.0;    ///< [s]
};

/// `names` are BODY.POINT; empty: all named points of the whole model that the other has. In the
/// whole model's axes.
CausedError ErrorOfModel(const MechanismDescription& whole, const Reference& whole_reference,
                         const SceneModel& model, const Reference& reference,
                         const std::vector<std::string>& names);

}  // namespace loopbench::harness
