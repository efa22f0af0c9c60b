// A Model built in Simbody.
#pragma once

#include <Simbody.h>

#include <vector>

#include "harness/exchange/export_simbody.h"

namespace loopbench::peers {

/// Relation between the coordinates of a mobilizer and of a joint of the Model.
struct Mobilizer {
  SimTK::MobilizedBody body;
  int q = 0, num_q = 0, u = 0, num_u = 0;  ///< indices of the Model's joint
  double sign = 1.0;                       ///< Model's coordinate = sign * Simbody's
};

struct SimbodyModel {
  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter{system};
  SimTK::GeneralForceSubsystem forces{system};
  std::vector<Mobilizer> mobilizers;  ///< flywheels, then in the order of Model::tree

  explicit SimbodyModel(const exchange::Model& model);
  SimbodyModel(const SimbodyModel&) = delete;
  SimbodyModel& operator=(const SimbodyModel&) = delete;

 private:
  void Add(const exchange::SimbodyMobilizer& mobilizer, const exchange::Joint& joint);
  void Add(const exchange::SimbodyConstraint& constraint, const exchange::Joint& joint);
  void Add(const exchange::SimbodyCoupler& coupler);
  void Add(const exchange::SimbodyForce& force);
  SimTK::MobilizedBody& BodyAt(int body) {
    return matter.updMobilizedBody(mobilized_[static_cast<std::size_t>(body)]);
  }

  std::vector<SimTK::MobilizedBodyIndex> mobilized_;  ///< by index of Model::bodies, then flywheels
};

}  // namespace loopbench::peers
