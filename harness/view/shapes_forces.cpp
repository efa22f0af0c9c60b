// Symbols of forces: springs, dashpots, arrows. Kinds of other programs have an arrow at a joint,
// or a ring at each of their points.
#include <cmath>
#include <numbers>

#include "harness/view/shapes.h"

namespace loopbench::harness {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

/// Between the frames of a joint that slides, beside its guide.
void AddBeside(const JointDescription& joint, ShapeKind kind, ShapeStyle style, double y, Pen pen) {
  const JointPlaces X = PlacesOf(joint);
  pen.Add(kind, style,
          {pen.On(joint.from.body, X.F, {{0, y, 0}}).front(),
           pen.On(joint.to.body, X.M, {{0, y, 0}}).front()},
          0.7);
}

/// Part of a circle or spiral about z of a frame; angles in half turns.
void AddArc(int body, const Frame& X, double angle, double sweep, double radius, double growth,
            ShapeStyle style, Pen pen) {
  Points arc;
  constexpr int kCorners = 44;
  for (int i = 0; i <= kCorners; ++i) {
    const double at = (angle + sweep * i / kCorners) * std::numbers::pi;
    const double r = radius + growth * i / kCorners;
    arc.push_back({r * std::cos(at), r * std::sin(at), 0});
  }
  pen.Add(ShapeKind::kLine, style, pen.On(body, X, arc));
}

void AddAtJoint(const JointDescription& joint, bool length, const ForceDescription& force,
                Pen pen) {
  const JointPlaces X = PlacesOf(joint);
  if (std::holds_alternative<JointSpring>(force)) {
    if (length) return AddBeside(joint, ShapeKind::kSpring, ShapeStyle::kSpring, 1.9, pen);
    return AddArc(joint.from.body, X.F, 0.0, 5.5, 0.9, 1.3, ShapeStyle::kSpring, pen);
  }
  if (std::holds_alternative<JointDamper>(force)) {
    if (length) return AddBeside(joint, ShapeKind::kDamper, ShapeStyle::kDamper, -1.9, pen);
    AddArc(joint.to.body, X.M, 1.0, 0.5, 1.5, 0.0, ShapeStyle::kDamper, pen);
    return AddArc(joint.from.body, X.F, 0.9, 0.7, 1.9, 0.0, ShapeStyle::kDamper, pen);
  }
  AddSweep(joint, length, ShapeStyle::kForce, 3.1, pen);
}

}  // namespace

PicturePlace AddForceShapes(const MechanismDescription& description, ForceDescription force,
                            Pen pen, const Picture& picture) {
  const ForceParts parts = PartsOf(force);
  if (parts.joint != nullptr) {
    const JointDescription& joint = description.joints[static_cast<std::size_t>(*parts.joint)];
    AddAtJoint(joint, ValueWords(joint.type, description.space, false).at(0).is_length(), force,
               pen);
    return {.body = joint.to.body, .at = joint.to.position};
  }
  std::vector<PicturePlace> places;
  for (const BodyPoint* point : parts.points) {
    places.push_back({.body = point->body, .at = point->at});
    if (point->body == kGround) AddFoot(point->at, pen, picture);
  }
  if (const auto* spring = std::get_if<SpringDamper>(&force)) {
    const bool both = spring->stiffness > 0.0 && spring->damping > 0.0;
    if (spring->stiffness > 0.0 || spring->damping == 0.0) {
      pen.Add(ShapeKind::kSpring, ShapeStyle::kSpring, places, 0.8, both ? 1.0 : 0.0);
    }
    if (spring->damping > 0.0) {
      pen.Add(ShapeKind::kDamper, ShapeStyle::kDamper, places, 0.8, both ? -1.0 : 0.0);
    }
  } else if (parts.force != nullptr && parts.force->norm() > 0.0) {
    constexpr double kLong = 7.0;
    PicturePlace tip = places.front();
    const Vector3d arrow = kLong * pen.size() * parts.force->normalized();
    (*parts.in_body_axes ? tip.at : tip.offset) += arrow;
    pen.Add(ShapeKind::kArrow, ShapeStyle::kForce, {places.front(), tip});
  } else {
    for (const PicturePlace& place : places) {
      pen.Add(ShapeKind::kDisc, ShapeStyle::kDamper, {place}, 1.3);
    }
  }
  return places.empty() ? PicturePlace{} : places.front();
}

}  // namespace loopbench::harness
