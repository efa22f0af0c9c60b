#include "mechanism/simplify/plane.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "mechanism/description/topology.h"
#include "mechanism/simplify/compile.h"
#include "mechanism/simplify/model.h"
#include "mechanism/simplify/restart.h"

namespace loopbench {

namespace {

using Matrix3 = Eigen::Matrix3d;
using Vector3 = Eigen::Vector3d;

/// Without its part along z.
Vector3 WithoutZ(const Vector3& v) { return {v.x(), v.y(), 0.0}; }

Frame FrameOf(const JointDescription& joint, const JointSide& side) {
  Frame X = PoseOf(side);
  X.R = X.R * AxisAlignment(joint);
  return X;
}

/// Flattens gravity, bodies and forces of a spatial description: `in_new(body, v)` is a vector of
/// the axes of a body in its new axes, R_CB(body) the orientation of the old axes in these.
template <class InNew, class Orientation>
void FlattenBodies(const InNew& in_new, const Orientation& R_CB, MechanismDescription* planar) {
  planar->space = SpaceKind::kPlanar;
  planar->gravity = WithoutZ(in_new(kGround, planar->gravity));
  for (int b = 0; b < static_cast<int>(planar->bodies.size()); ++b) {
    BodyDescription& body = planar->bodies[b];
    const Matrix3 R = R_CB(b);
    body.com = WithoutZ(in_new(b, body.com));
    body.inertia = R * body.inertia * R.transpose();
    body.inertia = (0.5 * (body.inertia + body.inertia.transpose())).eval();
    for (auto& [name, point] : body.points) point = WithoutZ(in_new(b, point));
  }
  for (ForceDescription& force : planar->forces) {
    const ForceParts parts = PartsOf(force);
    if (parts.force != nullptr) {
      const int body = *parts.in_body_axes ? parts.points[0]->body : kGround;
      *parts.force = WithoutZ(in_new(body, *parts.force));
    }
    for (BodyPoint* point : parts.points) point->at = WithoutZ(in_new(point->body, point->at));
  }
}

class PlaneSearch {
 public:
  explicit PlaneSearch(const MechanismDescription& description)
      : d_(description),
        normal_(description.bodies.size(), Vector3::Zero()),
        height_(description.bodies.size(), 0.0) {}

  std::string Why() {
    if (d_.space == SpaceKind::kPlanar) return "it is planar already";
    for (const JointDescription& joint : d_.joints) {
      if (!TraitsOf(joint.type).flat.possible) {
        return "joint \"" + joint.name + "\" is " + std::string(ToString(joint.type));
      }
      const bool one = NumValues(joint.type, SpaceKind::kSpatial, false) == 1;
      if (!joint.motions.empty() && !one) {
        return "joint \"" + joint.name + "\" follows a given motion in one of several coordinates";
      }
    }
    for (const Island& island : FindIslands(d_)) {
      if (!island.grounded) return "\"" + d_.bodies[island.bodies.front()].name + "\" floats";
    }
    const auto seed = std::ranges::find_if(
        d_.joints, [](const JointDescription& joint) { return TraitsOf(joint.type).flat.turns; });
    if (seed == d_.joints.end()) return "nothing turns";
    const std::string fault = Spread(static_cast<int>(seed - d_.joints.begin()));
    return fault.empty() ? TiltedSpring() : fault;
  }

  InPlane Express() const;

 private:
  /// Normals and heights from body to body, each joint checked. "" when all agree.
  std::string Spread(int seed) {
    const JointDescription& first = d_.joints[seed];
    std::vector<bool> known(d_.bodies.size(), false);
    std::vector<int> queue = {first.from.body};
    normal_[queue[0]] = FrameOf(first, first.from).R.col(2);
    known[queue[0]] = true;
    for (std::size_t k = 0; k < queue.size(); ++k) {
      for (const JointDescription& joint : d_.joints) {
        for (const auto& [here, there] :
             {std::pair{&joint.from, &joint.to}, {&joint.to, &joint.from}}) {
          if (here->body != queue[k]) continue;
          const Frame X_here = FrameOf(joint, *here), X_there = FrameOf(joint, *there);
          const Vector3 in_frame = X_here.R.transpose() * normal_[here->body];
          const InPlaneOf& kind = TraitsOf(joint.type).flat;
          if ((kind.turns && in_frame.head<2>().norm() > kParallel) ||
              (kind.slides && std::abs(in_frame.x()) > kParallel)) {
            return "joint \"" + joint.name + "\" leaves the plane of the others";
          }
          const Vector3 normal = X_there.R * in_frame;
          const double height =
              height_[here->body] + normal_[here->body].dot(X_here.p) - normal.dot(X_there.p);
          if (!known[there->body]) {
            known[there->body] = true;
            normal_[there->body] = normal.normalized();
            height_[there->body] = height;
            queue.push_back(there->body);
            continue;
          }
          const double arms = 1.0 + std::abs(height) + X_here.p.norm() + X_there.p.norm();
          if ((normal - normal_[there->body]).norm() > kParallel * 4 ||
              std::abs(height - height_[there->body]) > kParallel * arms) {
            return "the loop through joint \"" + joint.name + "\" is not level";
          }
        }
      }
    }
    const Vector3 n = normal_[kGround];
    Eigen::Index largest = 0;
    n.cwiseAbs().maxCoeff(&largest);
    const double zero = height_[kGround];
    for (std::size_t i = 0; i < normal_.size(); ++i) {
      height_[i] -= zero;
      if (n[largest] < 0.0) normal_[i] = -normal_[i], height_[i] = -height_[i];
    }
    return "";
  }

  /// The distance of points at two heights is no distance in the plane.
  std::string TiltedSpring() const {
    const auto height = [&](const BodyPoint& point) {
      return height_[point.body] + normal_[point.body].dot(point.at);
    };
    for (ForceDescription force : d_.forces) {
      const std::vector<BodyPoint*> points = PartsOf(force).points;
      if (points.size() < 2) continue;
      const BodyPoint &from = *points[0], &to = *points[1];
      const double arms = 1.0 + std::abs(height(from)) + from.at.norm() + to.at.norm();
      if (std::abs(height(from) - height(to)) > kParallel * arms) {
        return "a spring between \"" + d_.bodies[from.body].name + "\" and \"" +
               d_.bodies[to.body].name + "\" is not level";
      }
    }
    return "";
  }

  const MechanismDescription& d_;
  std::vector<Vector3> normal_;  ///< n in body axes
  std::vector<double> height_;   ///< of the body's origin along n, from the ground's [m]
};

/// Expresses one joint's sides in the new axes: positions and angles within the plane.
void FlattenJoint(const std::vector<Matrix3>& axes, const std::vector<Vector3>& normal,
                  JointDescription* joint, bool* mirrored) {
  const Frame X_PF = FrameOf(*joint, joint->from), X_QM = FrameOf(*joint, joint->to);
  const Vector3 n_F = X_PF.R.transpose() * normal[joint->from.body];
  // any direction of the frames across n can measure angles; the slide must be one
  const Vector3 across = std::abs(n_F.x()) < 0.5 ? Vector3::UnitX() : Vector3::UnitY();
  const auto flatten = [&](const Frame& X, JointSide* side) {
    const Matrix3& R = axes[side->body];
    const Vector3 along = R.transpose() * (X.R * across);
    side->rotation = {0.0, 0.0, std::atan2(along.y(), along.x())};
    side->position = WithoutZ(R.transpose() * side->position);
  };
  flatten(X_PF, &joint->from);
  flatten(X_QM, &joint->to);
  joint->axis.setZero();
  const JointTraits& traits = TraitsOf(joint->type);
  if (traits.flat.turns && n_F.z() < 0.0) {
    // seen from n it turns the other way: as it does seen from the other body
    if (NumValues(joint->type, SpaceKind::kSpatial, false) == 1) {
      std::swap(joint->from, joint->to);
    } else {
      *mirrored = true;
    }
  }
  if (traits.flat.is_free) joint->type = JointType::kFree;
}

InPlane PlaneSearch::Express() const {
  InPlane result;
  MechanismDescription& planar = result.description;
  planar = d_;
  std::vector<Matrix3> axes;
  for (std::size_t i = 0; i < d_.bodies.size(); ++i) {
    axes.push_back(AxesWithNormal(normal_[i]));
    result.X_CB.push_back({axes[i].transpose(), {0.0, 0.0, height_[i]}});
  }
  result.R_WC = axes[kGround];
  const auto in_new = [&](int body, const Vector3& v) -> Vector3 {
    return axes[body].transpose() * v;
  };
  result.gravity_dropped = in_new(kGround, d_.gravity).z();
  for (ForceDescription force : d_.forces) {
    const ForceParts parts = PartsOf(force);
    const int body =
        parts.force != nullptr && *parts.in_body_axes ? parts.points[0]->body : kGround;
    result.force_dropped.push_back(parts.force == nullptr ? 0.0 : in_new(body, *parts.force).z());
  }
  FlattenBodies(
      in_new, [&](int body) -> Matrix3 { return axes[body].transpose(); }, &planar);
  for (JointDescription& joint : planar.joints) {
    bool mirrored = false;
    FlattenJoint(axes, normal_, &joint, &mirrored);
    result.mirrored.push_back(mirrored);
  }
  for (auto* list : {&planar.initial.coordinates, &planar.initial.speeds}) {
    for (JointValues& values : *list) {
      if (!result.mirrored[values.joint]) continue;
      values.values[0] = -values.values[0];
      if (values.values.size() > 2) values.values[2] = -values.values[2];
    }
  }
  // speeds of bodies have other names in the plane
  std::erase_if(planar.independent,
                [](const std::string& name) { return name.find('.') != std::string::npos; });
  return result;
}

}  // namespace

Eigen::Matrix3d AxesWithNormal(const Vector3& n) {
  const Eigen::Vector3d near =
      std::abs(n.x()) < 0.9 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d x = (near - near.dot(n) * n).normalized();
  Eigen::Matrix3d axes;
  axes << x, n.cross(x), n;
  return axes;
}

std::optional<InPlane> ExpressInPlane(const MechanismDescription& description, std::string* why) {
  PlaneSearch search(description);
  *why = search.Why();
  if (!why->empty()) return std::nullopt;
  return search.Express();
}

// Replaces nearly planar motion by planar motion.

namespace {

/// A joint at the start: its frames in ground axes, its planar counterpart, and the deviation.
struct PlacedJoint {
  Frame X_WF, X_WM;
  JointType type = JointType::kRevolute;
  double tilt = 0.0;    ///< sine
  bool turned = false;  ///< its axis points the other way
  std::string why;      ///< why the plane has nothing for it
};

/// Main axis of the mechanism: parallel to revolute axes, normal to axes of sliders.
class Flattening {
 public:
  Flattening(const MechanismDescription& description, const BodyStarts& starts)
      : d_(description), starts_(starts) {
    for (const JointDescription& joint : d_.joints) {
      PlacedJoint flat;
      flat.X_WF = StartOf(joint.from.body).X * FrameOf(joint, joint.from);
      flat.X_WM = StartOf(joint.to.body).X * FrameOf(joint, joint.to);
      joints_.push_back(flat);
    }
    FindNormal();
    for (std::size_t j = 0; j < joints_.size(); ++j) Judge(d_.joints[j], &joints_[j]);
  }

  const std::vector<PlacedJoint>& joints() const { return joints_; }
  const Matrix3& R_WC() const { return R_WC_; }

  /// Returns the share of a spring's or rod's length along the normal (sine).
  double Tilt(const Vector3& between) const {
    const double length = between.norm();
    return length > 0.0 ? std::abs(between.dot(R_WC_.col(2))) / length : 0.0;
  }

  Vector3 PointInGround(const BodyPoint& point) const {
    const Frame& X = StartOf(point.body).X;
    return X.R * point.at + X.p;
  }

  MechanismDescription Express() const;

  const BodyStart& StartOf(int body) const {
    return starts_.at(body == kGround ? "" : d_.bodies[body].name);
  }

 private:
  void FindNormal() {
    Matrix3 axes = Matrix3::Zero();
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      const InPlaneOf& flat = TraitsOf(d_.joints[j].type).flat;
      const bool along = flat.turns || d_.joints[j].type == JointType::kCylindrical;
      const Vector3 z = joints_[j].X_WF.R.col(2), x = joints_[j].X_WF.R.col(0);
      if (along) axes += z * z.transpose();
      if (flat.slides) axes -= x * x.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Matrix3> solver(axes);
    Vector3 n = solver.eigenvectors().col(2);
    Eigen::Index largest = 0;
    n.cwiseAbs().maxCoeff(&largest);
    if (n[largest] < 0.0) n = -n;
    // an axis of the ground's that is this near is meant
    constexpr double kSame = 1e-9;
    for (int i = 0; i < 3; ++i) {
      if ((n - Vector3::Unit(i)).norm() < kSame) n = Vector3::Unit(i);
    }
    R_WC_ = AxesWithNormal(n);
  }

  void Judge(const JointDescription& joint, PlacedJoint* flat) const {
    const Vector3 n = R_WC_.col(2);
    const auto off = [&](const Vector3& axis) { return axis.cross(n).norm(); };   // from n
    const auto out = [&](const Vector3& axis) { return std::abs(axis.dot(n)); };  // of the plane
    const Vector3 z = flat->X_WF.R.col(2), x = flat->X_WF.R.col(0);
    flat->type = joint.type;
    flat->turned = z.dot(n) < 0.0;
    const InPlaneOf& kind = TraitsOf(joint.type).flat;
    if (kind.possible) {
      if (kind.turns) flat->tilt = std::max({flat->tilt, off(z), off(flat->X_WM.R.col(2))});
      if (kind.slides) flat->tilt = std::max(flat->tilt, out(x));
      if (kind.is_free) flat->why = "a planar joint holds nothing in the plane";
    } else if (joint.type == JointType::kSpherical) {
      flat->type = JointType::kRevolute;
      flat->turned = false;
    } else if (joint.type == JointType::kUniversal) {
      flat->type = JointType::kRevolute;
      flat->turned = false;
      flat->tilt = std::min(off(flat->X_WF.R.col(0)), off(flat->X_WM.R.col(1)));
    } else if (joint.type == JointType::kCylindrical) {
      flat->type = off(z) < out(z) ? JointType::kRevolute : JointType::kPrismatic;
      flat->tilt = flat->type == JointType::kRevolute ? off(z) : out(z);
    } else if (joint.type == JointType::kRod) {
      flat->tilt = Tilt(flat->X_WM.p - flat->X_WF.p);
    } else {
      flat->why = "the plane has no " + std::string(ToString(joint.type)) + " joint for it";
    }
    if (!joint.motions.empty() && NumValues(joint.type, SpaceKind::kSpatial, true) > 1) {
      flat->why = "its motion is prescribed in one of several coordinates";
    }
  }

  /// The part in the plane of a vector in ground axes, in the new axes.
  Vector3 InPlane(const Vector3& v) const { return WithoutZ(R_WC_.transpose() * v); }

  JointDescription FlatJoint(const JointDescription& joint, const PlacedJoint& flat) const;

  const MechanismDescription& d_;
  const BodyStarts& starts_;
  std::vector<PlacedJoint> joints_;
  Matrix3 R_WC_ = Matrix3::Identity();
};

/// All bodies have the ground's axes at the start, and every joint's frames are projected along the
/// normal. Coordinates keep their values, angles within half a turn; axes of opposite direction
/// swap the joint's sides.
JointDescription Flattening::FlatJoint(const JointDescription& joint,
                                       const PlacedJoint& flat) const {
  JointDescription changed = joint;
  changed.type = flat.type;
  changed.axis.setZero();
  if (flat.type != JointType::kRod) changed.parameter = 0.0;
  const auto angle = [&](const Vector3& axis) {
    const Vector3 v = InPlane(axis);
    return std::atan2(v.y(), v.x());
  };
  // a cylindrical joint along the plane slides along z
  const bool slides_on_z =
      joint.type == JointType::kCylindrical && flat.type == JointType::kPrismatic;
  const bool is_loose = joint.type == JointType::kSpherical || joint.type == JointType::kUniversal;
  const auto along = [&](const Frame& X) {
    return slides_on_z ? angle(X.R.col(2)) : angle(X.R.col(0));
  };
  const double at_from = is_loose ? 0.0 : along(flat.X_WF);
  const bool stays = flat.type == JointType::kPrismatic || flat.type == JointType::kWeld;
  const double opening = is_loose || stays ? 0.0 : along(flat.X_WM) - at_from;
  const double at_to = at_from + std::remainder(opening, 2.0 * std::numbers::pi);
  const auto place = [&](const Frame& X, double turn, JointSide* side) {
    side->position = InPlane(X.p - StartOf(side->body).X.p);
    side->rotation = {0.0, 0.0, turn};
  };
  place(flat.X_WF, at_from, &changed.from);
  place(flat.X_WM, at_to, &changed.to);
  if (flat.type == JointType::kRod) {
    changed.from.rotation.setZero();
    changed.to.rotation.setZero();
    changed.parameter = InPlane(flat.X_WM.p - flat.X_WF.p).norm();
  }
  if (flat.turned && flat.type == JointType::kRevolute) std::swap(changed.from, changed.to);
  return changed;
}

MechanismDescription Flattening::Express() const {
  MechanismDescription planar = d_;
  FlattenBodies(
      [&](int body, const Vector3& v) -> Vector3 {
        return R_WC_.transpose() * (StartOf(body).X.R * v);
      },
      [&](int body) -> Matrix3 { return R_WC_.transpose() * StartOf(body).X.R; }, &planar);
  planar.joints.clear();
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    planar.joints.push_back(FlatJoint(d_.joints[j], joints_[j]));
  }
  planar.independent.clear();
  return planar;
}

/// The bodies' starts as the plane has them: axes of the ground's, and motions within it.
BodyStarts FlatStarts(const BodyStarts& starts, const Matrix3& R_WC) {
  BodyStarts flat;
  for (const auto& [name, start] : starts) {
    BodyStart& one = flat[name];
    one.X.p = R_WC.transpose() * start.X.p;
    one.v = R_WC.transpose() * start.v;
    one.X.p.z() = one.v.z() = 0.0;
    one.w = {0.0, 0.0, R_WC.col(2).dot(start.w)};
  }
  return flat;
}

/// Returns "" or the obstacle to a planar description, for any limit.
std::string Judged(const MechanismDescription& description, const Flattening& flattening,
                   double limit, Simplified* result) {
  std::string fault;
  for (std::size_t j = 0; j < flattening.joints().size(); ++j) {
    const PlacedJoint& flat = flattening.joints()[j];
    const std::string what = "joint \"" + description.joints[j].name + "\"";
    result->candidates.push_back({what, flat.tilt, flat.why.empty() && flat.tilt <= limit,
                                  flat.why.empty() ? "" : flat.why});
    if (fault.empty() && !flat.why.empty()) fault = what + ": " + flat.why;
    if (fault.empty() && flat.tilt > limit)
      fault = what + " is tilted by " + NumberText(flat.tilt, 4);
  }
  for (ForceDescription force : description.forces) {
    const ForceParts parts = PartsOf(force);
    if (parts.points.size() < 2) continue;
    const Vector3 between =
        flattening.PointInGround(*parts.points[1]) - flattening.PointInGround(*parts.points[0]);
    const double tilt = flattening.Tilt(between);
    result->candidates.push_back({std::string(parts.name), tilt, tilt <= limit, ""});
    if (fault.empty() && tilt > limit) {
      fault = "a " + std::string(parts.name) + " is tilted by " + NumberText(tilt, 4);
    }
  }
  return fault;
}

}  // namespace

Simplified FlattenNearly(const MechanismDescription& description, const ShortRun&,
                         const SimplifyOptions& options) {
  Simplified result;
  result.parts = {description};
  if (description.space == SpaceKind::kPlanar) {
    result.why_not = "it is planar already";
    return result;
  }
  std::string why;
  if (ExpressInPlane(description, &why)) {
    result.why_not = "it is planar exactly: see planar";
    return result;
  }
  const BodyStarts starts = AssembledStart(description, &result.why_not);
  if (!result.applies()) return result;
  const Flattening flattening(description, starts);
  result.why_not = Judged(description, flattening, options.nearly_planar, &result);
  if (result.applies()) {
    MechanismDescription planar = flattening.Express();
    result.why_not = StartAt(FlatStarts(starts, flattening.R_WC()), &planar);
    if (result.applies()) {
      result.parts = {std::move(planar)};
      result.R_WC = flattening.R_WC();
      const Vector3 n = result.R_WC.col(2);
      result.done.push_back("the motion is projected along (" + NumberText(n.x(), 4) + ", " +
                            NumberText(n.y(), 4) + ", " + NumberText(n.z(), 4) + ")");
      const double along = n.dot(description.gravity);
      if (along != 0.0)
        result.dropped.push_back("gravity along it, " + NumberText(along, 4) + " m/s^2");
      result.dropped.push_back(
          "motions out of the plane, and rotations of bodies about axes in it");
    }
  }
  if (!result.applies()) {
    for (Candidate& candidate : result.candidates) candidate.taken = false;
  }
  return result;
}

}  // namespace loopbench
