// Forces at one point of a body: a constant one, drag.
#pragma once

#include "mechanism/model/force_element.h"

namespace loopbench {

/// f in ground axes, with the potential -f . p; or R_WB f, turning with its body, which supplies
/// R_WB f . v.
template <class Space, class S>
class ForceElement<Space, S, PointForce> : public ForceDefaults<Space, S> {
 public:
  ForceElement(const PointForce& force, const MechanismDescription& description)
      : point_(force.point, description),
        force_(ToLinear<Space, S>(force.force)),
        in_body_axes_(force.in_body_axes) {}

  void AddWrenches(const Kinematics<Space, S>& kinematics,
                   std::span<Wrench<Space, S>> wrenches) const {
    point_.AddForce(InGround(kinematics), point_.StateIn(kinematics), wrenches);
  }
  S Potential(const Kinematics<Space, S>& kinematics) const {
    return in_body_axes_ ? S(0) : S(-force_.dot(point_.StateIn(kinematics).p));
  }
  void AddPower(const Kinematics<Space, S>& kinematics, Power<S>& power) const {
    power.supplied += InGround(kinematics).dot(point_.StateIn(kinematics).v);
  }
  bool has_power() const { return in_body_axes_; }

 private:
  Linear<Space, S> InGround(const Kinematics<Space, S>& kinematics) const {
    if (!in_body_axes_) return force_;
    return kinematics.poses()[point_.body].R * force_;
  }

  PointOfBody<Space, S> point_;
  Linear<Space, S> force_;
  bool in_body_axes_;
};

/// -(linear + quadratic |v|) v, which dissipates its size times |v|.
template <class Space, class S>
class ForceElement<Space, S, Drag> : public ForceDefaults<Space, S> {
 public:
  ForceElement(const Drag& drag, const MechanismDescription& description)
      : point_(drag.point, description), linear_(S(drag.linear)), quadratic_(S(drag.quadratic)) {}

  void AddWrenches(const Kinematics<Space, S>& kinematics,
                   std::span<Wrench<Space, S>> wrenches) const {
    const PointState<Space, S> state = point_.StateIn(kinematics);
    point_.AddForce(-Resistance(state.v) * state.v, state, wrenches);
  }
  void AddPower(const Kinematics<Space, S>& kinematics, Power<S>& power) const {
    const Linear<Space, S> v = point_.StateIn(kinematics).v;
    power.dissipated += Resistance(v) * v.squaredNorm();
  }
  bool has_power() const { return linear_ != S(0) || quadratic_ != S(0); }

 private:
  S Resistance(const Linear<Space, S>& v) const { return linear_ + quadratic_ * v.norm(); }

  PointOfBody<Space, S> point_;
  S linear_, quadratic_;
};

}  // namespace loopbench
