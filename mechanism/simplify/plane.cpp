#include "mechanism/simplify/plane.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "mechanism/description/joint_frames.h"
#include "mechanism/description/topology.h"

namespace loopbench {

namespace {

using Matrix3 = Eigen::Matrix3d;
using Vector3 = Eigen::Vector3d;

Frame FrameOf(const JointDescription& joint, const JointSide& side) {
  Frame X = PoseOf(side);
  X.R = X.R * AxisAlignment(joint);
  return X;
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

/// Without its part along z.
Vector3 WithoutZ(const Vector3& v) { return {v.x(), v.y(), 0.0}; }

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
  planar.space = SpaceKind::kPlanar;
  std::vector<Matrix3> axes;
  for (std::size_t i = 0; i < d_.bodies.size(); ++i) {
    const Matrix3 R = AxesWithNormal(normal_[i]);
    axes.push_back(R);
    Frame X_CB;
    X_CB.R = R.transpose();
    X_CB.p.z() = height_[i];
    result.X_CB.push_back(X_CB);
    BodyDescription& body = planar.bodies[i];
    body.com = WithoutZ(R.transpose() * body.com);
    body.inertia = R.transpose() * body.inertia * R;
    body.inertia = (0.5 * (body.inertia + body.inertia.transpose())).eval();
    for (auto& [name, point] : body.points) point = WithoutZ(R.transpose() * point);
  }
  result.R_WC = axes[kGround];
  const Vector3 gravity = result.R_WC.transpose() * d_.gravity;
  result.gravity_dropped = gravity.z();
  planar.gravity = WithoutZ(gravity);
  for (JointDescription& joint : planar.joints) {
    bool mirrored = false;
    FlattenJoint(axes, normal_, &joint, &mirrored);
    result.mirrored.push_back(mirrored);
  }
  for (ForceDescription& force : planar.forces) {
    const ForceParts parts = PartsOf(force);
    result.force_dropped.push_back(0.0);
    if (parts.force != nullptr) {
      const Matrix3& R = axes[*parts.in_body_axes ? parts.points[0]->body : kGround];
      const Vector3 f = R.transpose() * *parts.force;
      result.force_dropped.back() = f.z();
      *parts.force = WithoutZ(f);
    }
    for (BodyPoint* point : parts.points) {
      point->at = WithoutZ(axes[point->body].transpose() * point->at);
    }
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

}  // namespace loopbench
