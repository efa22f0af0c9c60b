// Mechanisms through singular configurations, and past them at some 1e-4: where regularization
// begins to bend the motion. Ends by other means: parametrisations without singular configurations,
// a differential equation of one angle, quadrature of dt = dq / qdot in 28 digits, an integration
// in absolute coordinates at 1e-12.
#include "harness/judge/analysis.h"
#include "tests/reference/cases.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::near_singular_test {

/// Angles [rad] or origins [m] of bodies at the end, and their accuracy.
struct KnownEnd {
  std::string name;
  double horizon = 0.0;
  std::map<std::string, double> angles = {};
  std::map<std::string, Eigen::Vector3d> origins = {};
  double accuracy = 0.0;
};

const std::vector<KnownEnd>& KnownEnds() {
  static const std::vector<KnownEnd> kEnds = {
      // seven folds in 10 s
      {.name = "peaucellier-through-folds",
       .horizon = 10.0,
       .angles = {{"crank", 0.6093872231295502},
                  {"OB", 0.09646809838032241},
                  {"OC", 0.5129191247492277},
                  {"DB", 3.989407010380716}},
       .accuracy = 1e-9},
      {.name = "parallelogram-from-flat",
       .horizon = 20.0,
       .angles = {{"c1", -3.182421091557117}, {"k", 0.0}, {"c3", -3.182421091557117}},
       .accuracy = 1e-11},
      // 3.6e-4 from a singular configuration
      {.name = "rccc",
       .horizon = 3.0,
       .origins = {{"b0", {-0.1762856838, -0.1519606701, -0.4254865645}},
                   {"b1", {0.08132756874, -0.8517112722, -1.36913207}},
                   {"b2", {1.492984121, -0.385083951, -1.065202219}}},
       .accuracy = 1.4e-10},
      // the ground is 3e-7 longer than a parallelogram's
      {.name = "four-bar-nearly-flat",
       .horizon = 10.0,
       .angles = {{"crank", -4.335613186e-08}, {"coupler", -1.427269471}, {"rocker", -1.427269774}},
       .accuracy = 1.9e-8},
      // the crank is 1e-7 shorter than a parallelogram's: 14 passings at 3e-4
      {.name = "four-bar-passing",
       .horizon = 5.0,
       .angles = {{"crank", -2.7218226134615184},
                  {"coupler", 0.21228087751743555},
                  {"rocker", 2.9341028834446843}},
       .accuracy = 1e-11}};
  return kEnds;
}

MechanismFile FileOf(const KnownEnd& known) {
  return ReadMechanism(kRoot / "tests/reference/near_singular" / (known.name + ".json"));
}

/// The largest difference from the known end; all links are about a metre long.
double ErrorOf(const KnownEnd& known, const Method& method, double tolerance) {
  const MechanismDescription d = FileOf(known).description;
  const Simulation run = Simulate(d, method, Options("ode45", tolerance), known.horizon);
  if (run.result.outcome != Outcome::kFinished) return std::numeric_limits<double>::infinity();
  double worst = 0.0;
  for (const auto& [body, angle] : known.angles) {
    const double miss = AngleOf(run.last.bodies[BodyNamed(d, body)]) - angle;
    worst = std::max(worst, std::abs(std::remainder(miss, 2 * kPi)));
  }
  for (const auto& [body, origin] : known.origins) {
    const Eigen::Vector3d p = PointOf(d, run.last, BodyNamed(d, body), Eigen::Vector3d::Zero());
    worst = std::max(worst, (p - origin).norm());
  }
  return worst;
}

class NearSingular : public ::testing::TestWithParam<Method> {};

/// Wrong is a difference beyond those between runs of one tolerance (kMaxTolerances).
/// Regularization without the forces of its directions leaves 3e-4 rad of the Peaucellier linkage
/// 1.7 rad of the nearly flat four-bar and
/// 3 rad of the passing one.
TEST_P(NearSingular, EndsRightAtLevelProjection) {
  constexpr double kTolerance = 1e-8;
  for (const KnownEnd& known : KnownEnds()) {
    const double error = ErrorOf(known, GetParam(), kTolerance);
    EXPECT_LE(error, kMaxTolerances * kTolerance + known.accuracy) << known.name;
  }
}

/// Alone: no other run of the experiment can disagree. At level velocity only: at level projection
/// ends are right, with or without a warning (EndsRightAtLevelProjection).
TEST_P(NearSingular, WrongOnesAreFlaggedAlone) {
  constexpr double kTolerance = 1e-8;
  Method method = GetParam();
  method.enforcement = Enforcement::kVelocity;
  for (const KnownEnd& known : KnownEnds()) {
    Experiment experiment = Single(FileOf(known));
    experiment.refine = true;
    const std::string name = experiment.problems.front().name;
    const Record record =
        RunCase(experiment, CaseOf(experiment, name, method, kTolerance, known.horizon));
    if (record.Text("outcome") != "finished" || !record.Text("warnings").empty()) continue;
    EXPECT_LE(ErrorOf(known, method, kTolerance), kMaxTolerances * kTolerance + known.accuracy)
        << known.name << " " << ToString(method);
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, NearSingular, testing::ValuesIn(PositionMethods()),
                         NameOfParam());

}  // namespace loopbench::harness::reference::near_singular_test
