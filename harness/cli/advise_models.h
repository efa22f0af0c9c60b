// advise --simplify: which simpler models of a scene keep the error that was asked for, and what
// they save.
#pragma once

#include <string>
#include <vector>

#include "harness/advise/advise.h"
#include "harness/cli/models.h"

namespace loopbench::harness {

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
