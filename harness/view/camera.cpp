#include "harness/view/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace loopbench::harness {

using Eigen::Vector3d;

const std::vector<std::string>& ViewNames() {
  static const std::vector<std::string> names = {"oblique", "front", "side", "top"};
  return names;
}

Eigen::Matrix3d ViewNamed(const Picture& picture, const std::string& name) {
  if (picture.planar) return Eigen::Matrix3d::Identity();
  // azimuth and elevation of the viewer [degrees] about what is up
  double azimuth = -62.0, elevation = 22.0;
  if (name == "front") azimuth = -90.0, elevation = 0.0;
  if (name == "side") azimuth = 0.0, elevation = 0.0;
  if (name == "top") azimuth = -90.0, elevation = 89.999;  // right is still known
  const Vector3d& up = picture.up;
  const Vector3d axis = std::abs(up.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d a = (axis - axis.dot(up) * up).normalized(), b = up.cross(a);
  constexpr double kDegree = std::numbers::pi / 180.0;
  const Vector3d level = std::cos(azimuth * kDegree) * a + std::sin(azimuth * kDegree) * b;
  const Vector3d viewer =
      std::cos(elevation * kDegree) * level + std::sin(elevation * kDegree) * up;
  Eigen::Matrix3d R;
  R.row(0) = up.cross(viewer).normalized();
  R.row(2) = viewer;
  R.row(1) = viewer.cross(Vector3d(R.row(0)));
  return R;
}

Camera FitTo(const Picture& picture, const std::vector<const Poses*>& poses,
             const Eigen::Matrix3d& R, double width, double margin, double* height) {
  Eigen::AlignedBox3d box;
  for (const PictureShape& shape : picture.shapes) {
    for (const PicturePlace& place : shape.places) {
      for (const Poses* one : poses) box.extend(R * place.In(*one));
    }
  }
  if (box.isEmpty()) box.extend(Vector3d::Zero());
  // half of a pin, of a bar
  const double around = 2.0 * picture.symbol;
  const Vector3d size = box.sizes() + Vector3d::Constant(2.0 * around);
  constexpr double kLowest = 90.0, kHighest = 560.0;
  const double across = width - 2.0 * margin;
  Camera camera{.R = R, .centre = R.transpose() * box.center()};
  camera.scale = std::min(across / size.x(), (kHighest - 2.0 * margin) / size.y());
  *height = std::max(kLowest, camera.scale * size.y() + 2.0 * margin);
  camera.middle_x = 0.5 * width;
  camera.middle_y = 0.5 * *height;
  return camera;
}

}  // namespace loopbench::harness
