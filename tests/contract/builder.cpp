#include "tests/contract/builder.h"

namespace loopbench::testing {

namespace {

template <class Space>
std::vector<JetPose> DescribedPoses(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  return Oracle(description, LayoutOf(mechanism))
      .Poses(ToReal(DescribedCoordinates(description, mechanism)));
}

}  // namespace

int Builder::AddJoint(JointType type, int parent, const Eigen::Vector3d& at_parent, int child,
                      const Eigen::Vector3d& at_child, double q, bool turned) {
  const int index = static_cast<int>(description.joints.size());
  JointDescription joint;
  joint.name = "j" + std::to_string(index);
  joint.type = type;
  joint.from = {parent, at_parent, Eigen::Vector3d::Zero()};
  joint.to = {child, at_child, Eigen::Vector3d::Zero()};
  if (turned) joint.from.rotation = RandomTurn(), joint.to.rotation = RandomTurn();
  if (TraitsOf(type).own_axis == 'x' && random.Chance(0.5)) {
    joint.axis = random.Vector(1.0, spatial) + 1.5 * Eigen::Vector3d::UnitX();
  }
  if (TraitsOf(type).own_axis == 'z' && spatial && random.Chance(0.5)) {
    joint.axis = random.Vector(1.0, spatial) + 1.5 * Eigen::Vector3d::UnitZ();
  }
  SetParameter(joint);
  if (turned && random.Chance(0.3)) std::swap(joint.from, joint.to);
  description.joints.push_back(joint);
  parent_[child] = parent;
  dof_[child] = NumValues(type, description.space, true);
  std::vector<double> values = Values(type, q);
  if (!values.empty()) description.initial.coordinates.push_back({index, values});
  return index;
}

std::vector<double> Builder::Values(JointType type, double q) {
  const int shift = spatial ? 3 : 2;
  std::vector<double> values(
      type == JointType::kRod ? shift : NumValues(type, description.space, false), q);
  if (values.size() > 1) {
    for (double& value : values) value = random.Uniform(-1.0, 1.0);
  }
  return values;
}

TimeFunctionDescription Builder::RandomFunction() {
  const int kind = random.Below(4);
  if (kind == 0) {
    return Polynomial{
        {random.Uniform(-5.0, 5.0), random.Uniform(-2.0, 2.0), random.Uniform(-1.0, 1.0)}};
  }
  if (kind == 1) {
    return Harmonic{.mean = random.Uniform(-1.0, 1.0),
                    .amplitude = random.Uniform(1.0, 5.0),
                    .omega = random.Uniform(0.5, 5.0),
                    .phase = random.Uniform(-3.0, 3.0)};
  }
  TimeTable table;
  table.cubic = kind == 2;
  for (double t = -1.0; t < 2.0; t += random.Uniform(0.3, 0.8)) {
    table.times.push_back(t);
    table.values.push_back(random.Uniform(-5.0, 5.0));
  }
  return table;
}

void Builder::AddForces(int count) {
  const int joints = static_cast<int>(description.joints.size());
  const int bodies = static_cast<int>(description.bodies.size());
  const auto point = [&](int body) { return BodyPoint{body, random.Vector(1.0, spatial)}; };
  for (int k = 0; k < count; ++k) {
    const int joint = random.Below(joints);
    const JointType type = description.joints[joint].type;
    const bool single = type == JointType::kRevolute || type == JointType::kPrismatic ||
                        type == JointType::kHelical;
    const int kind = single ? random.Below(7) : 4 + random.Below(3);
    if (kind == 0) {
      description.forces.push_back(JointTorque{joint, Polynomial{{random.Uniform(-5.0, 5.0)}}});
    }
    if (kind == 1) {
      description.forces.push_back(JointSpring{
          joint, random.Uniform(1.0, 10.0), random.Uniform(-1.0, 1.0), random.Uniform(-2.0, 2.0)});
    }
    if (kind == 2) description.forces.push_back(JointDamper{joint, random.Uniform(0.1, 1.0)});
    if (kind == 3) description.forces.push_back(JointTorque{joint, RandomFunction()});
    if (kind == 4) {
      const int body = 1 + random.Below(bodies - 1);
      description.forces.push_back(PointForce{body, random.Vector(1.0, spatial),
                                              random.Vector(10.0, spatial), random.Chance(0.5)});
    }
    if (kind == 5) {
      const int from = random.Below(bodies), to = (from + 1 + random.Below(bodies - 1)) % bodies;
      description.forces.push_back(SpringDamper{.from = point(from),
                                                .to = point(to),
                                                .stiffness = random.Uniform(1.0, 10.0),
                                                .damping = random.Uniform(0.1, 1.0),
                                                .length = random.Uniform(0.0, 2.0),
                                                .preload = random.Uniform(-2.0, 2.0)});
    }
    if (kind == 6) {
      description.forces.push_back(Drag{.point = point(1 + random.Below(bodies - 1)),
                                        .linear = random.Uniform(0.0, 1.0),
                                        .quadratic = random.Uniform(0.0, 1.0)});
    }
  }
}

void Builder::AddMotions(int count) {
  for (int k = 0; k < count; ++k) {
    const JointValues& values =
        description.initial
            .coordinates[random.Below(static_cast<int>(description.initial.coordinates.size()))];
    JointDescription& joint = description.joints[values.joint];
    const int speeds = NumValues(joint.type, description.space, true);
    if (speeds == 0 || speeds < NumValues(joint.type, description.space, false)) continue;
    const int coordinate = random.Below(speeds);
    joint.motions = {{coordinate, Polynomial{{values.values[coordinate], random.Uniform(-1.0, 1.0),
                                              random.Uniform(-1.0, 1.0)}}}};
  }
}

std::vector<JetPose> Builder::Poses() const {
  return spatial ? DescribedPoses<Spatial>(description) : DescribedPoses<Planar>(description);
}

void Builder::FinishClosures() {
  if (closures_.empty()) return;
  const std::vector<JetPose> poses = Poses();
  Layout layout;
  layout.spatial = spatial;
  MechanismDescription frames = description;  // to let the oracle place M
  for (auto& [joint, q] : closures_) {
    frames.joints = {joint};
    const std::vector<Jet> coordinates(q.begin(), q.end());
    // with F at the body's com, JointPose() is M seen from there
    frames.joints[0].from.position = frames.bodies[joint.from.body].com;
    const JetPose X_PM = Oracle(frames, layout).JointPose(0, poses);
    const JetPose X_PF =
        X_PM * Inverted(Transform(joint.type, spatial, coordinates.data(), joint.parameter));
    if (joint.type == JointType::kRod) {
      joint.parameter = Eigen::Map<const VectorX<double>>(q.data(), q.size()).norm();
    }
    Real33 R;
    for (int i = 0; i < 3; ++i) {
      joint.from.position[i] =
          static_cast<double>(X_PF.p[i].f + Real(frames.bodies[joint.from.body].com[i]));
      for (int j = 0; j < 3; ++j) R(i, j) = X_PF.R(i, j).f;
    }
    const Eigen::AngleAxis<Real> turn(R);
    joint.from.rotation = (turn.angle() * turn.axis()).cast<double>();
    description.joints.push_back(joint);
  }
}

}  // namespace loopbench::testing
