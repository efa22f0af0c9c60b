// The forces of a description compiled for one space and scalar: a specialisation of ForceElement
// for each struct of mechanism/description/force.h, and the list of all.
//
// Everything is in ground axes. A wrench on a body is [moment; force] at its centre of mass; a
// force f at the point r from there adds [r x f; f]. These are the active forces of the paper
// (section 2), which enter zeta_i3 of its two-handle equations.
#pragma once

#include <algorithm>
#include <any>
#include <concepts>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "mechanism/algebra/dual.h"
#include "mechanism/algebra/space.h"
#include "mechanism/description/description.h"
#include "mechanism/description/time_function.h"

namespace loopbench {

template <class Space, class S>
class Kinematics;

/// Power [W] of the forces without a potential, at time(), position and speed:
///   d/dt (kinetic + potential) = supplied - dissipated
/// where the joints themselves do no work.
template <class S>
struct Power {
  S supplied = S(0);    ///< torques that depend on time, forces that turn with a body; any sign
  S dissipated = S(0);  ///< dampers and drag; >= 0
};

/// Built from a force and its valid description. Derives from ForceDefaults and has
/// AddWrenches(kinematics, wrenches), which adds [moment; force] body by body, and any overrides.
/// Its effect needs either a potential or power: otherwise the energy balance does not close.
template <class Space, class S, class Description>
class ForceElement;

template <class Space, class S>
struct ForceDefaults {
  /// Potential energy [J].
  S Potential(const Kinematics<Space, S>&) const { return S(0); }
  /// Adds supplied or dissipated power; called only if has_power().
  void AddPower(const Kinematics<Space, S>&, Power<S>&) const {}
  bool has_power() const { return false; }
  /// Times [s] at which it is not smooth.
  const std::vector<double>& knots() const {
    static const std::vector<double> none;
    return none;
  }
};

/// A description's 3-vector in the components of the space.
template <class Space, class S>
Linear<Space, S> ToLinear(const Eigen::Vector3d& v) {
  Linear<Space, S> linear;
  for (int i = 0; i < Space::kLin; ++i) linear[i] = S(v[i]);
  return linear;
}

/// A material point, in ground axes.
template <class Space, class S>
struct PointState {
  Linear<Space, S> r;  ///< from the centre of mass
  Linear<Space, S> p;  ///< from the ground origin
  Linear<Space, S> v;
};

/// A material point of a body.
template <class Space, class S>
struct PointOfBody {
  int body;
  Linear<Space, S> at;  ///< from the centre of mass, body axes

  PointOfBody(const BodyPoint& point, const MechanismDescription& description)
      : body(point.body), at(ToLinear<Space, S>(point.at - description.bodies[point.body].com)) {}

  PointState<Space, S> StateIn(const Kinematics<Space, S>& kinematics) const {
    const Pose<Space, S>& X_WB = kinematics.poses()[body];
    const Velocity<Space, S>& V = kinematics.motions()[body];
    PointState<Space, S> state;
    state.r = X_WB.R * at;
    state.p = X_WB.p + state.r;
    state.v = V.linear + Cross<S>(V.angular, state.r);
    return state;
  }

  /// Adds the force f at the point.
  void AddForce(const Linear<Space, S>& f, const PointState<Space, S>& state,
                std::span<Wrench<Space, S>> wrenches) const {
    wrenches[body] += {Moment<S>(state.r, f), f};
  }
};

/// The effort tau of a joint at Mo on Q, its opposite on P, both moved to the centres of mass.
template <class Space, class S>
void AddJointForce(const Kinematics<Space, S>& kinematics, int index, S tau,
                   std::span<Wrench<Space, S>> wrenches) {
  const auto& joint = kinematics.mechanism().joints()[index];
  const auto& state = kinematics.joints()[index];
  const Wrench<Space, S> F =
      WrenchOfEffort<Space, S>(state.H(0), joint.kind->inverse_H_squared, tau);
  wrenches[joint.to] += ShiftForce<Space, S>(F, state.r_Q);
  wrenches[joint.from] -= ShiftForce<Space, S>(F, state.r_P);
}

// Forces along the coordinate of a joint: torque, spring, damper.

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

// Forces at one point of a body: a constant one, drag.

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

// A spring and damper between points of two bodies.

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

// User-defined kinds (registry.h): their elements behind virtual functions, in double and in dual
// numbers.

/// Interface of a ForceElement of any kind.
template <class Space, class S>
class OtherElement {
 public:
  virtual ~OtherElement() = default;
  virtual void AddWrenches(const Kinematics<Space, S>& kinematics,
                           std::span<Wrench<Space, S>> wrenches) const = 0;
  virtual S Potential(const Kinematics<Space, S>& kinematics) const = 0;
  virtual void AddPower(const Kinematics<Space, S>& kinematics, Power<S>& power) const = 0;
  virtual bool has_power() const = 0;
  virtual const std::vector<double>& knots() const = 0;
};

/// Makes the element of a force, an OtherForce::force().
template <class Space, class S>
using MakeOtherElement = std::shared_ptr<const OtherElement<Space, S>> (*)(
    const std::any& force, const MechanismDescription& description);

struct ForceCompiler {
  std::tuple<MakeOtherElement<Planar, double>, MakeOtherElement<Planar, Dual>,
             MakeOtherElement<Spatial, double>, MakeOtherElement<Spatial, Dual>>
      make;
};

template <class Space, class S>
class ForceElement<Space, S, OtherForce> {
 public:
  ForceElement(OtherForce force, const MechanismDescription& description) {
    if constexpr (std::same_as<S, double> || std::same_as<S, Dual>) {
      const auto make = std::get<MakeOtherElement<Space, S>>(force.compiler().make);
      element_ = make(force.force(), description);
    } else {
      throw std::invalid_argument(
          "forces of kind \"" + std::string(PartsOf(force).name) +
          "\", which another program has registered, exist in double alone");
    }
  }

  const OtherElement<Space, S>& operator*() const { return *element_; }

 private:
  std::shared_ptr<const OtherElement<Space, S>> element_;
};

/// A force of any kind.
template <class Space, class S, class Descriptions = ForceDescription>
struct AnyForceElement;
template <class Space, class S, class... Descriptions>
struct AnyForceElement<Space, S, std::variant<Descriptions...>> {
  using Type = std::variant<ForceElement<Space, S, Descriptions>...>;
};

/// All forces of a mechanism, in the order of the description.
template <class Space, class S>
class ForceElements {
 public:
  ForceElements() = default;
  /// `description` must be valid.
  explicit ForceElements(const MechanismDescription& description) {
    for (const ForceDescription& force : description.forces) {
      std::visit(
          [&]<class Description>(const Description& one) {
            elements_.emplace_back(std::in_place_type<ForceElement<Space, S, Description>>, one,
                                   description);
          },
          force);
    }
  }

  /// Calls visit(element) for each.
  template <class Visit>
  void ForEach(Visit visit) const {
    for (const auto& element : elements_) {
      std::visit(
          [&](const auto& one) {
            if constexpr (requires { *one; }) {
              visit(*one);
            } else {
              visit(one);
            }
          },
          element);
    }
  }

  bool empty() const { return elements_.empty(); }
  /// Returns true if any force has no potential.
  bool has_power() const {
    bool any = false;
    ForEach([&](const auto& element) { any = any || element.has_power(); });
    return any;
  }
  /// Knots of all functions of time [s], ascending, each once.
  std::vector<double> Knots() const {
    std::vector<double> knots;
    ForEach([&](const auto& element) {
      knots.insert(knots.end(), element.knots().begin(), element.knots().end());
    });
    std::ranges::sort(knots);
    knots.erase(std::unique(knots.begin(), knots.end()), knots.end());
    return knots;
  }

 private:
  std::vector<typename AnyForceElement<Space, S>::Type> elements_;
};

}  // namespace loopbench
