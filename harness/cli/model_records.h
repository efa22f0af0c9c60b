// What simpler models of one mechanism cause and what they take, as records of kind "model"
// (docs/reference/records.md).
#pragma once

#include <string>
#include <vector>

#include "harness/cli/models.h"
#include "harness/record/record.h"

namespace loopbench::harness {

struct ModelQuestion {
  double horizon = 0.0;  ///< [s]
  double accept = 0.0;   ///< error that a model may cause [m]
  double cpu_s = 0.0;    ///< of one integration [s]
  std::string what;      ///< "my.json: --store", for messages
};

/// A record for the whole model and one for each other, all run alike (O-DCA, level position, joint
/// coordinates, ode45 at 1e-8), bare and in turn. The error that a model causes is the largest
/// distance of a named point of its certified motion from the whole one's; both certificates are
/// part of what it is accepted by. A model that cannot be judged is refused with the reason.
std::vector<Record> RecordsOfModels(const MechanismFile& file, const SceneModels& models,
                                    const ModelQuestion& question);

}  // namespace loopbench::harness
