// Forces along the coordinate of a joint: torque, spring, damper.
#pragma once

#include "mechanism/description/time_function.h"
#include "mechanism/model/force_element.h"

namespace loopbench {

/// tau = value(t). A constant one has the potential -value q, another supplies value u.
template <class Space, class S>
class ForceElement<Space, S, JointTorque> : public ForceDefaults<Space, S> {
 public:
  ForceElement(const JointTorque& torque, const MechanismDescription&)
      : joint_(torque.joint), value_(torque.value) {
    const auto* polynomial = std::get_if<Polynomial>(&torque.value);
    is_constant_ = polynomial != nullptr && polynomial->coefficients.size() == 1;
    if (is_constant_) constant_ = S(polynomial->coefficients[0]);
  }

  void AddWrenches(const Kinematics<Space, S>& kinematics,
                   std::span<Wrench<Space, S>> wrenches) const {
    AddJointForce<Space, S>(kinematics, joint_, At(kinematics), wrenches);
  }
  S Potential(const Kinematics<Space, S>& kinematics) const {
    return is_constant_ ? S(-constant_ * kinematics.JointCoordinate(joint_)) : S(0);
  }
  void AddPower(const Kinematics<Space, S>& kinematics, Power<S>& power) const {
    power.supplied += At(kinematics) * kinematics.JointSpeed(joint_);
  }
  bool has_power() const { return !is_constant_; }
  const std::vector<double>& knots() const { return value_.knots(); }

 private:
  S At(const Kinematics<Space, S>& kinematics) const {
    return is_constant_ ? constant_ : S(value_.At(kinematics.time()).value);
  }

  int joint_;
  TimeFunction value_;
  bool is_constant_ = false;
  S constant_ = S(0);
};

/// tau = preload - stiffness (q - rest), with the potential stiffness (q - rest)^2 / 2 - preload q.
template <class Space, class S>
class ForceElement<Space, S, JointSpring> : public ForceDefaults<Space, S> {
 public:
  ForceElement(const JointSpring& spring, const MechanismDescription&)
      : joint_(spring.joint),
        stiffness_(S(spring.stiffness)),
        rest_(S(spring.rest)),
        preload_(S(spring.preload)) {}

  void AddWrenches(const Kinematics<Space, S>& kinematics,
                   std::span<Wrench<Space, S>> wrenches) const {
    const S tau = preload_ - stiffness_ * (kinematics.JointCoordinate(joint_) - rest_);
    AddJointForce<Space, S>(kinematics, joint_, tau, wrenches);
  }
  S Potential(const Kinematics<Space, S>& kinematics) const {
    const S q = kinematics.JointCoordinate(joint_), half = S(1) / S(2);
    return half * stiffness_ * (q - rest_) * (q - rest_) - preload_ * q;
  }

 private:
  int joint_;
  S stiffness_, rest_, preload_;
};

/// tau = -damping u, which dissipates damping u^2.
template <class Space, class S>
class ForceElement<Space, S, JointDamper> : public ForceDefaults<Space, S> {
 public:
  ForceElement(const JointDamper& damper, const MechanismDescription&)
      : joint_(damper.joint), damping_(S(damper.damping)) {}

  void AddWrenches(const Kinematics<Space, S>& kinematics,
                   std::span<Wrench<Space, S>> wrenches) const {
    AddJointForce<Space, S>(kinematics, joint_, -damping_ * kinematics.JointSpeed(joint_),
                            wrenches);
  }
  void AddPower(const Kinematics<Space, S>& kinematics, Power<S>& power) const {
    const S u = kinematics.JointSpeed(joint_);
    power.dissipated += damping_ * u * u;
  }
  bool has_power() const { return damping_ != S(0); }

 private:
  int joint_;
  S damping_;
};

}  // namespace loopbench
