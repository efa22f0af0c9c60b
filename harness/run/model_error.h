// How far a simplified model moves from the whole one, and what it takes (mechanism/simplify/).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mechanism/simplify/model.h"

namespace loopbench::harness {

/// Named points of bodies at equal times, ground axes [m].
struct Track {
  std::string failure;  ///< why there is none
  std::vector<double> times;
  std::vector<std::vector<Eigen::Vector3d>> points;  ///< by time, in the order of `names`
  std::vector<std::string> names;                    ///< "<body>.<point>"
  std::int64_t rhs_evaluations = 0;
};

/// Runs the model by multipliers at level position, dormand-prince at 1e-10. Steps end at the
/// times that are looked at. `whole` says which points: those of its bodies by their names in the
/// model (FindPoint), where the model has them.
Track TrackOf(const MechanismDescription& model, const Eigen::Matrix3d& R_WC,
              const MechanismDescription& whole, double horizon, double cpu_s);

struct ModelError {
  double distance = 0.0;  ///< the largest of any common point at any time [m]
  std::string point;      ///< which
  int points = 0;         ///< compared
};
ModelError Compare(const Track& whole, const Track& model);

}  // namespace loopbench::harness
