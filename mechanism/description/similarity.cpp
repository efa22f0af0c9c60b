#include "mechanism/description/similarity.h"

#include "mechanism/description/joint_traits.h"

namespace loopbench {

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
  Scaling(MechanismDescription& scene, double factor) : scene_(scene), factor_(factor) {}

  void Lengths() {
    scene_.gravity *= factor_;
    for (BodyDescription& body : scene_.bodies) {
      body.com *= factor_;
      body.inertia *= factor_ * factor_;
      for (auto& [name, point] : body.points) point *= factor_;
    }
    for (JointDescription& joint : scene_.joints) {
      joint.from.position *= factor_;
      joint.to.position *= factor_;
      joint.pitch *= factor_;
      joint.length *= factor_;
      for (PrescribedMotion& motion : joint.motions) {
        const bool is_length =
            motion.coordinate >= CountValues(joint.type, scene_.space, false).angles;
        if (is_length) Scale(motion.value, factor_);
      }
    }
    for (ForceDescription& force : scene_.forces) {
      std::visit([this](auto& one) { Force(one); }, force);
    }
    Values(scene_.initial.coordinates, false);
    Values(scene_.initial.speeds, true);
  }

 private:
  /// Of a coordinate: 1 for an angle, the factor for a length.
  double UnitOf(int joint) const {
    return CountValues(scene_.joints[joint].type, scene_.space, false).angles > 0 ? 1.0 : factor_;
  }
  /// Of the moment or force that works on it: energies scale with the factor's square.
  double EffortOf(int joint) const { return factor_ * factor_ / UnitOf(joint); }

  void Force(JointTorque& torque) const { Scale(torque.value, EffortOf(torque.joint)); }
  void Force(JointSpring& spring) const {
    spring.stiffness *= EffortOf(spring.joint) / UnitOf(spring.joint);
    spring.rest *= UnitOf(spring.joint);
    spring.preload *= EffortOf(spring.joint);
  }
  void Force(JointDamper& damper) const {
    damper.damping *= EffortOf(damper.joint) / UnitOf(damper.joint);
  }
  void Force(PointForce& point) const {
    point.at *= factor_;
    point.force *= factor_;
  }
  void Force(SpringDamper& spring) const {
    spring.from.at *= factor_;
    spring.to.at *= factor_;
    spring.length *= factor_;
    spring.preload *= factor_;
  }
  void Force(Drag& drag) const {
    drag.point.at *= factor_;
    drag.quadratic /= factor_;
  }

  void Values(std::vector<JointValues>& list, bool speeds) const {
    for (JointValues& given : list) {
      const int angles = CountValues(scene_.joints[given.joint].type, scene_.space, speeds).angles;
      for (int i = angles; i < static_cast<int>(given.values.size()); ++i) {
        given.values[static_cast<std::size_t>(i)] *= factor_;
      }
    }
  }

  MechanismDescription& scene_;
  double factor_;
};

}  // namespace

MechanismDescription AtScale(const MechanismDescription& description, double factor) {
  MechanismDescription scaled = description;
  Scaling(scaled, factor).Lengths();
  return scaled;
}

}  // namespace loopbench
