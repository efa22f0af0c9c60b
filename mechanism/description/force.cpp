#include "mechanism/description/force.h"

#include <cmath>

#include "mechanism/description/description.h"

namespace loopbench {

namespace {

std::deque<ForceDescription>& Kinds() {
  static std::deque<ForceDescription> kinds = {JointTorque{}, JointSpring{},  JointDamper{},
                                               PointForce{},  SpringDamper{}, Drag{}};
  return kinds;
}

/// The first thing wrong with a force.
class Validator {
 public:
  explicit Validator(const MechanismDescription& description) : description_(description) {}

  std::string Check(const ForceParts& parts) const {
    std::string error;
    const auto note = [&](const std::string& found) {
      if (error.empty()) error = found;
    };
    if (parts.joint != nullptr) note(Joint(*parts.joint));
    const bool between = parts.points.size() > 1;
    for (const BodyPoint* point : parts.points) note(Point(*point, between));
    if (between && parts.points[0]->body == parts.points[1]->body) {
      note("joins a body with itself");
    }
    if (parts.force != nullptr) note(Vector(*parts.force));
    if (parts.value != nullptr) note(Validate(*parts.value));
    for (const ForceNumber& number : parts.numbers) {
      const std::string key(number.key);
      if (!number.any_sign && !(*number.value >= 0.0)) note(key + " must not be negative");
      if (!std::isfinite(*number.value)) note(key + " must be finite");
    }
    return error;
  }

 private:
  std::string Joint(int index) const {
    if (index < 0 || index >= std::ssize(description_.joints)) {
      return "joint index " + std::to_string(index) + " does not exist";
    }
    const JointDescription& joint = description_.joints[index];
    if (NumValues(joint.type, description_.space, true) == 1) return "";
    return "joint \"" + joint.name + "\" has not one coordinate, which a joint force acts along";
  }
  std::string Point(const BodyPoint& point, bool may_be_ground) const {
    const int first = may_be_ground ? kGround : kGround + 1;
    if (point.body < first || point.body >= std::ssize(description_.bodies)) {
      return "body index " + std::to_string(point.body) + ", expected a " +
             (may_be_ground ? "" : "moving ") + "body";
    }
    return Vector(point.at);
  }
  std::string Vector(const Eigen::Vector3d& v) const {
    if (!v.allFinite()) return "vectors must be finite";
    return description_.space == SpaceKind::kPlanar && v.z() != 0.0 ? "leaves the plane" : "";
  }

  const MechanismDescription& description_;
};

}  // namespace

double Quantity::AtScale(double value, bool is_length, double factor) const {
  const int power = is_length ? power_of_length : power_of_angle;
  for (int i = 0; i < power; ++i) value *= factor;
  for (int i = 0; i > power; --i) value /= factor;
  return value;
}

const std::deque<ForceDescription>& ForceKinds() { return Kinds(); }

void AddForceKind(OtherForce force) { Kinds().push_back(std::move(force)); }

double TensionAtZeroLength(const SpringDamper& spring) {
  const double pull = spring.stiffness * spring.length, tension = spring.preload - pull;
  constexpr double kRoundOff = 1e-12;
  return std::abs(tension) <= kRoundOff * (std::abs(spring.preload) + pull) ? 0.0 : tension;
}

std::string NameOfForce(const MechanismDescription& description, std::size_t force) {
  ForceDescription named = description.forces[force];
  const ForceParts parts = PartsOf(named);
  const auto body = [&](std::size_t i) { return description.bodies[parts.points[i]->body].name; };
  return std::string(parts.name) + " between " + body(0) + " and " + body(1);
}

std::string ValidateForce(const MechanismDescription& description, ForceDescription force) {
  const ForceParts parts = PartsOf(force);
  const std::string error = Validator(description).Check(parts);
  return error.empty() ? "" : std::string(parts.name) + ": " + error;
}

}  // namespace loopbench
