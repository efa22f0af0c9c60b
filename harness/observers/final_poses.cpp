#include "harness/observers/final_poses.h"

namespace loopbench::harness {

template <class Space>
void WriteFinalPoses(const MechanismDescription& user, const Compiled& compiled, int part,
                     const Kinematics<Space, double>& kinematics, Record& record) {
  const std::size_t stride = 1 + user.bodies.size() / kMostFinalBodies;
  for (std::size_t i = 0; i < user.bodies.size(); i += stride) {
    const BodyImage& image = compiled.bodies[i];
    if (image.part != part) continue;
    const Frame X = UserPose(compiled, static_cast<int>(i), &kinematics);
    std::vector<double> pose{X.p.x(), X.p.y()};
    bool planar = false;
    if constexpr (Space::kRot == 1) planar = user.space == SpaceKind::kPlanar;
    if (planar) {
      if constexpr (Space::kRot == 1) {
        pose.push_back(kinematics.poses()[image.body].angle + image.turn);
      }
    } else {
      pose.push_back(X.p.z());
      for (const int axis : {0, 1}) {
        for (const int row : {0, 1, 2}) pose.push_back(X.R(row, axis));
      }
    }
    record.Set("series.final." + user.bodies[i].name, std::move(pose));
  }
}

template void WriteFinalPoses(const MechanismDescription&, const Compiled&, int,
                              const Kinematics<Planar, double>&, Record&);
template void WriteFinalPoses(const MechanismDescription&, const Compiled&, int,
                              const Kinematics<Spatial, double>&, Record&);

}  // namespace loopbench::harness
