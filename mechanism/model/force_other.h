// User-defined kinds of forces (registry.h): their elements behind virtual functions, in double and
// in dual numbers.
#pragma once

#include <any>
#include <concepts>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>

#include "mechanism/algebra/dual.h"
#include "mechanism/model/force_element.h"

namespace loopbench {

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

  void AddWrenches(const Kinematics<Space, S>& kinematics,
                   std::span<Wrench<Space, S>> wrenches) const {
    element_->AddWrenches(kinematics, wrenches);
  }
  S Potential(const Kinematics<Space, S>& kinematics) const {
    return element_->Potential(kinematics);
  }
  void AddPower(const Kinematics<Space, S>& kinematics, Power<S>& power) const {
    element_->AddPower(kinematics, power);
  }
  bool has_power() const { return element_->has_power(); }
  const std::vector<double>& knots() const { return element_->knots(); }

 private:
  std::shared_ptr<const OtherElement<Space, S>> element_;
};

}  // namespace loopbench
