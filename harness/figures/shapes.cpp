#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "harness/figures/view.h"

namespace loopbench::harness {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

std::vector<int> Distinct(const Points& points, double tolerance) {
  std::vector<int> kept;
  for (int i = 0; i < static_cast<int>(points.size()); ++i) {
    const bool is_new = std::ranges::none_of(
        kept, [&](int k) { return (points[k] - points[i]).norm() <= tolerance; });
    if (is_new) kept.push_back(i);
  }
  return kept;
}

template <class Measure>
int Farthest(const std::vector<int>& among, Measure measure) {
  return *std::ranges::max_element(among, {}, measure);
}

/// Returns the planar hull, counter-clockwise about `normal` (Andrew's monotone chain).
std::vector<int> Polygon(const Points& points, std::vector<int> order, const Vector3d& along,
                         const Vector3d& normal) {
  const Vector3d x = along.normalized(), y = normal.cross(x).normalized();
  const auto at = [&](int i) { return Eigen::Vector2d(points[i].dot(x), points[i].dot(y)); };
  std::ranges::sort(order, [&](int a, int b) {
    const Eigen::Vector2d p = at(a), q = at(b);
    return p.x() != q.x() ? p.x() < q.x() : p.y() < q.y();
  });
  std::vector<int> hull;
  const auto add = [&](int i, std::size_t least) {
    while (hull.size() > least) {
      const Eigen::Vector2d a = at(hull[hull.size() - 2]), b = at(hull.back()), c = at(i);
      if ((b - a).x() * (c - a).y() - (b - a).y() * (c - a).x() > 0.0) break;
      hull.pop_back();
    }
    hull.push_back(i);
  };
  for (const int i : order) add(i, 1);
  const std::size_t lower = hull.size();
  for (auto i = order.rbegin() + 1; i != order.rend(); ++i) add(*i, lower);
  hull.pop_back();
  return hull;
}

/// Returns all triples with every point on one side.
std::vector<std::vector<int>> Triangles(const Points& points, const std::vector<int>& kept,
                                        double tolerance) {
  std::vector<std::vector<int>> faces;
  const std::size_t n = kept.size();
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = a + 1; b < n; ++b) {
      for (std::size_t c = b + 1; c < n; ++c) {
        const Vector3d normal =
            (points[kept[b]] - points[kept[a]]).cross(points[kept[c]] - points[kept[a]]);
        if (normal.norm() <= tolerance * tolerance) continue;
        bool above = false, below = false;
        for (const int i : kept) {
          const double height = normal.normalized().dot(points[i] - points[kept[a]]);
          above = above || height > tolerance;
          below = below || height < -tolerance;
        }
        if (!(above && below)) faces.push_back({kept[a], kept[b], kept[c]});
      }
    }
  }
  return faces;
}

}  // namespace

std::vector<std::vector<int>> HullFaces(const Points& points, double tolerance) {
  const std::vector<int> kept = Distinct(points, tolerance);
  if (kept.size() < 2) return {};
  const Vector3d& origin = points[kept.front()];
  const int far = Farthest(kept, [&](int i) { return (points[i] - origin).norm(); });
  const int other = Farthest(kept, [&](int i) { return (points[i] - points[far]).norm(); });
  const Vector3d along = points[other] - points[far];
  const auto off_line = [&](int i) {
    return along.normalized().cross(points[i] - points[far]).norm();
  };
  const int aside = Farthest(kept, off_line);
  if (off_line(aside) <= tolerance) return {{std::min(far, other), std::max(far, other)}};
  const Vector3d normal = along.cross(points[aside] - points[far]).normalized();
  const bool flat = std::ranges::all_of(
      kept, [&](int i) { return std::abs(normal.dot(points[i] - points[far])) <= tolerance; });
  if (flat) return {Polygon(points, kept, along, normal)};
  constexpr std::size_t kMost = 24;
  return kept.size() > kMost ? std::vector<std::vector<int>>() : Triangles(points, kept, tolerance);
}

JointPlaces PlacesOf(const JointDescription& joint) {
  const Frame aligned{AxisAlignment(joint), Vector3d::Zero()};
  return {PoseOf(joint.from) * aligned, PoseOf(joint.to) * aligned};
}

std::vector<std::vector<Vector3d>> Attachments(const MechanismDescription& description) {
  std::vector<std::vector<Vector3d>> points(description.bodies.size());
  const auto add = [&](int body, const Vector3d& at) { points[body].push_back(at); };
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
    for (const auto& [name, at] : body.points) own.push_back(at);
    const bool is_one_place = std::ranges::all_of(own, [&](const Vector3d& p) {
      return (p - own.front()).norm() <= 1e-9 * (p.norm() + own.front().norm());
    });
    if (is_one_place) own.push_back(body.com);
  }
  return points;
}

namespace {

/// A frame on a body, in body axes from the body's origin.
struct End {
  int body;
  Frame X;

  PicturePlace Place() const { return {.body = body, .at = X.p}; }
};

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
  std::vector<PicturePlace> On(const End& end, const Points& points) const {
    std::vector<PicturePlace> places;
    for (const Vector3d& point : points) {
      places.push_back({.body = end.body, .at = end.X.p + end.X.R * (size() * point)});
    }
    return places;
  }
  /// Adds a box about the origin of a frame, with half sides `half` [symbol sizes]; flat if planar.
  void Box(ShapeStyle style, const End& end, const Vector3d& half) {
    const auto face = [&](int normal, double side) {
      const int a = (normal + 1) % 3, b = (normal + 2) % 3;
      std::vector<Vector3d> corners(4, side * half[normal] * Vector3d::Unit(normal));
      for (std::size_t i = 0; i < 4; ++i) {
        corners[i][a] = (i == 0 || i == 3 ? -1 : 1) * half[a];
        corners[i][b] = (i < 2 ? -1 : 1) * half[b];
      }
      Add(ShapeKind::kArea, style, On(end, corners));
    };
    if (picture_->planar) return face(2, 0.0);
    for (int normal = 0; normal < 3; ++normal) {
      face(normal, -1.0);
      face(normal, 1.0);
    }
  }

 private:
  Picture* picture_;
  int item_;
};

// Symbols of joints, by their free directions. Joints of other programs have a plain diamond.

/// Adds hatched ground `below` the origin of a frame whose y points down.
void Hatch(const Frame& foot, double from, double to, double below, Pen pen) {
  const auto line = [&](const Points& points) {
    pen.Add(ShapeKind::kLine, ShapeStyle::kGround, pen.On({kGround, foot}, points));
  };
  line({{from - 0.5, below, 0}, {to + 0.5, below, 0}});
  constexpr int kMaxHatches = 60;
  const int hatches = std::clamp(static_cast<int>((to - from) / 0.8), 4, kMaxHatches);
  for (int i = 0; i <= hatches; ++i) {
    const double x = from + (to - from) * i / hatches;
    line({{x + 0.4, below, 0}, {x - 0.4, below + 0.8, 0}});
  }
}

/// Adds the support of a point of Ground: a hatched triangle, or a pyramid in space.
void AddFoot(const Vector3d& at, Pen pen, const Picture& picture) {
  const Vector3d along = picture.planar ? Vector3d::UnitX() : picture.up.unitOrthogonal();
  const Vector3d down = -picture.up;
  Frame foot{Eigen::Matrix3d::Identity(), at};
  foot.R << along, down, down.cross(along);
  if (picture.planar) {
    pen.Add(ShapeKind::kArea, ShapeStyle::kGround,
            pen.On({kGround, foot}, {{0, 0, 0}, {-1.6, 2.4, 0}, {1.6, 2.4, 0}}));
    return Hatch(foot, -1.6, 1.6, 2.4, pen);
  }
  // a pyramid with its base on the ground
  const Points base = {{-1.5, 2.2, -1.5}, {1.5, 2.2, -1.5}, {1.5, 2.2, 1.5}, {-1.5, 2.2, 1.5}};
  pen.Add(ShapeKind::kArea, ShapeStyle::kGround, pen.On({kGround, foot}, base));
  for (const Vector3d& corner : base) {
    pen.Add(ShapeKind::kLine, ShapeStyle::kGround, pen.On({kGround, foot}, {{0, 0, 0}, corner}));
  }
}

/// Adds an arrow along x of a joint's frame F (z if its axis is z), or about z.
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
  pen.Add(ShapeKind::kArrow, style, pen.On({joint.from.body, PlacesOf(joint).F}, points));
}

/// Draws one joint; guides span the distance of the bodies at the picture's start. z is its
/// rotation axis, x its sliding axis.
class JointSymbol {
 public:
  JointSymbol(const JointDescription& joint, Pen pen, const Picture& picture)
      : joint_(joint),
        pen_(pen),
        picture_(picture),
        from_{joint.from.body, PlacesOf(joint).F},
        to_{joint.to.body, PlacesOf(joint).M} {}

  void Draw() {
    // a free joint supports nothing
    const bool holds = joint_.type != JointType::kFree;
    if (holds && joint_.from.body == kGround) Ground(from_.X, Relative().p.x());
    if (holds && joint_.to.body == kGround) Ground(to_.X, 0.0);
    switch (joint_.type) {
      case JointType::kRevolute:
        if (!picture_.planar) {
          pen_.Add(ShapeKind::kLine, ShapeStyle::kGuide,
                   pen_.On(from_, {{0, 0, -2.6}, {0, 0, 2.6}}));
        }
        Axle(from_, ShapeStyle::kJoint, 1.1, 0.8);
        break;
      case JointType::kPrismatic:
        Guide(0, ShapeStyle::kGuide, 0.3, 4.0);
        pen_.Box(ShapeStyle::kJoint, to_, {2.2, 1.3, 1.3});
        break;
      case JointType::kWeld:
        pen_.Box(ShapeStyle::kSolid, to_, {0.7, 0.7, 0.7});
        break;
      case JointType::kFree:
        break;
      case JointType::kPinInSlot:
        Guide(0, ShapeStyle::kJoint, 1.0, 3.0);
        Axle(to_, ShapeStyle::kSolid, 0.8, 0.55);
        break;
      case JointType::kRod:
        pen_.Add(ShapeKind::kBar, ShapeStyle::kRod, {from_.Place(), to_.Place()}, 0.25);
        Disc(from_, ShapeStyle::kJoint, 0.5);
        Disc(to_, ShapeStyle::kJoint, 0.5);
        break;
      case JointType::kCylindrical:
        Guide(2, ShapeStyle::kSolid, 0.3, 3.0);
        Axle(to_, ShapeStyle::kJoint, 1.0, 0.9);
        break;
      case JointType::kSpherical:
        Disc(from_, ShapeStyle::kJoint, 1.1);
        Disc(to_, ShapeStyle::kSolid, 0.65);
        break;
      case JointType::kPlanar:
        pen_.Box(ShapeStyle::kGuide, from_, {4.0, 4.0, 0.1});
        Axle(to_, ShapeStyle::kJoint, 0.6, 0.9);
        break;
      case JointType::kUniversal:
        Line(from_, {-1.4, 0, 0}, {1.4, 0, 0}, ShapeStyle::kSolid, 0.3);
        Line(to_, {0, -1.4, 0}, {0, 1.4, 0}, ShapeStyle::kSolid, 0.3);
        Disc(to_, ShapeStyle::kJoint, 0.5);
        break;
      case JointType::kHelical:
        Screw();
        break;
      case JointType::kSchoenflies:
        Axle(to_, ShapeStyle::kSolid, 2.2, 0.3);
        [[fallthrough]];
      case JointType::kTranslation:
        pen_.Box(ShapeStyle::kJoint, to_, {1.3, 1.3, 1.3});
        break;
      case JointType::kPointOnLine:
        Guide(0, ShapeStyle::kGuide, 0.3, 4.0);
        Disc(to_, ShapeStyle::kSolid, 0.65);
        break;
      case JointType::kPointInPlane:
        pen_.Box(ShapeStyle::kGuide, from_, {4.0, 4.0, 0.1});
        Disc(to_, ShapeStyle::kSolid, 0.65);
        break;
      default:
        pen_.Add(ShapeKind::kArea, ShapeStyle::kJoint,
                 pen_.On(to_, {{1.2, 0, 0}, {0, 1.2, 0}, {-1.2, 0, 0}, {0, -1.2, 0}}));
    }
    for (const PrescribedMotion& motion : joint_.motions) Driven(motion.coordinate);
  }

 private:
  void Line(const End& end, const Vector3d& a, const Vector3d& b, ShapeStyle style, double radius) {
    pen_.Add(ShapeKind::kBar, style, pen_.On(end, {a, b}), radius);
  }
  void Disc(const End& end, ShapeStyle style, double radius) {
    pen_.Add(ShapeKind::kDisc, style, {end.Place()}, radius);
  }

  /// Adds an axle about z: a disc if seen along z.
  void Axle(const End& end, ShapeStyle style, double half, double radius) {
    if (picture_.planar) return Disc(end, style, radius);
    Line(end, {0, 0, -half}, {0, 0, half}, style, radius);
  }

  /// Adds a guide along an axis of F up to M, extended by `beyond` on both sides.
  void Guide(int axis, ShapeStyle style, double radius, double beyond) {
    const Frame X = Relative();
    const double reach = std::clamp(X.p[axis] / pen_.size(), -1e4, 1e4);
    const Points ends = {(std::min(reach, 0.0) - beyond) * Vector3d::Unit(axis),
                         (std::max(reach, 0.0) + beyond) * Vector3d::Unit(axis)};
    pen_.Add(ShapeKind::kBar, style, pen_.On(from_, ends), radius);
  }

  Frame Relative() const {
    const Frame P = picture_.start[from_.body], Q = picture_.start[to_.body];
    return (P * from_.X).Inverse() * (Q * to_.X);
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
    pen_.Add(ShapeKind::kLine, ShapeStyle::kGuide, pen_.On(from_, thread));
    Axle(to_, ShapeStyle::kJoint, 1.0, 1.1);
  }

  /// Adds the support of a joint on Ground: a foot, or in the plane hatched ground for a rail.
  /// `shift`: displacement of the slider [m].
  void Ground(const Frame& X, double shift) {
    const bool slides =
        joint_.type == JointType::kPrismatic || joint_.type == JointType::kPinInSlot;
    if (!slides || !picture_.planar) return AddFoot(X.p, pen_, picture_);
    double reach = std::clamp(shift / pen_.size(), -1e4, 1e4);
    Vector3d along = X.R.col(0), down(along.y(), -along.x(), 0.0);
    // ground is below its rail for both directions of the axis
    if (down.dot(picture_.up) > 0.0) {
      along = -along;
      down = -down;
      reach = -reach;
    }
    Frame rail{Eigen::Matrix3d::Identity(), X.p};
    rail.R << along, down, down.cross(along);
    Hatch(rail, std::min(reach, 0.0) - 4.0, std::max(reach, 0.0) + 4.0, 1.7, pen_);
  }

  /// Adds an arrow about or along a coordinate with a prescribed motion.
  void Driven(int coordinate) {
    const auto words =
        ValueWords(joint_.type, picture_.planar ? SpaceKind::kPlanar : SpaceKind::kSpatial, false);
    const bool length = words.at(static_cast<std::size_t>(coordinate)).is_length();
    AddSweep(joint_, length, ShapeStyle::kDrive, 2.4, pen_);
  }

  const JointDescription& joint_;
  Pen pen_;
  const Picture& picture_;
  End from_, to_;
};

// Symbols of forces: springs, dashpots, arrows. Forces of other programs have an arrow at a joint,
// or a ring at each of their points.

/// Adds a shape between the frames of a sliding joint, next to its guide.
void AddBeside(const JointDescription& joint, ShapeKind kind, ShapeStyle style, double y, Pen pen) {
  const JointPlaces X = PlacesOf(joint);
  pen.Add(kind, style,
          {pen.On({joint.from.body, X.F}, {{0, y, 0}}).front(),
           pen.On({joint.to.body, X.M}, {{0, y, 0}}).front()},
          0.7);
}

/// Adds part of a circle or spiral about z of a frame; angles in half turns.
void AddArc(const End& end, double angle, double sweep, double radius, double growth,
            ShapeStyle style, Pen pen) {
  Points arc;
  constexpr int kCorners = 44;
  for (int i = 0; i <= kCorners; ++i) {
    const double at = (angle + sweep * i / kCorners) * std::numbers::pi;
    const double r = radius + growth * i / kCorners;
    arc.push_back({r * std::cos(at), r * std::sin(at), 0});
  }
  pen.Add(ShapeKind::kLine, style, pen.On(end, arc));
}

void AddAtJoint(const JointDescription& joint, bool length, const ForceDescription& force,
                Pen pen) {
  const JointPlaces X = PlacesOf(joint);
  if (std::holds_alternative<JointSpring>(force)) {
    if (length) return AddBeside(joint, ShapeKind::kSpring, ShapeStyle::kSpring, 1.9, pen);
    return AddArc({joint.from.body, X.F}, 0.0, 5.5, 0.9, 1.3, ShapeStyle::kSpring, pen);
  }
  if (std::holds_alternative<JointDamper>(force)) {
    if (length) return AddBeside(joint, ShapeKind::kDamper, ShapeStyle::kDamper, -1.9, pen);
    AddArc({joint.to.body, X.M}, 1.0, 0.5, 1.5, 0.0, ShapeStyle::kDamper, pen);
    return AddArc({joint.from.body, X.F}, 0.9, 0.7, 1.9, 0.0, ShapeStyle::kDamper, pen);
  }
  AddSweep(joint, length, ShapeStyle::kForce, 3.1, pen);
}

/// Adds the shapes of a force; returns the position of its name.
PicturePlace AddForceShapes(const MechanismDescription& description, ForceDescription force,
                            Pen pen, const Picture& picture) {
  const ForceParts parts = PartsOf(force);
  if (parts.joint != nullptr) {
    const JointDescription& joint = description.joints[*parts.joint];
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

// Shapes of bodies, and of the whole picture.

void AddBody(const BodyDescription& body, int index, const std::vector<Vector3d>& points,
             bool boxed, Pen pen, Picture* picture) {
  const auto on_body = [index](const Vector3d& at) {
    return PicturePlace{.body = index, .at = at};
  };
  const auto faces = HullFaces(points, 0.3 * pen.size());
  PictureItem& item = picture->items[index];
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& p : points) middle += p / static_cast<double>(points.size());
  for (const std::vector<int>& face : faces) {
    std::vector<PicturePlace> corners;
    for (const int i : face) corners.push_back(on_body(points[i]));
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
  // a body with a single attachment that slides already has the slider's box
  if (faces.empty() && !star && !boxed) {
    pen.Add(ShapeKind::kDisc, ShapeStyle::kBody, {on_body(middle)}, 1.7);
  }
  item.anchor = on_body(middle);
  if (picture->bodies > kMaxDetailed) return;
  // a line connects a centre of mass outside of the body
  const bool inside = std::ranges::any_of(
      points, [&](const Vector3d& p) { return (p - body.com).norm() <= 0.5 * pen.size(); });
  if (!inside && !faces.empty() && faces.front().size() == 2) {
    const Vector3d a = points[faces.front()[0]], along = points[faces.front()[1]] - a;
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
    if (joint.type == JointType::kPrismatic) boxed[joint.to.body] = true;
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
    JointSymbol(joint, Pen(picture, item), *picture).Draw();
  }
  std::ranges::stable_sort(picture->shapes, {},
                           [](const PictureShape& shape) { return TraitsOf(shape.style).floor; });
}

}  // namespace loopbench::harness
