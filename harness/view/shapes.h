// Shapes of bodies, joints and forces, and the hull of a body's points.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "harness/view/picture.h"

namespace loopbench::harness {

// Outlines of bodies: the convex hull of the points where others are attached.

/// Faces of the convex hull as lists of indices into `points`: none for a single place, one of two
/// corners where all are in line, one polygon where all are in a plane, else triangles. Points
/// nearer than `tolerance` [m] are one. Above 24 points in space: the polygons of no volume are not
/// sought, and there are no faces.
std::vector<std::vector<int>> HullFaces(const std::vector<Eigen::Vector3d>& points,
                                        double tolerance);

// Symbols: what stands for a body, a joint or a force, from where others are attached to it.
//
// Sizes are multiples of Picture::symbol, half the size of a pin. Whatever reaches from one body to
// another (a spring, a rod, the guide of a slider) has places on both, so that it follows them.

/// Where a joint's frames are on its bodies, its axis included: in their axes, from their origins.
struct JointPlaces {
  Frame F, M;
};
JointPlaces PlacesOf(const JointDescription& joint);

/// Points of each body at which joints and forces between points act, in its axes; where these are
/// fewer than two places, its named points too, and then its centre of mass.
std::vector<std::vector<Eigen::Vector3d>> Attachments(const MechanismDescription& description);

/// Adds shapes to a picture, all of one item.
class Pen {
 public:
  Pen(Picture* picture, std::size_t item) : picture_(picture), item_(static_cast<int>(item)) {}

  double size() const { return picture_->symbol; }
  /// Radius and shift aside are counted in symbol sizes, too.
  void Add(ShapeKind kind, ShapeStyle style, std::vector<PicturePlace> places, double radius = 0.0,
           double aside = 0.0) {
    picture_->shapes.push_back(
        {kind, style, item_, radius * size(), aside * size(), std::move(places)});
  }
  /// Points of a frame on a body, counted in symbol sizes.
  std::vector<PicturePlace> On(int body, const Frame& X,
                               const std::vector<Eigen::Vector3d>& points) const {
    std::vector<PicturePlace> places;
    for (const Eigen::Vector3d& point : points) {
      places.push_back({.body = body, .at = X.p + X.R * (size() * point)});
    }
    return places;
  }
  /// A box about the origin of a frame, half as large as `half` in symbol sizes; flat in the plane.
  void Box(ShapeStyle style, int body, const Frame& X, const Eigen::Vector3d& half);

 private:
  Picture* picture_;
  int item_;
};

/// Of one joint; guides reach as far as the bodies are apart at the picture's start.
void AddJointShapes(const JointDescription& joint, Pen pen, const Picture& picture);
/// What holds a point of Ground: a hatched triangle, in space a pyramid.
void AddFoot(const Eigen::Vector3d& at, Pen pen, const Picture& picture);
/// An arrow along x of a joint's frame F (z of one with its axis there), or about z.
void AddSweep(const JointDescription& joint, bool straight, ShapeStyle style, double radius,
              Pen pen);
/// Of one force: where its name belongs.
PicturePlace AddForceShapes(const MechanismDescription& description, ForceDescription force,
                            Pen pen, const Picture& picture);

/// Fills items' anchors and all shapes. Items, `start`, `up`, `symbol` and `extent` must be there.
void AddShapes(const MechanismDescription& description, Picture* picture);

}  // namespace loopbench::harness
