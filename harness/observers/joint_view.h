// The loops of a mechanism in joint coordinates, whatever coordinates are integrated, with all that
// their joints constrain, released or not.
#pragma once

#include <memory>

#include "mechanism/kinematics.h"

namespace loopbench::harness {

template <class Space>
class JointView {
 public:
  /// `mechanism` is made of `description` and must outlive the view.
  JointView(const MechanismDescription& description, const Mechanism<Space, double>& mechanism)
      : mechanism_(&mechanism) {
    if (mechanism.coordinates() == Coordinates::kJoint && mechanism.released().empty()) return;
    own_ = std::make_unique<Mechanism<Space, double>>(Unreleased(description), Coordinates::kJoint);
    mechanism_ = own_.get();
    kinematics_ = std::make_unique<Kinematics<Space, double>>(*own_);
  }

  const Mechanism<Space, double>& mechanism() const { return *mechanism_; }

  /// Current positions: `kinematics` itself in joint coordinates, else the tree of user joints
  /// followed with the coordinates measured between its bodies.
  const Kinematics<Space, double>& At(const Kinematics<Space, double>& kinematics) {
    if (!own_) return kinematics;
    kinematics_->SetTime(kinematics.time());
    kinematics_->UpdatePosition(kinematics.CoordinatesIn(*own_));
    return *kinematics_;
  }

 private:
  const Mechanism<Space, double>* mechanism_;
  std::unique_ptr<Mechanism<Space, double>> own_;
  std::unique_ptr<Kinematics<Space, double>> kinematics_;
};

}  // namespace loopbench::harness
