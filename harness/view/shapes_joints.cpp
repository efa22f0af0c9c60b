// Symbols of joints, by what they leave free. Kinds of other programs have a plain diamond.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "harness/view/shapes.h"

namespace loopbench::harness {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

/// Hatched ground `below` the origin of a frame whose y points down.
void Hatch(const Frame& foot, double from, double to, double below, Pen pen) {
  const auto line = [&](const Points& points) {
    pen.Add(ShapeKind::kLine, ShapeStyle::kGround, pen.On(kGround, foot, points));
  };
  line({{from - 0.5, below, 0}, {to + 0.5, below, 0}});
  constexpr int kMostHatches = 60;
  const int hatches = std::clamp(static_cast<int>((to - from) / 0.8), 4, kMostHatches);
  for (int i = 0; i <= hatches; ++i) {
    const double x = from + (to - from) * i / hatches;
    line({{x + 0.4, below, 0}, {x - 0.4, below + 0.8, 0}});
  }
}

/// One joint being drawn. z is the axis it turns about, x the one it slides along.
class JointSymbol {
 public:
  JointSymbol(const JointDescription& joint, Pen pen, const Picture& picture)
      : joint_(joint), pen_(pen), picture_(picture), places_(PlacesOf(joint)) {}

  void Draw() {
    // a free joint holds nothing
    const bool holds = joint_.type != JointType::kFree;
    if (holds && joint_.from.body == kGround) Ground(places_.F, Relative().p.x());
    if (holds && joint_.to.body == kGround) Ground(places_.M, 0.0);
    switch (joint_.type) {
      case JointType::kRevolute:
        Pin(0.8);
        break;
      case JointType::kPrismatic:
        Guide(0, ShapeStyle::kGuide, 0.3, 4.0);
        pen_.Box(ShapeStyle::kJoint, to(), places_.M, {2.2, 1.3, 1.3});
        break;
      case JointType::kWeld:
        pen_.Box(ShapeStyle::kSolid, to(), places_.M, {0.7, 0.7, 0.7});
        break;
      case JointType::kFree:
        break;
      case JointType::kPinInSlot:
        Guide(0, ShapeStyle::kJoint, 1.0, 3.0);
        Axle(to(), places_.M, ShapeStyle::kSolid, 0.8, 0.55);
        break;
      case JointType::kRod:
        pen_.Add(ShapeKind::kBar, ShapeStyle::kRod, {On(from(), places_.F), On(to(), places_.M)},
                 0.25);
        pen_.Add(ShapeKind::kDisc, ShapeStyle::kJoint, {On(from(), places_.F)}, 0.5);
        pen_.Add(ShapeKind::kDisc, ShapeStyle::kJoint, {On(to(), places_.M)}, 0.5);
        break;
      case JointType::kCylindrical:
        Guide(2, ShapeStyle::kSolid, 0.3, 3.0);
        Axle(to(), places_.M, ShapeStyle::kJoint, 1.0, 0.9);
        break;
      case JointType::kSpherical:
        pen_.Add(ShapeKind::kDisc, ShapeStyle::kJoint, {On(from(), places_.F)}, 1.1);
        pen_.Add(ShapeKind::kDisc, ShapeStyle::kSolid, {On(to(), places_.M)}, 0.65);
        break;
      case JointType::kPlanar:
        pen_.Box(ShapeStyle::kGuide, from(), places_.F, {4.0, 4.0, 0.1});
        Axle(to(), places_.M, ShapeStyle::kJoint, 0.6, 0.9);
        break;
      case JointType::kUniversal:
        Line(from(), places_.F, {-1.4, 0, 0}, {1.4, 0, 0}, ShapeStyle::kSolid, 0.3);
        Line(to(), places_.M, {0, -1.4, 0}, {0, 1.4, 0}, ShapeStyle::kSolid, 0.3);
        pen_.Add(ShapeKind::kDisc, ShapeStyle::kJoint, {On(to(), places_.M)}, 0.5);
        break;
      case JointType::kHelical:
        Screw();
        break;
      default:
        pen_.Add(ShapeKind::kArea, ShapeStyle::kJoint,
                 pen_.On(to(), places_.M, {{1.2, 0, 0}, {0, 1.2, 0}, {-1.2, 0, 0}, {0, -1.2, 0}}));
    }
    for (const PrescribedMotion& motion : joint_.motions) Driven(motion.coordinate);
  }

 private:
  int from() const { return joint_.from.body; }
  int to() const { return joint_.to.body; }
  PicturePlace On(int body, const Frame& X) const { return {.body = body, .at = X.p}; }

  void Line(int body, const Frame& X, const Vector3d& a, const Vector3d& b, ShapeStyle style,
            double radius) {
    pen_.Add(ShapeKind::kBar, style, pen_.On(body, X, {a, b}), radius);
  }

  /// What turns about z: a disc where z is seen from its end.
  void Axle(int body, const Frame& X, ShapeStyle style, double half, double radius) {
    if (picture_.planar) {
      pen_.Add(ShapeKind::kDisc, style, {On(body, X)}, radius);
    } else {
      Line(body, X, {0, 0, -half}, {0, 0, half}, style, radius);
    }
  }

  void Pin(double radius) {
    if (!picture_.planar) {
      pen_.Add(ShapeKind::kLine, ShapeStyle::kGuide,
               pen_.On(from(), places_.F, {{0, 0, -2.6}, {0, 0, 2.6}}));
    }
    Axle(from(), places_.F, ShapeStyle::kJoint, 1.1, radius);
  }

  /// Along an axis of F as far as M is, and `beyond` further on both sides.
  void Guide(int axis, ShapeStyle style, double radius, double beyond) {
    const Frame X = Relative();
    const double reach = std::clamp(X.p[axis] / pen_.size(), -1e4, 1e4);
    const Points ends = {(std::min(reach, 0.0) - beyond) * Vector3d::Unit(axis),
                         (std::max(reach, 0.0) + beyond) * Vector3d::Unit(axis)};
    pen_.Add(ShapeKind::kBar, style, pen_.On(from(), places_.F, ends), radius);
  }

  /// M in F at the start.
  Frame Relative() const {
    const Frame P = picture_.start[static_cast<std::size_t>(from())],
                Q = picture_.start[static_cast<std::size_t>(to())];
    return (P * places_.F).Inverse() * (Q * places_.M);
  }

  void Screw() {
    Points thread;
    constexpr int kTurns = 5, kCorners = 10;
    for (int i = 0; i <= kTurns * kCorners; ++i) {
      const double angle = 2 * std::numbers::pi * i / kCorners;
      const double turn = std::copysign(angle, joint_.parameter);
      thread.push_back(
          {0.7 * std::cos(turn), 0.7 * std::sin(turn), 6.0 * i / (kTurns * kCorners) - 3.0});
    }
    pen_.Add(ShapeKind::kLine, ShapeStyle::kGuide, pen_.On(from(), places_.F, thread));
    Axle(to(), places_.M, ShapeStyle::kJoint, 1.0, 1.1);
  }

  /// What is fixed to Ground stands on a foot; in the plane a rail lies on hatched ground.
  /// `shift` is what it slides by. [m]
  void Ground(const Frame& X, double shift) {
    const bool slides =
        joint_.type == JointType::kPrismatic || joint_.type == JointType::kPinInSlot;
    if (!slides || !picture_.planar) return AddFoot(X.p, pen_, picture_);
    double reach = std::clamp(shift / pen_.size(), -1e4, 1e4);
    Vector3d along = X.R.col(0), down(along.y(), -along.x(), 0.0);
    // ground is below its rail, whichever way that is counted
    if (down.dot(picture_.up) > 0.0) {
      along = -along;
      down = -down;
      reach = -reach;
    }
    Frame rail{Eigen::Matrix3d::Identity(), X.p};
    rail.R << along, down, down.cross(along);
    Hatch(rail, std::min(reach, 0.0) - 4.0, std::max(reach, 0.0) + 4.0, 1.7, pen_);
  }

  /// An arrow about or along what follows a given motion.
  void Driven(int coordinate) {
    const auto words =
        ValueWords(joint_.type, picture_.planar ? SpaceKind::kPlanar : SpaceKind::kSpatial, false);
    const bool length = words.at(static_cast<std::size_t>(coordinate)).is_length();
    AddSweep(joint_, length, ShapeStyle::kDrive, 2.4, pen_);
  }

  const JointDescription& joint_;
  Pen pen_;
  const Picture& picture_;
  JointPlaces places_;
};

}  // namespace

void AddFoot(const Vector3d& at, Pen pen, const Picture& picture) {
  const Vector3d along = picture.planar ? Vector3d::UnitX() : picture.up.unitOrthogonal();
  const Vector3d down = -picture.up;
  Frame foot{Eigen::Matrix3d::Identity(), at};
  foot.R << along, down, down.cross(along);
  if (picture.planar) {
    pen.Add(ShapeKind::kArea, ShapeStyle::kGround,
            pen.On(kGround, foot, {{0, 0, 0}, {-1.6, 2.4, 0}, {1.6, 2.4, 0}}));
    return Hatch(foot, -1.6, 1.6, 2.4, pen);
  }
  // a pyramid whose base is the ground
  const Points base = {{-1.5, 2.2, -1.5}, {1.5, 2.2, -1.5}, {1.5, 2.2, 1.5}, {-1.5, 2.2, 1.5}};
  pen.Add(ShapeKind::kArea, ShapeStyle::kGround, pen.On(kGround, foot, base));
  for (const Vector3d& corner : base) {
    pen.Add(ShapeKind::kLine, ShapeStyle::kGround, pen.On(kGround, foot, {{0, 0, 0}, corner}));
  }
}

void AddSweep(const JointDescription& joint, bool straight, ShapeStyle style, double radius,
              Pen pen) {
  Points points;
  if (straight) {
    const bool along_z = TraitsOf(joint.type).own_axis == 'z';
    points = along_z ? Points{{radius, 0, 0}, {radius, 0, 4.5}}
                     : Points{{0, radius, 0}, {4.5, radius, 0}};
  } else {
    constexpr int kCorners = 16;
    for (int i = 0; i <= kCorners; ++i) {
      const double angle = (0.3 + 1.3 * i / kCorners) * std::numbers::pi;
      points.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
    }
  }
  pen.Add(ShapeKind::kArrow, style, pen.On(joint.from.body, PlacesOf(joint).F, points));
}

void AddJointShapes(const JointDescription& joint, Pen pen, const Picture& picture) {
  JointSymbol(joint, pen, picture).Draw();
}

}  // namespace loopbench::harness
