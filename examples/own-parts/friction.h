// A force that Loopbench does not have: dry friction in a joint, which is smooth where the joint
// stands still,
//
//   tau = -effort u / sqrt(u^2 + speed^2),
//
// with u the joint's speed. It dissipates -tau u.
#pragma once

#include <cmath>

#include "mechanism/model/kinematics.h"
#include "mechanism/model/registry.h"

namespace own {

struct Friction {
  int joint = 0;
  double effort = 0.0;  ///< at high speeds [N m or N]
  double speed = 0.0;   ///< below which it is soft [rad/s or m/s]
};

inline loopbench::ForceParts PartsOf(Friction& f) {
  using namespace loopbench;
  constexpr Quantity kSpeed = {"rad/s", "m/s", 0, 1};
  return {.name = "joint_friction",
          .sentence = "-effort u / sqrt(u^2 + speed^2) on the joint's speed u.",
          .joint = &f.joint,
          .numbers = {{"effort", &f.effort, quantity::kEffort, Need::kAlways},
                      {"speed", &f.speed, kSpeed, Need::kAlways, "Below which it is soft"}}};
}

}  // namespace own

template <class Space, class S>
class loopbench::ForceElement<Space, S, own::Friction> : public ForceDefaults<Space, S> {
 public:
  ForceElement(const own::Friction& friction, const MechanismDescription&)
      : joint_(friction.joint), effort_(S(friction.effort)), speed_(S(friction.speed)) {}

  void AddWrenches(const Kinematics<Space, S>& kinematics,
                   std::span<Wrench<Space, S>> wrenches) const {
    AddJointForce<Space, S>(kinematics, joint_, At(kinematics), wrenches);
  }
  void AddPower(const Kinematics<Space, S>& kinematics, Power<S>& power) const {
    power.dissipated -= At(kinematics) * kinematics.JointSpeed(joint_);
  }
  bool has_power() const { return effort_ != S(0); }

 private:
  S At(const Kinematics<Space, S>& kinematics) const {
    using std::sqrt;
    const S u = kinematics.JointSpeed(joint_), size = sqrt(u * u + speed_ * speed_);
    return size > S(0) ? -effort_ * u / size : S(0);
  }

  int joint_;
  S effort_, speed_;
};
