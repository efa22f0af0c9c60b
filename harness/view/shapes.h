// Shapes of bodies, joints and forces, and the hull of a body's points.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "harness/view/picture.h"

namespace loopbench::harness {

// Outlines of bodies: convex hulls of their attachment points.

/// Returns faces of the convex hull as lists of indices into `points`. One point gives none, points
/// in line give one face with two corners, points in a plane one polygon, others triangles. Points
/// closer than `tolerance` [m] are merged. More than 24 points that span a volume give no faces.
std::vector<std::vector<int>> HullFaces(const std::vector<Eigen::Vector3d>& points,
                                        double tolerance);

// Symbols of bodies, joints and forces, built from attachment points.
//
// Sizes are multiples of Picture::symbol, half the size of a pin. A shape between two bodies (a
// spring, a rod, the guide of a slider) has points on both, so that it follows them.

/// Frames of a joint on its bodies, its axis included: in body axes, from body origins.
struct JointPlaces {
  Frame F, M;
};
JointPlaces PlacesOf(const JointDescription& joint);

/// Returns the points of each body where joints and point forces act, in body axes. With fewer than
/// two such points, the named points are added, then the centre of mass.
std::vector<std::vector<Eigen::Vector3d>> Attachments(const MechanismDescription& description);

/// Adds shapes of one item to a picture.
class Pen {
 public:
  Pen(Picture* picture, std::size_t item) : picture_(picture), item_(static_cast<int>(item)) {}

  double size() const { return picture_->symbol; }
  /// Adds a shape; radius and shift are given in symbol sizes.
  void Add(ShapeKind kind, ShapeStyle style, std::vector<PicturePlace> places, double radius = 0.0,
           double aside = 0.0) {
    picture_->shapes.push_back(
        {kind, style, item_, radius * size(), aside * size(), std::move(places)});
  }
  /// Returns points of a frame on a body, given in symbol sizes.
  std::vector<PicturePlace> On(int body, const Frame& X,
                               const std::vector<Eigen::Vector3d>& points) const {
    std::vector<PicturePlace> places;
    for (const Eigen::Vector3d& point : points) {
      places.push_back({.body = body, .at = X.p + X.R * (size() * point)});
    }
    return places;
  }
  /// Adds a box about the origin of a frame, with half sides `half` [symbol sizes]; flat if planar.
  void Box(ShapeStyle style, int body, const Frame& X, const Eigen::Vector3d& half);

 private:
  Picture* picture_;
  int item_;
};

/// Adds the shapes of a joint; guides span the distance of the bodies at the picture's start.
void AddJointShapes(const JointDescription& joint, Pen pen, const Picture& picture);
/// Adds the support of a point of Ground: a hatched triangle, or a pyramid in space.
void AddFoot(const Eigen::Vector3d& at, Pen pen, const Picture& picture);
/// Adds an arrow along x of a joint's frame F (z if its axis is z), or about z.
void AddSweep(const JointDescription& joint, bool straight, ShapeStyle style, double radius,
              Pen pen);
/// Adds the shapes of a force; returns the position of its name.
PicturePlace AddForceShapes(const MechanismDescription& description, ForceDescription force,
                            Pen pen, const Picture& picture);

/// Sets anchors of items and all shapes. Requires items, `start`, `up`, `symbol` and `extent`.
void AddShapes(const MechanismDescription& description, Picture* picture);

}  // namespace loopbench::harness
