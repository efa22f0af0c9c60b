#include "harness/exchange/export_mjcf_shapes.h"

#include <algorithm>
#include <array>

#include "harness/exchange/export_mjcf_writer.h"

namespace loopbench::exchange {
namespace {

using Eigen::Vector3d;

/// Where joints are on each body, from its origin, then its centre of mass.
std::vector<std::vector<Vector3d>> PlacesOnBodies(const Model& model) {
  std::vector<std::vector<Vector3d>> places(model.bodies.size());
  const auto add = [&](int body, const Vec& at) {
    places[static_cast<std::size_t>(body)].push_back(FromOrigin(model, body, at));
  };
  for (const std::vector<Joint>* joints : {&model.tree, &model.cut}) {
    for (const Joint& joint : *joints) {
      add(joint.from, joint.F.p);
      add(joint.to, joint.M.p);
    }
  }
  for (std::size_t b = 0; b < model.bodies.size(); ++b) add(static_cast<int>(b), {});
  return places;
}

}  // namespace

std::vector<std::vector<std::string>> ShapesOf(const Model& model) {
  const auto places = PlacesOnBodies(model);
  double size = 0.0;  // of the largest body
  for (std::size_t b = 1; b < places.size(); ++b) {
    for (const Vector3d& at : places[b]) size = std::max(size, (at - places[b].front()).norm());
  }
  const double radius = size > 0.0 ? 0.02 * size : 0.05;
  std::vector<std::vector<std::string>> shapes(places.size());
  for (std::size_t b = 1; b < places.size(); ++b) {
    const Vector3d& first = places[b].front();
    // the centre of mass of a body with several joints says nothing of its form
    const std::size_t ends = std::max<std::size_t>(2, places[b].size() - 1);
    for (std::size_t i = 1; i < std::min(ends, places[b].size()); ++i) {
      const Vector3d& end = places[b][i];
      if (!((end - first).norm() > radius)) continue;
      const std::array both = {first[0], first[1], first[2], end[0], end[1], end[2]};
      shapes[b].push_back("<geom type=\"capsule\"" + Attribute("fromto", both) +
                          Attribute("size", radius) + "/>\n");
    }
    if (!shapes[b].empty()) continue;
    shapes[b].push_back("<geom type=\"sphere\"" + Attribute("pos", ToVec(places[b].back())) +
                        Attribute("size", 2.0 * radius) + "/>\n");
  }
  return shapes;
}

}  // namespace loopbench::exchange
