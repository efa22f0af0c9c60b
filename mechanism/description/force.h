// Forces: a struct for each kind, followed by its parameters.
//
// Readers, schemas, validation, change of scale, `explain` and preprocessing use only the
// parameters of a force: a joint, points of bodies, numbers with units, a vector, a function of
// time. Its mechanics is in mechanism/model/force_elements.h. User-defined kinds:
// mechanism/model/registry.h.
#pragma once

#include <Eigen/Core>
#include <any>
#include <deque>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "mechanism/description/time_function.h"

namespace loopbench {

/// Index of Ground in every list of bodies.
inline constexpr int kGround = 0;

/// A material point of a body.
struct BodyPoint {
  int body = kGround;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< in body axes from the body's origin [m]
};

/// Dimension of a number of a force: its unit at a rotating joint, its unit elsewhere, and its
/// power of length, a force counting as one. Numbers scale by this power when all lengths scale and
/// angles move as before (transforms.h).
struct Quantity {
  std::string_view of_angle, of_length;
  int power_of_angle = 0, power_of_length = 0;

  std::string_view Unit(bool is_length) const { return is_length ? of_length : of_angle; }
  /// A value when all lengths have grown by `factor`.
  double AtScale(double value, bool is_length, double factor) const;

  friend bool operator==(const Quantity&, const Quantity&) = default;
};

/// An effort is a moment or a force along a joint's coordinate.
namespace quantity {
inline constexpr Quantity kCoordinate = {"rad", "m", 0, 1};
inline constexpr Quantity kEffort = {"N m", "N", 2, 1};
inline constexpr Quantity kEffortPerCoordinate = {"N m/rad", "N/m", 2, 0};
inline constexpr Quantity kEffortPerSpeed = {"N m s/rad", "N s/m", 2, 0};
inline constexpr Quantity kLength = {"m", "m", 1, 1};
inline constexpr Quantity kForce = {"N", "N", 1, 1};
inline constexpr Quantity kForcePerLength = {"N/m", "N/m", 0, 0};
inline constexpr Quantity kForcePerSpeed = {"N s/m", "N s/m", 0, 0};
inline constexpr Quantity kForcePerSpeedSquared = {"N s^2/m^2", "N s^2/m^2", -1, -1};
}  // namespace quantity

/// Requirement on a part in files: always, at least one of the parts marked so, or optional.
enum class Need { kAlways, kOneOf, kNot };

struct ForceNumber {
  std::string_view key;
  double* value;
  Quantity quantity;
  Need need = Need::kNot;
  std::string_view sentence = "";
  bool any_sign = false;  ///< else it must not be negative
};

/// Parts of one force; missing ones are null or empty.
struct ForceParts {
  std::string_view name, sentence;  ///< name in files; description
  int* joint = nullptr;             ///< joint with one coordinate, along which the force acts
  /// Points of action: on one body other than Ground, or between two different bodies, from and to.
  std::vector<BodyPoint*> points = {};
  TimeFunctionDescription* value = nullptr;  ///< of time: an effort
  Eigen::Vector3d* force = nullptr;          ///< a vector [N], in axes of ground or of the body
  bool* in_body_axes = nullptr;
  std::vector<ForceNumber> numbers = {};
};

/// Given moment (revolute) [N m] or force (prismatic) [N] on `to`, its opposite on `from`: constant
/// (a polynomial of one coefficient; it has a potential) or a function of time (it supplies power).
struct JointTorque {
  int joint = 0;
  TimeFunctionDescription value = Polynomial{{0.0}};
};
inline ForceParts PartsOf(JointTorque& f) {
  return {
      .name = "joint_torque",
      .sentence = "A given moment or force on a joint's second body, its opposite on the first.",
      .joint = &f.joint,
      .value = &f.value};
}

/// Linear spring on the joint's coordinate: preload - stiffness * (q - rest).
struct JointSpring {
  int joint = 0;
  double stiffness = 0.0;  ///< >= 0
  double rest = 0.0;       ///< coordinate at which only the preload is left
  double preload = 0.0;
};
inline ForceParts PartsOf(JointSpring& f) {
  return {.name = "joint_spring",
          .sentence = "preload - stiffness (q - rest) on the joint's coordinate q.",
          .joint = &f.joint,
          .numbers = {{"stiffness", &f.stiffness, quantity::kEffortPerCoordinate, Need::kAlways},
                      {"rest", &f.rest, quantity::kCoordinate, Need::kNot,
                       "Coordinate at which only the preload is left", true},
                      {"preload", &f.preload, quantity::kEffort, Need::kNot, "", true}}};
}

/// Linear damper on the joint's speed: -damping * u.
struct JointDamper {
  int joint = 0;
  double damping = 0.0;  ///< >= 0
};
inline ForceParts PartsOf(JointDamper& f) {
  return {.name = "joint_damper",
          .sentence = "-damping u on the joint's speed u.",
          .joint = &f.joint,
          .numbers = {{"damping", &f.damping, quantity::kEffortPerSpeed, Need::kAlways}}};
}

/// Constant force at a material point of a body.
struct PointForce {
  BodyPoint point;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< [N]
  bool in_body_axes = false;                        ///< force turns with the body
};
inline ForceParts PartsOf(PointForce& f) {
  return {.name = "point_force",
          .sentence = "A constant force at a point of a body.",
          .points = {&f.point},
          .force = &f.force,
          .in_body_axes = &f.in_body_axes};
}

/// Spring and damper between points of two bodies: with their distance d, the tension
///   T = preload + stiffness (d - length) + damping ddot
/// pulls them together (T < 0 pushes them apart). If the points coincide, d = 0, there is no
/// direction and no force: an equilibrium, by the symmetry of all directions, and
/// unless T is proportional to d a jump that an integrator meets as such.
struct SpringDamper {
  BodyPoint from, to;      ///< of different bodies; one may be Ground
  double stiffness = 0.0;  ///< >= 0
  double damping = 0.0;    ///< >= 0
  double length = 0.0;     ///< distance at which the spring is free, >= 0
  double preload = 0.0;    ///< tension at that distance
};
inline ForceParts PartsOf(SpringDamper& f) {
  return {
      .name = "spring_damper",
      .sentence =
          "The tension preload + stiffness (d - length) + damping d' between points at distance d.",
      .points = {&f.from, &f.to},
      .numbers = {{"stiffness", &f.stiffness, quantity::kForcePerLength, Need::kOneOf},
                  {"damping", &f.damping, quantity::kForcePerSpeed, Need::kOneOf},
                  {"length", &f.length, quantity::kLength, Need::kNot,
                   "Distance of the points at which only the preload is left"},
                  {"preload", &f.preload, quantity::kForce, Need::kOneOf,
                   "Tension at that distance", true}}};
}

/// Resistance of a medium at rest at a material point of velocity v: -(linear + quadratic |v|) v.
struct Drag {
  BodyPoint point;
  double linear = 0.0;     ///< >= 0
  double quadratic = 0.0;  ///< >= 0
};
inline ForceParts PartsOf(Drag& f) {
  return {.name = "drag",
          .sentence = "-(linear + quadratic |v|) v at a point of velocity v.",
          .points = {&f.point},
          .numbers = {{"linear", &f.linear, quantity::kForcePerSpeed, Need::kOneOf},
                      {"quadratic", &f.quadratic, quantity::kForcePerSpeedSquared, Need::kOneOf}}};
}

/// Compiles a user-defined kind of force (mechanism/model/registry.h).
struct ForceCompiler;

/// A force of such a kind: its own struct, of which the parts are known.
class OtherForce {
 public:
  template <class Description>
  OtherForce(Description force, const ForceCompiler* compiler)
      : force_(std::move(force)),
        parts_([](std::any& any) { return PartsOf(*std::any_cast<Description>(&any)); }),
        compiler_(compiler) {}

  const std::any& force() const { return force_; }
  const ForceCompiler& compiler() const { return *compiler_; }
  friend ForceParts PartsOf(OtherForce& f) { return f.parts_(f.force_); }

 private:
  std::any force_;
  ForceParts (*parts_)(std::any&);
  const ForceCompiler* compiler_;
};

using ForceDescription =
    std::variant<JointTorque, JointSpring, JointDamper, PointForce, SpringDamper, Drag, OtherForce>;

/// Returns the parts of a force, which must not move while they are used. For a const force, use a
/// copy.
inline ForceParts PartsOf(ForceDescription& force) {
  return std::visit([](auto& one) { return PartsOf(one); }, force);
}

/// Returns one default force of each kind: the built-in kinds, then user-defined ones. References
/// stay valid.
const std::deque<ForceDescription>& ForceKinds();
/// Adds a kind. Programs call RegisterForce() instead: a kind needs an element too.
void AddForceKind(OtherForce force);

/// Distance of the two points of a force over Mechanism::length() below which they coincide.
inline constexpr double kCoincident = 1e-9;

/// Returns the tension [N] of a spring whose length approaches zero slowly. Unless it is zero, the
/// force jumps where the points coincide, because it has no direction there.
double TensionAtZeroLength(const SpringDamper& spring);

struct MechanismDescription;
/// Returns the name of a force between two points, for messages: its kind and bodies.
std::string NameOfForce(const MechanismDescription& description, std::size_t force);

/// Returns "" or the reason why a force is invalid: joints with several coordinates, points of no
/// body or of Ground, negative numbers, parts out of the plane, non-finite numbers.
std::string ValidateForce(const MechanismDescription& description, ForceDescription force);

}  // namespace loopbench
