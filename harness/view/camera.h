// How a picture is seen: orthographic, so that parallel links stay parallel and lengths compare.
#pragma once

#include <string>
#include <vector>

#include "harness/view/picture.h"

namespace loopbench::harness {

/// A point of the paper [px], y downwards, with its height towards the viewer [m].
struct Spot {
  double x = 0.0, y = 0.0, depth = 0.0;
};

struct Camera {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  ///< rows: right, up, towards the viewer
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double scale = 1.0;                     ///< [px/m]
  double middle_x = 0.0, middle_y = 0.0;  ///< where `centre` is [px]

  Spot See(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d v = R * (p - centre);
    return {middle_x + scale * v.x(), middle_y - scale * v.y(), v.z()};
  }
};

/// Names of views: of the plane there is one, "front".
const std::vector<std::string>& ViewNames();
/// Right, up and towards the viewer of a named view.
Eigen::Matrix3d ViewNamed(const Picture& picture, const std::string& name);

/// A camera whose paper is `width` wide and just as high as all places of `poses` need it to be,
/// within limits; they end `margin` before its edges. The height goes to `*height`. [px]
Camera FitTo(const Picture& picture, const std::vector<const Poses*>& poses,
             const Eigen::Matrix3d& R, double width, double margin, double* height);

}  // namespace loopbench::harness
