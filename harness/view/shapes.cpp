#include "harness/view/shapes.h"

#include <algorithm>

#include "harness/view/hull.h"

namespace loopbench::harness {

using Eigen::Vector3d;

JointPlaces PlacesOf(const JointDescription& joint) {
  const Frame aligned{AxisAlignment(joint), Vector3d::Zero()};
  return {PoseOf(joint.from) * aligned, PoseOf(joint.to) * aligned};
}

void Pen::Box(ShapeStyle style, int body, const Frame& X, const Vector3d& half) {
  const auto face = [&](int normal, double side) {
    const int a = (normal + 1) % 3, b = (normal + 2) % 3;
    std::vector<Vector3d> corners(4, side * half[normal] * Vector3d::Unit(normal));
    for (std::size_t i = 0; i < 4; ++i) {
      corners[i][a] = (i == 0 || i == 3 ? -1 : 1) * half[a];
      corners[i][b] = (i < 2 ? -1 : 1) * half[b];
    }
    Add(ShapeKind::kArea, style, On(body, X, corners));
  };
  if (picture_->planar) return face(2, 0.0);
  for (int normal = 0; normal < 3; ++normal) {
    face(normal, -1.0);
    face(normal, 1.0);
  }
}

std::vector<std::vector<Vector3d>> Attachments(const MechanismDescription& description) {
  std::vector<std::vector<Vector3d>> points(description.bodies.size());
  const auto add = [&](int body, const Vector3d& at) {
    points[static_cast<std::size_t>(body)].push_back(at);
  };
  for (const JointDescription& joint : description.joints) {
    add(joint.from.body, joint.from.position);
    add(joint.to.body, joint.to.position);
  }
  for (ForceDescription force : description.forces) {
    for (const BodyPoint* point : PartsOf(force).points) add(point->body, point->at);
  }
  for (std::size_t b = 1; b < points.size(); ++b) {
    const BodyDescription& body = description.bodies[b];
    std::vector<Vector3d>& own = points[b];
    const auto is_one_place = [&own] {
      return std::ranges::all_of(own, [&](const Vector3d& p) {
        return (p - own.front()).norm() <= 1e-9 * (p.norm() + own.front().norm());
      });
    };
    if (is_one_place()) {
      for (const auto& [name, at] : body.points) own.push_back(at);
    }
    if (is_one_place()) own.push_back(body.com);
  }
  return points;
}

namespace {

int Floor(ShapeStyle style) {
  switch (style) {
    case ShapeStyle::kGround:
      return 0;
    case ShapeStyle::kGuide:
      return 1;
    case ShapeStyle::kBody:
      return 2;
    case ShapeStyle::kRod:
    case ShapeStyle::kSpring:
    case ShapeStyle::kDamper:
      return 3;
    case ShapeStyle::kJoint:
    case ShapeStyle::kSolid:
      return 4;
    case ShapeStyle::kCentre:
      return 5;
    case ShapeStyle::kForce:
    case ShapeStyle::kDrive:
      return 6;
  }
  return 6;
}

void AddBody(const BodyDescription& body, int index, const std::vector<Vector3d>& points,
             bool boxed, Pen pen, Picture* picture) {
  const auto on_body = [index](const Vector3d& at) {
    return PicturePlace{.body = index, .at = at};
  };
  const auto faces = HullFaces(points, 0.3 * pen.size());
  PictureItem& item = picture->items[static_cast<std::size_t>(index)];
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& p : points) middle += p / static_cast<double>(points.size());
  for (const std::vector<int>& face : faces) {
    std::vector<PicturePlace> corners;
    for (const int i : face) corners.push_back(on_body(points[static_cast<std::size_t>(i)]));
    if (face.size() == 2) {
      middle = 0.5 * (corners[0].at + corners[1].at);
      pen.Add(ShapeKind::kBar, ShapeStyle::kBody, corners, 0.55);
    } else {
      pen.Add(ShapeKind::kArea, ShapeStyle::kBody, corners, picture->planar ? 0.55 : 0.0);
    }
  }
  const bool star = faces.empty() && !HullFaces({middle, points.front()}, 0.3 * pen.size()).empty();
  for (std::size_t i = 0; star && i < points.size(); ++i) {
    pen.Add(ShapeKind::kBar, ShapeStyle::kBody, {on_body(middle), on_body(points[i])}, 0.3);
  }
  // what is attached at one place only and slides there has the slider's box already
  if (faces.empty() && !star && !boxed) {
    pen.Add(ShapeKind::kDisc, ShapeStyle::kBody, {on_body(middle)}, 1.7);
  }
  item.anchor = on_body(middle);
  if (picture->bodies > kMostDetailed) return;
  // a centre of mass off the body hangs on a line
  const bool inside = std::ranges::any_of(
      points, [&](const Vector3d& p) { return (p - body.com).norm() <= 0.5 * pen.size(); });
  if (!inside && !faces.empty() && faces.front().size() == 2) {
    const Vector3d a = points[static_cast<std::size_t>(faces.front()[0])],
                   along = points[static_cast<std::size_t>(faces.front()[1])] - a;
    const double share = std::clamp(along.dot(body.com - a) / along.squaredNorm(), 0.0, 1.0);
    const Vector3d foot = a + share * along;
    if ((foot - body.com).norm() > 0.6 * pen.size()) {
      pen.Add(ShapeKind::kLine, ShapeStyle::kCentre, {on_body(foot), on_body(body.com)});
    }
  }
  pen.Add(ShapeKind::kCentre, ShapeStyle::kCentre, {on_body(body.com)}, 0.6);
}

}  // namespace

void AddShapes(const MechanismDescription& description, Picture* picture) {
  const auto points = Attachments(description);
  std::vector<bool> boxed(description.bodies.size(), false);
  for (const JointDescription& joint : description.joints) {
    if (joint.type == JointType::kPrismatic) boxed[static_cast<std::size_t>(joint.to.body)] = true;
  }
  for (std::size_t b = 1; b < description.bodies.size(); ++b) {
    AddBody(description.bodies[b], static_cast<int>(b), points[b], boxed[b], Pen(picture, b),
            picture);
  }
  for (std::size_t f = 0; f < description.forces.size(); ++f) {
    const std::size_t item = picture->bodies + picture->joints + f;
    picture->items[item].anchor =
        AddForceShapes(description, description.forces[f], Pen(picture, item), *picture);
  }
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    const JointDescription& joint = description.joints[j];
    const std::size_t item = picture->ItemOfJoint(static_cast<int>(j));
    picture->items[item].anchor = {.body = joint.to.body, .at = joint.to.position};
    AddJointShapes(joint, Pen(picture, item), *picture);
  }
  // who draws in this order has the ground below bodies and pins above them
  std::ranges::stable_sort(picture->shapes, {},
                           [](const PictureShape& shape) { return Floor(shape.style); });
}

}  // namespace loopbench::harness
