#include "harness/trajectory/body_motion.h"

#include <limits>

namespace loopbench::harness {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

template <class Space, class Kind>
Eigen::Vector3d LinearOf(const SpatialVector<Space, double, Kind>& V) {
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  for (int i = 0; i < Space::kLin; ++i) v[i] = V.linear[i];
  return v;
}
template <class Space, class Kind>
Eigen::Vector3d AngularOf(const SpatialVector<Space, double, Kind>& V) {
  Eigen::Vector3d w = Eigen::Vector3d::Zero();
  for (int i = 0; i < Space::kRot; ++i) w[Space::kRot == 1 ? 2 : i] = V.angular[i];
  return w;
}

/// At the centre of mass, in the part's ground axes.
template <class Space>
BodyMotion AtCentre(const Pose<Space, double>& pose, const Velocity<Space, double>& V) {
  BodyMotion motion;
  for (int i = 0; i < Space::kLin; ++i) {
    motion.pose.p[i] = pose.p[i];
    for (int j = 0; j < Space::kLin; ++j) motion.pose.R(i, j) = pose.R(i, j);
  }
  if constexpr (Space::kRot == 1) motion.angle = pose.angle;
  motion.velocity = LinearOf(V);
  motion.angular_velocity = AngularOf(V);
  motion.acceleration = motion.angular_acceleration = Eigen::Vector3d::Constant(kNaN);
  return motion;
}

}  // namespace

std::vector<BodyMotion> AtRest(const Compiled& compiled) {
  std::vector<BodyMotion> bodies(compiled.bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (compiled.bodies[i].part >= 0) continue;
    bodies[i].pose = compiled.bodies[i].X;
    bodies[i].angle = compiled.bodies[i].turn;
  }
  return bodies;
}

template <class Space>
void EnterPart(const Compiled& compiled, int part, const Kinematics<Space, double>& kinematics,
               std::span<const Acceleration<Space, double>> accelerations,
               std::vector<BodyMotion>* bodies) {
  const CompiledPart& own = compiled.parts[static_cast<std::size_t>(part)];
  for (std::size_t i = 0; i < compiled.bodies.size(); ++i) {
    const BodyImage& image = compiled.bodies[i];
    if (image.part != part) continue;
    const auto b = static_cast<std::size_t>(image.body);
    BodyMotion carrier = AtCentre<Space>(kinematics.poses()[b], kinematics.motions()[b]);
    if (!accelerations.empty()) {
      carrier.acceleration = LinearOf(accelerations[b]);
      carrier.angular_acceleration = AngularOf(accelerations[b]);
    }
    Eigen::Vector3d com = own.description.bodies[b].com;
    if (Space::kRot == 1) com.z() = 0.0;
    // the user's origin seen from the carrier's centre of mass, in carrier axes
    const Eigen::Vector3d at = image.X.p - com;
    BodyMotion& body = (*bodies)[i];
    body.pose = {own.R_WC * carrier.pose.R * image.X.R, own.R_WC * carrier.PointAt(at)};
    body.angle = carrier.angle + image.turn;
    body.velocity = own.R_WC * carrier.VelocityAt(at);
    body.angular_velocity = own.R_WC * carrier.angular_velocity;
    body.acceleration = own.R_WC * carrier.AccelerationAt(at);
    body.angular_acceleration = own.R_WC * carrier.angular_acceleration;
  }
}

#define LOOPBENCH_INSTANTIATE(Space)                                              \
  template void EnterPart(const Compiled&, int, const Kinematics<Space, double>&, \
                          std::span<const Acceleration<Space, double>>, std::vector<BodyMotion>*);
LOOPBENCH_INSTANTIATE(Planar)
LOOPBENCH_INSTANTIATE(Spatial)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::harness
