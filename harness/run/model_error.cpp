#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "harness/run/run.h"

namespace loopbench::harness {

namespace {

/// Integrates a description without observers, at level projection, to `end`. `mechanism` is the
/// description in joint coordinates. Calls look(t, kinematics) at the start and after each accepted
/// step where `is_wanted`(t). Returns nothing if there is no start, with the reason in `failure`.
template <class Space, class IsWanted, class Look>
std::optional<IntegratorResult> RunBare(const MechanismDescription& description,
                                        const Mechanism<Space, double>& mechanism,
                                        const std::string& formulation, double end,
                                        const IntegratorOptions& options, std::string* failure,
                                        const IsWanted& is_wanted, const Look& look) {
  const Start<double> start = Assemble<Space>(description, mechanism);
  *failure = start.message;
  if (start.outcome != Outcome::kFinished) return std::nullopt;
  const auto system = MakeFormulation<Space>(
      {.formulation = formulation, .enforcement = Enforcement::kPosition}, mechanism);
  const Outcome outcome = system->Start(0.0, start.q, start.u);
  if (outcome != Outcome::kFinished) {
    *failure = ToString(outcome);
    return std::nullopt;
  }
  std::vector<double> y(static_cast<std::size_t>(system->size()));
  system->ToState(start.q, start.u, y);
  const auto observe = [&](double t, std::span<double> state) {
    const bool restart = system->BeginStep(t, state);
    if (is_wanted(t) && system->FromState(t, state) == Outcome::kFinished) {
      look(t, system->kinematics());
    }
    return restart ? StepAction::kRestart : StepAction::kContinue;
  };
  return Integrate(*system, 0.0, end, y, options, observe);
}

template <class Space>
ShortRun Watch(const MechanismDescription& description, double duration, double cpu_s) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  std::vector<Pose<Space, double>> first_poses;     // of the bodies of each joint, at the start
  std::vector<Linear<Space, double>> first_points;  // of its M, from P's centre of mass in P's axes
  ShortRun run;
  const auto look = [&](double t, const Kinematics<Space, double>& kinematics) {
    for (std::size_t j = 0; j < description.joints.size(); ++j) {
      const Joint<Space, double>& joint = mechanism.joints()[j];
      const Pose<Space, double> X_PQ =
          Compose(Inverse(kinematics.poses()[joint.from]), kinematics.poses()[joint.to]);
      const Linear<Space, double> point = Compose(X_PQ, joint.X_QM).p;
      if (first_poses.size() == j) {
        first_poses.push_back(X_PQ);
        first_points.push_back(point);
      }
      Travel& travel = run.travels[description.joints[j].name];
      const Pose<Space, double> turned = Compose(Inverse(first_poses[j]), X_PQ);
      travel.turn = std::max(travel.turn, RotationVector(turned).norm());
      travel.shift = std::max(travel.shift, (point - first_points[j]).norm());
    }
    for (const Velocity<Space, double>& V : kinematics.motions()) {
      run.rate = std::max({run.rate, V.angular.norm(), V.linear.norm() / mechanism.length()});
    }
    run.duration = t;
  };
  IntegratorOptions options;
  options.rtol = options.atol = 1e-6;
  options.time_limit_s = cpu_s;
  options.stop_times = mechanism.stop_times();
  const auto result = RunBare(
      description, mechanism, "odca", duration, options, &run.message, [](double) { return true; },
      look);
  if (result && result->outcome != Outcome::kFinished) {
    run.message = fmt::format(
        "it ended after {:.3g} s of {:.3g} s: {}", result->t_reached, duration,
        result->message.empty() ? ToString(result->outcome) : std::string_view(result->message));
  }
  return run;
}

template <class Space>
Track Follow(const MechanismDescription& model, const Eigen::Matrix3d& R_WC,
             const MechanismDescription& whole, double horizon, double cpu_s) {
  constexpr double kTolerance = 1e-10;
  constexpr int kTimes = 50;
  const Mechanism<Space, double> mechanism(model, Coordinates::kJoint);
  Track track;
  std::vector<FoundPoint> points;
  for (std::size_t b = 1; b < whole.bodies.size(); ++b) {
    const std::string& body = whole.bodies[b].name;
    for (const auto& [point, at] : whole.bodies[b].points) {
      const FoundPoint found = FindPoint(model, body, point);
      if (found.body < 0) continue;
      points.push_back(found);
      track.names.push_back(body + "." + point);
    }
  }
  std::vector<double> wanted;
  for (int i = 1; i <= kTimes; ++i) wanted.push_back(horizon * i / kTimes);
  std::size_t next = 0;
  // a stop is met to round-off
  const auto is_wanted = [&](double t) {
    return next < wanted.size() && t > wanted[next] - 1e-9 * horizon;
  };
  const auto look = [&](double, const Kinematics<Space, double>& kinematics) {
    track.times.push_back(wanted[next++]);
    std::vector<Eigen::Vector3d>& places = track.points.emplace_back();
    for (const FoundPoint& point : points) {
      const Pose<Space, double>& X = kinematics.poses()[point.body];
      Eigen::Vector3d from_com = point.at;
      if (point.body != kGround) from_com -= model.bodies[point.body].com;
      Eigen::Vector3d p = Eigen::Vector3d::Zero();
      Linear<Space, double> arm;
      for (int i = 0; i < Space::kLin; ++i) arm[i] = from_com[i];
      p.head<Space::kLin>() = (X.p + X.R * arm).eigen();
      places.push_back(R_WC * p);
    }
  };
  IntegratorOptions options;
  options.profile = "dormand-prince";
  options.rtol = options.atol = kTolerance;
  options.time_limit_s = cpu_s;
  options.stop_times = mechanism.stop_times();
  options.stop_times.insert(options.stop_times.end(), wanted.begin(), wanted.end());
  std::ranges::sort(options.stop_times);
  const auto result =
      RunBare(model, mechanism, "lagrange", horizon, options, &track.failure, is_wanted, look);
  if (!result) return track;
  track.rhs_evaluations = result->rhs_evaluations;
  if (result->outcome != Outcome::kFinished) track.failure = ToString(result->outcome);
  return track;
}

}  // namespace

ShortRun MakeShortRun(const MechanismDescription& description, double duration, double cpu_s) {
  return description.space == SpaceKind::kPlanar ? Watch<Planar>(description, duration, cpu_s)
                                                 : Watch<Spatial>(description, duration, cpu_s);
}

Track TrackOf(const MechanismDescription& model, const Eigen::Matrix3d& R_WC,
              const MechanismDescription& whole, double horizon, double cpu_s) {
  return model.space == SpaceKind::kPlanar ? Follow<Planar>(model, R_WC, whole, horizon, cpu_s)
                                           : Follow<Spatial>(model, R_WC, whole, horizon, cpu_s);
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
