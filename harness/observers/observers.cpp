// Registration of observers, and final poses.
#include <algorithm>

#include "harness/observers/registry.h"
#include "mechanism/description/registration.h"

namespace loopbench::harness {
namespace {

std::deque<ObserverRow>& Rows() {
  static std::deque<ObserverRow> rows;
  return rows;
}

}  // namespace

void RegisterObserver(ObserverRow row, int alignment) {
  const bool taken = std::ranges::find(Rows(), row.name, &ObserverRow::name) != Rows().end();
  RequireSound({.kind = "observer",
                .name = row.name,
                .is_taken = taken,
                .has_sentence = !row.sentence.empty(),
                .has_factories = row.planar && row.spatial,
                .alignment = alignment});
  AddMeasures(row.measures);
  Rows().push_back(std::move(row));
}

const std::deque<ObserverRow>& RegisteredObservers() { return Rows(); }

template <class Space>
void WriteFinalPoses(const MechanismDescription& user, const Compiled& compiled, int part,
                     const Kinematics<Space, double>& kinematics, Record& record) {
  const std::size_t stride = 1 + user.bodies.size() / kMaxFinalBodies;
  for (std::size_t i = 0; i < user.bodies.size(); i += stride) {
    const BodyImage& image = compiled.bodies[i];
    if (image.part != part) continue;
    const Frame X = UserPose(compiled, static_cast<int>(i), &kinematics);
    std::vector<double> pose{X.p.x(), X.p.y()};
    if (user.space == SpaceKind::kPlanar) {
      // its parts are planar, too
      if constexpr (Space::kRot == 1) {
        pose.push_back(kinematics.poses()[image.body].angle + image.turn);
      }
    } else {
      pose.push_back(X.p.z());
      pose.insert(pose.end(), X.R.data(), X.R.data() + 6);
    }
    record.Set("series.final." + user.bodies[i].name, std::move(pose));
  }
}

template void WriteFinalPoses(const MechanismDescription&, const Compiled&, int,
                              const Kinematics<Planar, double>&, Record&);
template void WriteFinalPoses(const MechanismDescription&, const Compiled&, int,
                              const Kinematics<Spatial, double>&, Record&);

}  // namespace loopbench::harness
