// The loops of a mechanism in joint coordinates, whatever coordinates are integrated.
#pragma once

#include <memory>

#include "mechanism/model/kinematics.h"

namespace loopbench::harness {

template <class Space>
class JointView {
 public:
  /// `mechanism` is made of `description` and must outlive the view. Loops are seen with all that
  /// their joints constrain, or without what was released as redundant at every position.
  JointView(const MechanismDescription& description, const Mechanism<Space, double>& mechanism,
            bool with_released)
      : mechanism_(&mechanism) {
    const bool same = !with_released || mechanism.released().empty();
    if (mechanism.coordinates() == Coordinates::kJoint && same) return;
    own_ = std::make_unique<Mechanism<Space, double>>(
        with_released ? Unreleased(description) : description, Coordinates::kJoint);
    mechanism_ = own_.get();
    kinematics_ = std::make_unique<Kinematics<Space, double>>(*own_);
  }

  const Mechanism<Space, double>& mechanism() const { return *mechanism_; }

  /// Current positions: `kinematics` itself in joint coordinates, else the tree of user joints
  /// followed with the coordinates measured between its bodies.
  const Kinematics<Space, double>& At(const Kinematics<Space, double>& kinematics) {
    if (!own_) return kinematics;
    if (!own_->released().empty() && kinematics.released() != kinematics_->released()) {
      kinematics_->Release(kinematics.released());
    }
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
