#include "harness/reference/snapshot.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace loopbench::harness {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool BelongsTo(const BodyImage& image, int part) {
  return image.part >= 0 && (part < 0 || image.part == part);
}

}  // namespace

bool IsLength(const MechanismDescription& user, std::size_t joint) {
  const auto words = ValueWords(user.joints[joint].type, user.space, false);
  return !words.empty() && words.front().is_length();
}

namespace {

/// The angle of the rotation from one orientation to the other [rad], to the last digit for small
/// ones: |R_a - R_b| = 2 sqrt(2) sin(angle / 2).
double AngleBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return 2 * std::asin(std::min(1.0, (a - b).norm() / (2 * std::numbers::sqrt2)));
}

}  // namespace

std::vector<MeasuredPoint> PointsOf(const MechanismDescription& user) {
  std::vector<MeasuredPoint> points;
  for (std::size_t i = 1; i < user.bodies.size(); ++i) {
    points.push_back({i, Eigen::Vector3d::Zero()});
    points.push_back({i, user.bodies[i].com});
    for (const auto& [name, at] : user.bodies[i].points) points.push_back({i, at});
  }
  return points;
}

Snapshot EmptySnapshot(const Measured& measured) {
  Snapshot snapshot;
  snapshot.bodies.resize(measured.user.bodies.size());
  for (std::size_t i = 0; i < measured.compiled.bodies.size(); ++i) {
    const BodyImage& image = measured.compiled.bodies[i];
    if (image.part < 0) snapshot.bodies[i].pose = image.X;
  }
  snapshot.joints.assign(measured.user.joints.size(), kNaN);
  snapshot.rates = snapshot.joints;
  return snapshot;
}

void EnterBody(const Measured& measured, int part, int body, const BodyState& at_centre,
               Snapshot* snapshot) {
  const CompiledPart& own = measured.compiled.parts[static_cast<std::size_t>(part)];
  Eigen::Vector3d com = own.description.bodies[static_cast<std::size_t>(body)].com;
  if (own.description.space == SpaceKind::kPlanar) com.z() = 0.0;
  const Frame at_origin{at_centre.pose.R, at_centre.pose.p - at_centre.pose.R * com};
  for (std::size_t i = 0; i < measured.compiled.bodies.size(); ++i) {
    const BodyImage& image = measured.compiled.bodies[i];
    if (image.part != part || image.body != body) continue;
    const Frame X = at_origin * image.X;
    BodyState& state = snapshot->bodies[i];
    state.pose = {own.R_WC * X.R, own.R_WC * X.p};
    state.angular_velocity = own.R_WC * at_centre.angular_velocity;
    state.velocity =
        own.R_WC * (at_centre.velocity + at_centre.angular_velocity.cross(X.p - at_centre.pose.p));
  }
}

void EnterJoint(const Measured& measured, int part, int joint, double coordinate, double rate,
                Snapshot* snapshot) {
  for (std::size_t j = 0; j < measured.compiled.joints.size(); ++j) {
    const JointImage& image = measured.compiled.joints[j];
    if (image.part != part || image.joint != joint) continue;
    const double sign = image.mirrored && !IsLength(measured.user, j) ? -1.0 : 1.0;
    snapshot->joints[j] = sign * coordinate;
    snapshot->rates[j] = sign * rate;
  }
}

Distance DistanceOf(const Measured& measured, int part, const Snapshot& a, const Snapshot& b) {
  Distance distance;
  distance.energy = std::abs(a.energy - b.energy);
  // every point's shift and b's velocity there
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> shifts;
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    if (!BelongsTo(measured.compiled.bodies[i], part)) continue;
    const BodyState &p = a.bodies[i], &q = b.bodies[i];
    distance.rotation = std::max(distance.rotation, AngleBetween(p.pose.R, q.pose.R));
    distance.angular_velocity =
        std::max(distance.angular_velocity, (p.angular_velocity - q.angular_velocity).norm());
  }
  for (const auto& [i, r] : measured.points.empty() ? PointsOf(measured.user) : measured.points) {
    if (!BelongsTo(measured.compiled.bodies[i], part)) continue;
    const BodyState &p = a.bodies[i], &q = b.bodies[i];
    const Eigen::Vector3d r_p = p.pose.R * r, r_q = q.pose.R * r;
    const Eigen::Vector3d shift = p.pose.p - q.pose.p + r_p - r_q;
    const Eigen::Vector3d velocity = q.velocity + q.angular_velocity.cross(r_q);
    const Eigen::Vector3d difference = p.velocity + p.angular_velocity.cross(r_p) - velocity;
    distance.position = std::max(distance.position, shift.norm());
    distance.velocity = std::max(distance.velocity, difference.norm());
    shifts.emplace_back(shift, velocity);
  }
  for (std::size_t j = 0; j < a.joints.size(); ++j) {
    const JointImage& image = measured.compiled.joints[j];
    if (image.part < 0 || (part >= 0 && image.part != part) ||
        std::isnan(a.joints[j] - b.joints[j]))
      continue;
    double& largest = IsLength(measured.user, j) ? distance.displacement : distance.angle;
    const double apart = a.joints[j] - b.joints[j];
    largest = std::max(
        largest,
        std::abs(IsLength(measured.user, j) ? apart : std::remainder(apart, 2 * std::numbers::pi)));
  }
  double along = 0.0, speed = 0.0;
  for (const auto& [shift, velocity] : shifts) {
    along += shift.dot(velocity);
    speed += velocity.squaredNorm();
  }
  distance.late = speed > 0.0 ? -along / speed : kNaN;
  if (!shifts.empty()) distance.speed = std::sqrt(speed / static_cast<double>(shifts.size()));
  for (const auto& [shift, velocity] : shifts) {
    const Eigen::Vector3d left =
        std::isnan(distance.late) ? shift : Eigen::Vector3d(shift + distance.late * velocity);
    distance.shape = std::max(distance.shape, left.norm());
  }
  return distance;
}

Distance Larger(const Distance& a, const Distance& b) {
  const auto larger = [](double x, double y) { return std::isnan(x) || y > x ? y : x; };
  return {.position = larger(a.position, b.position),
          .rotation = larger(a.rotation, b.rotation),
          .velocity = larger(a.velocity, b.velocity),
          .angular_velocity = larger(a.angular_velocity, b.angular_velocity),
          .angle = larger(a.angle, b.angle),
          .displacement = larger(a.displacement, b.displacement),
          .energy = larger(a.energy, b.energy),
          .late = larger(std::abs(a.late), std::abs(b.late)),
          .shape = larger(a.shape, b.shape),
          .speed = larger(a.speed, b.speed)};
}

}  // namespace loopbench::harness
