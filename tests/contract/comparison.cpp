#include "tests/contract/comparison.h"

#include "odca/odca.h"
#include "tests/contract/system_with.h"

namespace loopbench::testing {

template <class Space>
Comparison CompareOdca(const Sample<Space>& sample, Coordinates coordinates, SolverKind solver) {
  const Mechanism<Space, double>& mechanism = sample.mechanism(coordinates);
  const State& at = sample.state(coordinates);
  SystemWith<odca::Odca, Space, double> odca(mechanism, {.solver = solver});
  odca->Start(0.0, at.q, at.u);
  Comparison result;
  VectorX<double> udot;
  result.outcome = odca->Evaluate(0.0, at.q, at.u, udot);
  if (result.outcome != Outcome::kFinished) return result;
  result.rank = odca->diagnostics().rank;
  result.error = RelativeError(udot, sample.udot(coordinates));
  const std::vector<Real6>& forces = sample.forces(coordinates);
  Real difference = 0, scale = 0;
  for (int j = 0; j < static_cast<int>(sample.description().joints.size()); ++j) {
    const Eigen::Matrix<Real, Space::kDim, 1> force = OwnComponents<Space>(forces[j]);
    const Eigen::Matrix<Real, Space::kDim, 1> error =
        odca.solver().JointForce(j).eigen().template cast<Real>() - force;
    difference = std::max<Real>(difference, error.template lpNorm<Eigen::Infinity>());
    scale = std::max<Real>(scale, force.template lpNorm<Eigen::Infinity>());
  }
  result.force_error = scale > 0 ? static_cast<double>(difference / scale) : 0.0;
  return result;
}

template <class Space>
void Family::Hold(const Sample<Space>& sample, bool as_published) {
  const Answer& answer = sample.answer();
  const bool good = answer.rcond > 1e-2;
  const double bound = sample.Bound();
  ++samples_;
  good_ += good;
  smallest_rcond_ = std::min(smallest_rcond_, answer.rcond);
  for (Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    for (SolverKind solver : {SolverKind::kRankRevealing, SolverKind::kAsPublished}) {
      if (solver == SolverKind::kAsPublished && !as_published) continue;
      SCOPED_TRACE(sample.mechanism(coordinates).name() + ", " +
                   std::string(ToString(coordinates)) + ", " + std::string(ToString(solver)) +
                   ", rcond " + std::to_string(answer.rcond));
      const Comparison result = CompareOdca(sample, coordinates, solver);
      ASSERT_EQ(result.outcome, Outcome::kFinished);
      EXPECT_EQ(result.rank, answer.rank);
      EXPECT_LE(result.error, bound);
      worst_ = std::max(worst_, result.error);
      if (good) {
        EXPECT_LE(result.error, share_ > 0.0 ? 1e-12 : bound);
        worst_good_ = std::max(worst_good_, result.error);
      }
      worst_of_bound_ = std::max(worst_of_bound_, result.error / bound);
      if (!answer.full_rank()) continue;
      EXPECT_LE(result.force_error, bound);
      worst_force_ = std::max(worst_force_, result.force_error);
    }
  }
}

void Family::Finish() {
  EXPECT_GE(good_, share_ * samples_) << "too few samples of " << name_ << " have rcond above 1e-2";
  char line[200];
  std::snprintf(line, sizeof line,
                "%3d samples, %3d with rcond > 1e-2 (smallest %.1e): worst error %.1e, where rcond "
                "> 1e-2 %.1e; %.3f of its bound; forces %.1e",
                samples_, good_, smallest_rcond_, worst_, worst_good_, worst_of_bound_,
                worst_force_);
  std::printf("%-28s %s\n", name_.c_str(), line);
  ::testing::Test::RecordProperty(name_, line);
}

template void Family::Hold(const Sample<Planar>&, bool);
template void Family::Hold(const Sample<Spatial>&, bool);

}  // namespace loopbench::testing
