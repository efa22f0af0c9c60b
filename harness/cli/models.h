// Models of one problem: the full model and simpler ones, their certified motions, errors and
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

// Models of one problem: the full model, one per applicable rule, and all rules combined.

/// A model in the form in which it is written.
struct ProblemModel {
  std::string name;  ///< "full", a rule's name or "combined"; with a number if it has parts
  bool is_exact = true;
  MechanismDescription description;
  ObservedQuantities observe;
  std::vector<std::string> done, dropped;
  std::string assumption;
  Eigen::Matrix3d R_WC = Eigen::Matrix3d::Identity();
  std::string error;  ///< largest distance from the full model [m], if requested
  std::string worst;  ///< point with this error, or the reason why there is none
  std::int64_t rhs_evaluations = -1;
};

/// Result of each simplification rule on the full model, applicable or not, in rule order.
struct ProblemModels {
  std::vector<std::pair<const SimplificationRule*, Simplified>> ideas;
  /// Full model first, alone if no rule applies; last all rules combined, if several apply.
  std::vector<ProblemModel> models;
};

ProblemModels MakeModels(const MechanismFile& file,
                         const std::vector<const SimplificationRule*>& ideas, const ShortRun& run,
                         const SimplifyOptions& options);

/// Runs all models for `horizon` seconds with small steps, each with at most `cpu_s`, and sets
/// their errors.
void MeasureErrors(double horizon, double cpu_s, ProblemModels* ladder);

/// Name of the experiment file that runs all models: NAME-ladder.json.
std::string LadderFileName(const ProblemModels& ladder);

/// Writes NAME.json of all models, the experiment and models.md. All files are written next to the
/// folder and read back before it is renamed. With `force` they atomically replace files of these
/// names in an existing folder.
///
/// @throws ConfigError if the folder exists and is not empty, unless `force`; std::runtime_error if
/// something cannot be written.
void WriteModels(const ProblemModels& ladder, double horizon, const std::string& typed,
                 const std::filesystem::path& folder, bool force);

// Errors and costs of simpler models of one mechanism, as records of kind "model"
// (docs/reference/records.md).

struct ModelQuestion {
  double horizon = 0.0;  ///< [s]
  double accept = 0.0;   ///< largest acceptable error of a model [m]
  double cpu_s = 0.0;    ///< limit of one integration [s]
  std::string what;      ///< "my.json: --store", for messages
};

/// Returns a record for the full model and one per other model. All run alike (O-DCA, level
/// projection, joint coordinates, ode45 at 1e-8), without observers and in turn. The error of a
/// model is the largest distance of a named point between its certified motion and the full
/// model's. Acceptance adds both certificates to the error. A model that cannot be judged is
/// rejected with the reason.
std::vector<Record> RecordsOfModels(const MechanismFile& file, const ProblemModels& models,
                                    const ModelQuestion& question);

// Certified motion of a mechanism: the reference for advice and models.

struct CertainMotion {
  ReferenceOptions options = {};  ///< an experiment with them makes the same reference
  Reference reference = {};
  double horizon = 0.0;  ///< trust horizon [s], the end of error comparisons; 0: there is none
};

/// Computes a certified motion; each witness run may take `cpu_s`. If certification ends before
/// `horizon`, makes the reference again up to there until it is certified to its end. Throws
/// ConfigError in a program without wide scalars, which `what` needs.
CertainMotion MakeCertainMotion(const MechanismDescription& user, double horizon, double cpu_s,
                                const std::string& what);

// advise --simplify: simpler models of a problem within the accepted error, and their savings.

/// Largest distance of a model's certified motion from the full model's.
struct CausedError {
  double largest = 0.0;  ///< over the compared points, at times that both certify [m]
  std::string point;     ///< point with the largest distance
  int points = 0;        ///< number of compared points
  double until = 0.0;    ///< [s]
};

/// Compares points in the full model's axes. `names` are BODY.POINT; empty: all named points of the
/// full model that the other has.
CausedError ErrorOfModel(const MechanismDescription& whole, const Reference& whole_reference,
                         const ProblemModel& model, const Reference& reference,
                         const std::vector<std::string>& names);

}  // namespace loopbench::harness
