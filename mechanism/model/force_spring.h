// A spring and damper between points of two bodies.
#pragma once

#include "mechanism/model/force_element.h"

namespace loopbench {

/// The tension preload + stiffness s + damping s', s the stretch, pulls `from` along the direction
/// to `to`, and `to` the other way. Its potential is stiffness s^2 / 2 + preload s; damping
/// dissipates damping s'^2.
template <class Space, class S>
class ForceElement<Space, S, SpringDamper> : public ForceDefaults<Space, S> {
 public:
  ForceElement(const SpringDamper& spring, const MechanismDescription& description)
      : from_(spring.from, description),
        to_(spring.to, description),
        stiffness_(S(spring.stiffness)),
        damping_(S(spring.damping)),
        length_(S(spring.length)),
        preload_(S(spring.preload)) {}

  void AddWrenches(const Kinematics<Space, S>& kinematics,
                   std::span<Wrench<Space, S>> wrenches) const {
    const State state = StateIn(kinematics);
    const S tension = preload_ + stiffness_ * (state.distance - length_) + damping_ * state.rate;
    const Linear<Space, S> f = tension * state.direction;
    from_.AddForce(f, state.from, wrenches);
    to_.AddForce(-f, state.to, wrenches);
  }
  S Potential(const Kinematics<Space, S>& kinematics) const {
    const S stretch = StateIn(kinematics).distance - length_, half = S(1) / S(2);
    return (half * stiffness_ * stretch + preload_) * stretch;
  }
  void AddPower(const Kinematics<Space, S>& kinematics, Power<S>& power) const {
    const S rate = StateIn(kinematics).rate;
    power.dissipated += damping_ * rate * rate;
  }
  bool has_power() const { return damping_ != S(0); }

 private:
  /// If the points coincide, the direction is zero, and with it all forces.
  struct State {
    PointState<Space, S> from, to;
    S distance, rate;
    Linear<Space, S> direction;  ///< of unit length, from `from` to `to`
  };

  State StateIn(const Kinematics<Space, S>& kinematics) const {
    State state{from_.StateIn(kinematics), to_.StateIn(kinematics), {}, {}, {}};
    const Linear<Space, S> apart = state.to.p - state.from.p;
    state.distance = apart.norm();
    state.direction.setZero();
    if (state.distance > S(0)) state.direction = apart / state.distance;
    state.rate = state.direction.dot(state.to.v - state.from.v);
    return state;
  }

  PointOfBody<Space, S> from_, to_;
  S stiffness_, damping_, length_, preload_;
};

}  // namespace loopbench
