#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/integrator/arkode.h"
#include "harness/run/run.h"

namespace loopbench::harness {

namespace {

/// Relative poses of the bodies of a joint.
template <class Space>
struct RelativePose {
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
  RelativePose<Space> StandOf(const Kinematics<Space, double>& kinematics,
                              std::size_t index) const {
    const Joint<Space, double>& joint = mechanism_.joints()[index];
    RelativePose<Space> stand;
    stand.X_PQ = Compose(Inverse(kinematics.poses()[joint.from]), kinematics.poses()[joint.to]);
    stand.point = Compose(stand.X_PQ, joint.X_QM).p;
    return stand;
  }

  void Look(double t, const Kinematics<Space, double>& kinematics) {
    for (std::size_t j = 0; j < description_.joints.size(); ++j) {
      const RelativePose<Space> stand = StandOf(kinematics, j);
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
  std::vector<RelativePose<Space>> first_;
  ShortRun run_;
};

}  // namespace

ShortRun MakeShortRun(const MechanismDescription& description, double duration, double cpu_s) {
  return description.space == SpaceKind::kPlanar
             ? Watching<Planar>(description).Run(duration, cpu_s)
             : Watching<Spatial>(description).Run(duration, cpu_s);
}

namespace {

constexpr double kTolerance = 1e-10;
constexpr int kTimes = 50;

template <class Space>
class Tracking {
 public:
  Tracking(const MechanismDescription& model, const Eigen::Matrix3d& R_WC,
           const MechanismDescription& whole)
      : model_(model), R_WC_(R_WC), mechanism_(model, Coordinates::kJoint) {
    for (std::size_t b = 1; b < whole.bodies.size(); ++b) {
      const std::string& body = whole.bodies[b].name;
      for (const auto& [point, at] : whole.bodies[b].points) {
        const FoundPoint found = FindPoint(model, body, point);
        if (found.body < 0) continue;
        points_.push_back(found);
        track_.names.push_back(body + "." + point);
      }
    }
  }

  Track Run(double horizon, double cpu_s) {
    auto [system, y, failure] = StartAtLevelPosition<Space>(model_, mechanism_, "lagrange");
    track_.failure = failure;
    if (system == nullptr) return track_;
    std::vector<double> wanted;
    for (int i = 1; i <= kTimes; ++i) wanted.push_back(horizon * i / kTimes);
    IntegratorOptions options;
    options.profile = "dormand-prince";
    options.rtol = options.atol = kTolerance;
    options.time_limit_s = cpu_s;
    options.stop_times = mechanism_.stop_times();
    options.stop_times.insert(options.stop_times.end(), wanted.begin(), wanted.end());
    std::ranges::sort(options.stop_times);
    std::size_t next = 0;
    const auto observe = [&, &system = system](double t, std::span<double> state) {
      const bool restart = system->BeginStep(t, state);
      // a stop is met to round-off
      const bool is_wanted = next < wanted.size() && t > wanted[next] - 1e-9 * horizon;
      if (is_wanted && system->FromState(t, state) == Outcome::kFinished) {
        Look(wanted[next++], system->kinematics());
      }
      return restart ? StepAction::kRestart : StepAction::kContinue;
    };
    const IntegratorResult result = Integrate(*system, 0.0, horizon, y, options, observe);
    track_.rhs_evaluations = result.rhs_evaluations;
    if (result.outcome != Outcome::kFinished) track_.failure = ToString(result.outcome);
    return track_;
  }

 private:
  void Look(double t, const Kinematics<Space, double>& kinematics) {
    track_.times.push_back(t);
    std::vector<Eigen::Vector3d>& places = track_.points.emplace_back();
    for (const FoundPoint& point : points_) {
      const Pose<Space, double>& X = kinematics.poses()[point.body];
      Eigen::Vector3d from_com = point.at;
      if (point.body != kGround) from_com -= model_.bodies[point.body].com;
      Eigen::Vector3d p = Eigen::Vector3d::Zero();
      Linear<Space, double> arm;
      for (int i = 0; i < Space::kLin; ++i) arm[i] = from_com[i];
      p.head<Space::kLin>() = (X.p + X.R * arm).eigen();
      places.push_back(R_WC_ * p);
    }
  }

  const MechanismDescription& model_;
  Eigen::Matrix3d R_WC_;
  Mechanism<Space, double> mechanism_;
  std::vector<FoundPoint> points_;
  Track track_;
};

}  // namespace

Track TrackOf(const MechanismDescription& model, const Eigen::Matrix3d& R_WC,
              const MechanismDescription& whole, double horizon, double cpu_s) {
  return model.space == SpaceKind::kPlanar
             ? Tracking<Planar>(model, R_WC, whole).Run(horizon, cpu_s)
             : Tracking<Spatial>(model, R_WC, whole).Run(horizon, cpu_s);
}

ModelError Compare(const Track& whole, const Track& model) {
  ModelError error;
  for (std::size_t i = 0; i < model.names.size(); ++i) {
    const auto same = std::ranges::find(whole.names, model.names[i]);
    if (same == whole.names.end()) continue;
    ++error.points;
    const auto k = static_cast<std::size_t>(same - whole.names.begin());
    for (std::size_t t = 0; t < std::min(whole.times.size(), model.times.size()); ++t) {
      const double distance = (whole.points[t][k] - model.points[t][i]).norm();
      if (distance <= error.distance && !error.point.empty()) continue;
      error.distance = distance;
      error.point = model.names[i];
    }
  }
  return error;
}

}  // namespace loopbench::harness
