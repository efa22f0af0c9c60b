#include "mechanism/description/transforms.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "mechanism/description/joint_frames.h"

namespace loopbench {

MechanismDescription InSpace(const MechanismDescription& planar, const Eigen::Vector3d& turn) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  if (!turn.isZero()) R = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  MechanismDescription spatial = planar;
  spatial.space = SpaceKind::kSpatial;
  spatial.gravity = R * planar.gravity;
  for (JointDescription& joint : spatial.joints) {
    for (JointSide* side : {&joint.from, &joint.to}) {
      if (side->body != kGround || turn.isZero()) continue;
      const Eigen::AngleAxisd turned(R * PoseOf(*side).R);
      side->rotation = turned.angle() * turned.axis();
      side->position = R * side->position;
    }
  }
  for (ForceDescription& force : spatial.forces) {
    const ForceParts parts = PartsOf(force);
    if (parts.force != nullptr && !*parts.in_body_axes) *parts.force = R * *parts.force;
    for (BodyPoint* point : parts.points) {
      if (point->body == kGround) point->at = R * point->at;
    }
  }
  return spatial;
}

namespace {

void Scale(TimeFunctionDescription& function, double factor) {
  if (auto* polynomial = std::get_if<Polynomial>(&function)) {
    for (double& c : polynomial->coefficients) c *= factor;
  } else if (auto* harmonic = std::get_if<Harmonic>(&function)) {
    harmonic->mean *= factor;
    harmonic->amplitude *= factor;
  } else {
    for (double& y : std::get<TimeTable>(function).values) y *= factor;
  }
}

class Scaling {
 public:
  Scaling(MechanismDescription& mechanism, double factor)
      : description_(mechanism), factor_(factor) {}

  void Lengths() {
    description_.gravity *= factor_;
    for (BodyDescription& body : description_.bodies) {
      body.com *= factor_;
      body.inertia *= factor_ * factor_;
      for (auto& [name, point] : body.points) point *= factor_;
    }
    for (std::size_t index = 0; index < description_.joints.size(); ++index) {
      JointDescription& joint = description_.joints[index];
      joint.from.position *= factor_;
      joint.to.position *= factor_;
      const bool is_length = TraitsOf(joint.type).parameter.unit.starts_with('m');
      joint.parameter *= is_length ? factor_ : 1.0;
      joint.rotor_inertia *= IsLength(index, 0, false) ? 1.0 : factor_ * factor_;
      for (PrescribedMotion& motion : joint.motions) {
        if (IsLength(index, motion.coordinate, false)) Scale(motion.value, factor_);
      }
    }
    for (CouplingDescription& coupling : description_.couplings) Coupling(coupling);
    for (ForceDescription& force : description_.forces) Force(PartsOf(force));
    for (PoseTarget& target : description_.initial.poses) {
      target.point *= factor_;
      if (target.at) *target.at *= factor_;
    }
    Values(description_.initial.coordinates, false);
    Values(description_.initial.speeds, true);
  }

 private:
  /// Returns true if a coordinate or speed is a length, false if it is an angle.
  bool IsLength(std::size_t joint, int coordinate, bool speeds) const {
    const auto words = ValueWords(description_.joints[joint].type, description_.space, speeds);
    return coordinate < std::ssize(words) && words[coordinate].is_length();
  }
  /// If a coordinate is a length, the equation is one of lengths.
  void Coupling(CouplingDescription& coupling) const {
    const auto is_length = [&](const CouplingDescription::Part& part) {
      return IsLength(static_cast<std::size_t>(part.joint), 0, false);
    };
    if (std::ranges::none_of(coupling.parts, is_length)) return;
    coupling.offset *= factor_;
    for (CouplingDescription::Part& part : coupling.parts) {
      if (!is_length(part)) part.ratio *= factor_;
    }
  }
  void Force(const ForceParts& parts) const {
    const bool is_length = parts.joint == nullptr || IsLength(*parts.joint, 0, false);
    for (BodyPoint* point : parts.points) point->at *= factor_;
    if (parts.force != nullptr) *parts.force *= factor_;
    const double effort = quantity::kEffort.AtScale(1.0, is_length, factor_);
    if (parts.value != nullptr) Scale(*parts.value, effort);
    for (const ForceNumber& number : parts.numbers) {
      *number.value = number.quantity.AtScale(*number.value, is_length, factor_);
    }
  }

  void Values(std::vector<JointValues>& list, bool speeds) const {
    for (JointValues& given : list) {
      for (int i = 0; i < std::ssize(given.values); ++i) {
        if (IsLength(given.joint, i, speeds)) given.values[i] *= factor_;
      }
    }
  }

  MechanismDescription& description_;
  double factor_;
};

}  // namespace

MechanismDescription AtScale(const MechanismDescription& description, double factor) {
  MechanismDescription scaled = description;
  Scaling(scaled, factor).Lengths();
  return scaled;
}

}  // namespace loopbench
