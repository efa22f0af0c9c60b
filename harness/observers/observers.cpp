// Registration, construction and calls of observers, and their shared functions.
#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/observers/observer.h"
#include "harness/observers/registry.h"
#include "mechanism/description/registration.h"

namespace loopbench::harness {

template <class Space>
void EnergyObserver<Space>::Observe(const Sample<Space>& sample) {
  if (!sample.knows_work) return;  // and no balance
  supplied_ = sample.supplied;
  dissipated_ = sample.dissipated;
  const Kinematics<Space, double>& kinematics = sample.formulation.kinematics();
  const auto parts = ComputeEnergy(kinematics);
  const double energy = parts.total() - supplied_ + dissipated_;
  kinetic_ = std::max(kinetic_, parts.kinetic);
  work_ = std::max({work_, std::abs(supplied_), std::abs(dissipated_)});
  if (!started_) {
    first_ = energy;
    potential_low_ = potential_high_ = parts.potential;
  }
  potential_low_ = std::min(potential_low_, parts.potential);
  potential_high_ = std::max(potential_high_, parts.potential);
  const Mechanism<Space, double>& mechanism = kinematics.mechanism();
  wrenches_.resize(static_cast<std::size_t>(mechanism.num_bodies()));
  AppliedForces<Space, double>(kinematics, wrenches_);
  double forces = 0.0, momenta = 0.0;
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    const auto& inertia = mechanism.bodies()[body];
    const auto& V = kinematics.motions()[body];
    forces += wrenches_[static_cast<std::size_t>(body)].norm();
    momenta += inertia.mass * V.linear.norm() +
               (kinematics.RotationalInertia(inertia, body) * V.angular).norm();
  }
  sensitivity_ = std::max({sensitivity_, forces, momenta});
  started_ = true;
  // written so that an energy that overflowed stays
  const double error = std::abs(energy - first_);
  if (!std::isnan(largest_) && !(error <= largest_)) largest_ = error;
  series_.t.push_back(sample.t);
  series_.value.push_back(energy - first_);
}

template <class Space>
void EnergyObserver<Space>::Write(Record& record) const {
  if (!started_) return;
  record.Set("energy_error_max", largest_);
  if (kinetic_ > 0.0) record.Set("energy_error_relative", largest_ / kinetic_);
  // an error of a hundredth of the scale is then a thousand round-offs of the potential
  constexpr double kLeast = 1e5 * std::numeric_limits<double>::epsilon();
  record.Set("energy_scale",
             std::max({kinetic_, work_, potential_high_ - potential_low_,
                       kLeast * std::max(std::abs(potential_low_), std::abs(potential_high_))}));
  record.Set("energy_sensitivity", sensitivity_);
  if (has_power_) {
    record.Set("energy_supplied", supplied_);
    record.Set("energy_dissipated", dissipated_);
  }
  const TimeSeries thin = Thin(series_, points_);
  record.Set("series.energy_t", thin.t);
  record.Set("series.energy_error", thin.value);
}

template <class Space>
void CorrectionObserver<Space>::Observe(const Sample<Space>& sample) {
  if (TraitsOf(sample.formulation.options().enforcement).growth != DriftGrowth::kNone) return;
  const Correction<double>& correction = sample.formulation.level().correction();
  largest_ = std::max(largest_, correction.shift);
  iterations_ += correction.iterations;
  series_.t.push_back(sample.t);
  series_.value.push_back(correction.shift);
}

template <class Space>
void CorrectionObserver<Space>::Write(Record& record) const {
  if (series_.t.empty()) return;
  record.Set("correction_max", largest_);
  record.Set("projection_iterations", iterations_);
}

template <class Space>
void ConditionObserver<Space>::Observe(const Sample<Space>& sample) {
  const Diagnostics diagnostics = sample.formulation.diagnostics();
  rank_min_ = started_ ? std::min(rank_min_, diagnostics.rank) : diagnostics.rank;
  const Mechanism<Space, double>& mechanism = sample.formulation.kinematics().mechanism();
  beyond_joint_speeds_ = mechanism.num_u() - mechanism.num_joint_speeds();
  if (!started_ || diagnostics.rcond < rcond_min_) {
    rcond_min_ = diagnostics.rcond;
    rcond_t_ = sample.t;
  }
  if (diagnostics.smallest_weight < 1.0) ++regularized_steps_;
  regularized_evaluations_ = diagnostics.regularized_evaluations;
  mode_changes_ = diagnostics.mode_changes;
  started_ = true;
}

template <class Space>
void ConditionObserver<Space>::Write(Record& record) const {
  if (!started_) return;
  record.Set("rank_min", std::int64_t{rank_min_});
  record.Set("rank_constraints_min", std::int64_t{rank_min_ + beyond_joint_speeds_});
  record.Set("rcond_min", rcond_min_);
  record.Set("rcond_min_t", rcond_t_);
  record.Set("regularized_steps", regularized_steps_);
  record.Set("regularized_evaluations", regularized_evaluations_);
  record.Set("mode_changes", mode_changes_);
}

template <class Space>
std::vector<std::unique_ptr<Observer<Space>>> MakeObservers(const Watched<Space>& run) {
  std::vector<std::unique_ptr<Observer<Space>>> all;
  all.push_back(std::make_unique<DriftObserver<Space>>(run.description, run.mechanism));
  all.push_back(std::make_unique<EnergyObserver<Space>>(run.points, run.mechanism.has_power()));
  all.push_back(std::make_unique<ConditionObserver<Space>>());
  all.push_back(std::make_unique<SingularityObserver<Space>>(run.description, run.mechanism));
  all.push_back(std::make_unique<ExactObserver<Space>>(run.problem, run.mechanism));
  all.push_back(std::make_unique<CoordinateObserver<Space>>(run.points));
  all.push_back(std::make_unique<CorrectionObserver<Space>>());
  all.push_back(std::make_unique<StepLengthObserver<Space>>(run));
  for (const ObserverRow& row : RegisteredObservers()) all.push_back(row.Make(run));
  return all;
}

template <class Space>
std::vector<std::unique_ptr<Observer<Space>>> MakeMemberObservers(const Watched<Space>& run) {
  std::vector<std::unique_ptr<Observer<Space>>> all;
  all.push_back(std::make_unique<DriftObserver<Space>>());
  all.push_back(std::make_unique<EnergyObserver<Space>>(run.points, run.mechanism.has_power()));
  all.push_back(std::make_unique<ExactObserver<Space>>(run.problem, run.mechanism));
  return all;
}

template std::vector<std::unique_ptr<Observer<Planar>>> MakeObservers(const Watched<Planar>&);
template std::vector<std::unique_ptr<Observer<Spatial>>> MakeObservers(const Watched<Spatial>&);
template std::vector<std::unique_ptr<Observer<Planar>>> MakeMemberObservers(const Watched<Planar>&);
template std::vector<std::unique_ptr<Observer<Spatial>>> MakeMemberObservers(
    const Watched<Spatial>&);

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

namespace {

// Returns the kept indices of `n` samples: evenly spaced, always with the last one.
std::vector<std::size_t> Kept(std::size_t n, int points) {
  const std::size_t count = std::min(n, static_cast<std::size_t>(points));
  std::vector<std::size_t> kept(count);
  for (std::size_t i = 0; i < count; ++i) kept[i] = count == n ? i : i * (n - 1) / (count - 1);
  return kept;
}

}  // namespace

TimeSeries Thin(const TimeSeries& series, int points, std::size_t samples) {
  TimeSeries thin;
  for (const std::size_t k : Kept(std::min(samples, series.t.size()), points)) {
    thin.t.push_back(series.t[k]);
    thin.value.push_back(series.value[k]);
  }
  return thin;
}

double LargestGap(const TimeSeries& series, int points, std::size_t samples) {
  const std::vector<std::size_t> kept = Kept(samples, points);
  double gap = 0.0;
  for (std::size_t i = 1; i < kept.size(); ++i) {
    const std::size_t a = kept[i - 1], b = kept[i];
    const double slope = (series.value[b] - series.value[a]) / (series.t[b] - series.t[a]);
    for (std::size_t k = a + 1; k < b; ++k) {
      const double line = series.value[a] + slope * (series.t[k] - series.t[a]);
      gap = std::max(gap, std::abs(series.value[k] - line));
    }
  }
  return gap;
}

}  // namespace loopbench::harness
