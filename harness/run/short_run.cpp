#include "harness/run/short_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/integrator/arkode.h"
#include "harness/run/level_position.h"

namespace loopbench::harness {

namespace {

/// Where the bodies of a joint stand against each other.
template <class Space>
struct Stand {
  Pose<Space, double> X_PQ;     ///< axes and centres of mass
  Linear<Space, double> point;  ///< of the joint's M, from P's centre of mass in P's axes
};

template <class Space>
class Watching {
 public:
  explicit Watching(const MechanismDescription& description)
      : description_(description), mechanism_(description, Coordinates::kJoint) {}

  ShortRun Run(double duration, double cpu_s) {
    auto [system, y, failure] = StartAtLevelPosition<Space>(description_, mechanism_, "odca");
    run_.message = failure;
    if (system == nullptr) return run_;
    IntegratorOptions options;
    options.rtol = options.atol = 1e-6;
    options.time_limit_s = cpu_s;
    options.stop_times = mechanism_.stop_times();
    const auto observe = [&, &system = system](double t, std::span<double> state) {
      const bool restart = system->BeginStep(t, state);
      if (system->FromState(t, state) == Outcome::kFinished) Look(t, system->kinematics());
      return restart ? StepAction::kRestart : StepAction::kContinue;
    };
    const IntegratorResult result = Integrate(*system, 0.0, duration, y, options, observe);
    if (result.outcome != Outcome::kFinished) {
      run_.message = fmt::format(
          "it ended after {:.3g} s of {:.3g} s: {}", result.t_reached, duration,
          result.message.empty() ? ToString(result.outcome) : std::string_view(result.message));
    }
    return run_;
  }

 private:
  Stand<Space> StandOf(const Kinematics<Space, double>& kinematics, std::size_t index) const {
    const Joint<Space, double>& joint = mechanism_.joints()[index];
    Stand<Space> stand;
    stand.X_PQ = Compose(Inverse(kinematics.poses()[joint.from]), kinematics.poses()[joint.to]);
    stand.point = Compose(stand.X_PQ, joint.X_QM).p;
    return stand;
  }

  void Look(double t, const Kinematics<Space, double>& kinematics) {
    for (std::size_t j = 0; j < description_.joints.size(); ++j) {
      const Stand<Space> stand = StandOf(kinematics, j);
      if (first_.size() == j) first_.push_back(stand);
      Travel& travel = run_.travels[description_.joints[j].name];
      const Pose<Space, double> turned = Compose(Inverse(first_[j].X_PQ), stand.X_PQ);
      travel.turn = std::max(travel.turn, RotationVector(turned).norm());
      travel.shift = std::max(travel.shift, (stand.point - first_[j].point).norm());
    }
    for (const Velocity<Space, double>& V : kinematics.motions()) {
      run_.rate = std::max({run_.rate, V.angular.norm(), V.linear.norm() / mechanism_.length()});
    }
    run_.duration = t;
  }

  const MechanismDescription& description_;
  Mechanism<Space, double> mechanism_;
  std::vector<Stand<Space>> first_;
  ShortRun run_;
};

}  // namespace

ShortRun MakeShortRun(const MechanismDescription& description, double duration, double cpu_s) {
  return description.space == SpaceKind::kPlanar
             ? Watching<Planar>(description).Run(duration, cpu_s)
             : Watching<Spatial>(description).Run(duration, cpu_s);
}

}  // namespace loopbench::harness
