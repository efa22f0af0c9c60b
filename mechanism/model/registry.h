// User-defined kinds of joints and forces. A program registers them before any mechanism is read,
// best at the start of main() (examples/own-parts/). Their names are then valid in files, messages,
// `explain` and tables, like the built-in kinds.
//
//   template <class Space, class S>
//   struct RackAndPinion { static JointKind<Space, S> Make(); };      // contents: joint.h
//   RegisterJoint<RackAndPinion>({.name = "rack-and-pinion", .in_plane = true, ...});
//
//   struct Friction { int joint; double moment, speed; };             // as in force.h, with
//   ForceParts PartsOf(Friction& f);                                  // its parts and
//   template <class Space, class S>                                   // its mechanics
//   class loopbench::ForceElement<Space, S, Friction> : ForceDefaults<Space, S> { ... };
//   RegisterForce<Friction>();
//
// Both are templates on the scalar: the library evaluates them in double, and in dual numbers for
// derivatives. Precision studies (harness/precision/) support only the built-in kinds.
#pragma once

#include "mechanism/description/joint_type.h"
#include "mechanism/model/force_elements.h"
#include "mechanism/model/joint.h"

namespace loopbench {

/// A kind's functions in all that the library evaluates.
struct JointKindSet {
  JointKind<Planar, double> planar;
  JointKind<Planar, Dual> planar_dual;
  JointKind<Spatial, double> spatial;
  JointKind<Spatial, Dual> spatial_dual;
};

/// Adds a kind. Throws std::invalid_argument if the entry is invalid (description/registration.h)
/// or the kind is inconsistent. The check evaluates its functions, for parameter 0.3 if it has one.
/// H must be the derivative of the transform along the rates, D its orthogonal complement, the bias
/// the derivative of H u; `coordinates` must recover admissible poses. The texts of `traits` must
/// outlive all use.
JointType RegisterJoint(const JointTraits& traits, const JointKindSet& kinds,
                        int alignment = EIGEN_MAX_STATIC_ALIGN_BYTES);

/// The same with Kind<Space, S>::Make(), which gives {} for the plane if the traits have no plane.
template <template <class Space, class S> class Kind>
JointType RegisterJoint(const JointTraits& traits) {
  return RegisterJoint(traits, {Kind<Planar, double>::Make(), Kind<Planar, Dual>::Make(),
                                Kind<Spatial, double>::Make(), Kind<Spatial, Dual>::Make()});
}

/// Adds a kind whose compiler lives forever. Throws std::invalid_argument if it is invalid, and for
/// parts that no reader could fill.
void RegisterForce(OtherForce force, int alignment = EIGEN_MAX_STATIC_ALIGN_BYTES);

/// An element of the kind behind virtual functions.
template <class Space, class S, class Description>
class OtherElementOf final : public OtherElement<Space, S> {
 public:
  OtherElementOf(const Description& force, const MechanismDescription& description)
      : element_(force, description) {}
  void AddWrenches(const Kinematics<Space, S>& kinematics,
                   std::span<Wrench<Space, S>> wrenches) const override {
    element_.AddWrenches(kinematics, wrenches);
  }
  S Potential(const Kinematics<Space, S>& kinematics) const override {
    return element_.Potential(kinematics);
  }
  void AddPower(const Kinematics<Space, S>& kinematics, Power<S>& power) const override {
    element_.AddPower(kinematics, power);
  }
  bool has_power() const override { return element_.has_power(); }
  const std::vector<double>& knots() const override { return element_.knots(); }

 private:
  ForceElement<Space, S, Description> element_;
};

/// Adds the kind of force that `Description` defines.
template <class Description>
void RegisterForce() {
  static constexpr auto make = []<class Space, class S>() -> MakeOtherElement<Space, S> {
    return [](const std::any& force, const MechanismDescription& description)
               -> std::shared_ptr<const OtherElement<Space, S>> {
      return std::make_shared<OtherElementOf<Space, S, Description>>(
          std::any_cast<const Description&>(force), description);
    };
  };
  static const ForceCompiler compiler = {
      {make.template operator()<Planar, double>(), make.template operator()<Planar, Dual>(),
       make.template operator()<Spatial, double>(), make.template operator()<Spatial, Dual>()}};
  RegisterForce(OtherForce(Description{}, &compiler));
}

}  // namespace loopbench
