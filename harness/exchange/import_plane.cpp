// --planar: an imported mechanism in its plane, with gravity along -y.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/exchange/import_draft.h"
#include "harness/text/config_error.h"
#include "mechanism/simplify/plane.h"

namespace loopbench::harness {

namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRounding = 1e-12;  // as axes are level to (plane.h)

/// Ground axes with z = n and, where there is gravity across n, y against it: q_WC.
Quaterniond AxesOfPlane(const Vector3d& n, const Vector3d& gravity) {
  const Vector3d across = gravity - gravity.dot(n) * n;
  if (!(across.norm() > kRounding * gravity.norm())) return Quaterniond(AxesWithNormal(n));
  const Vector3d y = -across.normalized();
  Eigen::Matrix3d R;
  R << y.cross(n), y, n;
  return Quaterniond(R);
}

/// The same mechanism in other ground axes; q_CW.
void TurnGround(const Quaterniond& q, MechanismDescription* description) {
  description->gravity = q * description->gravity;
  for (auto& [name, point] : description->bodies[kGround].points) point = q * point;
  for (JointDescription& joint : description->joints) {
    for (JointSide* side : {&joint.from, &joint.to}) {
      if (side->body != kGround) continue;
      side->position = q * side->position;
      side->rotation = RotationVector(q * Quaterniond(PoseOf(*side).R));
    }
  }
  for (ForceDescription& force : description->forces) {
    const ForceParts parts = PartsOf(force);
    for (BodyPoint* point : parts.points) {
      if (point->body == kGround) point->at = q * point->at;
    }
    if (parts.force != nullptr && !*parts.in_body_axes) *parts.force = q * *parts.force;
  }
}

}  // namespace

void ImportDraft::MakeBallsPins(const Vector3d& n) {
  std::set<int> balls;
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    JointDescription& joint = description.joints[j];
    if (joint.type != JointType::kSpherical) continue;
    joint.type = JointType::kRevolute;  // all that a ball can do in a plane
    for (JointSide* side : {&joint.from, &joint.to}) {
      const Quaterniond& q = at_rest[static_cast<std::size_t>(side->body)].q;
      side->rotation = RotationVector(q.conjugate() * Quaterniond(AxesWithNormal(n)));
    }
    balls.insert(static_cast<int>(j));
  }
  for (auto* list : {&description.initial.coordinates, &description.initial.speeds}) {
    std::erase_if(*list, [&](const JointValues& one) { return balls.contains(one.joint); });
  }
}

void ImportDraft::GoToPlane() {
  const auto turns = std::ranges::find_if(description.joints, [](const JointDescription& joint) {
    return TraitsOf(joint.type).flat.turns;
  });
  if (turns != description.joints.end()) {
    const Vector3d n = at_rest[static_cast<std::size_t>(turns->from.body)].q *
                       (PoseOf(turns->from).R * AxisAlignment(*turns) * Vector3d::UnitZ());
    MakeBallsPins(n);
    TurnGround(AxesOfPlane(n, description.gravity).conjugate(), &description);
  }
  std::string why;
  const std::optional<InPlane> plane = ExpressInPlane(description, &why);
  if (!plane) {
    throw ConfigError(
        fmt::format("{}: --planar: found that {}, expected a mechanism that moves in one plane",
                    file_.name(), why));
  }
  const double least = kRounding * description.gravity.norm();
  if (std::abs(plane->gravity_dropped) > least) {
    Note(elements_[kGround], fmt::format("gravity of {:.6g} m/s^2 along the normal of the plane "
                                         "dropped: it moves nothing",
                                         plane->gravity_dropped));
  }
  description = plane->description;
  description.gravity =
      description.gravity.unaryExpr([=](double g) { return std::abs(g) <= least ? 0.0 : g; });
}

}  // namespace loopbench::harness
