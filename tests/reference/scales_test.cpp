// Size and mass decide nothing: the same mechanism in other units moves alike and has the same
// rank.
#include "mechanism/description/transforms.h"
#include "mechanism/start/assembly.h"
#include "tests/reference/cases.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::scales_test {

struct FirstEvaluation {
  Outcome outcome = Outcome::kFinished;
  int rank = 0;
  VectorX<double> udot;
  std::string units;  ///< of the speeds in joint coordinates: 'a' angle, 'l' length per time
};

/// Returns a letter for the unit of each speed of a joint, in their order.
std::string UnitsOf(JointType type, SpaceKind space) {
  std::string units;
  for (const ValueWord& word : ValueWords(type, space, true)) units += word.is_length() ? 'l' : 'a';
  return units;
}

template <class Space>
std::string UnitsOf(const MechanismDescription& problem,
                    const Mechanism<Space, double>& mechanism) {
  std::string units(static_cast<std::size_t>(mechanism.num_u()), '?');
  for (int j = 0; j < static_cast<int>(mechanism.joints().size()); ++j) {
    const Joint<Space, double>& joint = mechanism.joints()[j];
    if (!joint.in_tree()) continue;
    const JointType type =
        joint.description < 0 ? JointType::kFree : problem.joints[joint.description].type;
    std::string own = UnitsOf(type, problem.space);
    for (const Drive& drive : mechanism.drives()) {
      if (drive.joint == j) own[drive.coordinate] = ' ';
    }
    std::erase(own, ' ');
    units.replace(joint.u_offset, own.size(), own);
  }
  return units;
}

template <class Space>
FirstEvaluation EvaluateIn(const MechanismDescription& problem, const Method& method) {
  const Mechanism<Space, double> mechanism(problem, method.coordinates);
  const Start<double> start = Assemble<Space>(problem, mechanism);
  FirstEvaluation first;
  first.outcome = start.outcome;
  if (start.outcome != Outcome::kFinished) return first;
  if (method.coordinates == Coordinates::kJoint) first.units = UnitsOf(problem, mechanism);
  const auto formulation = MakeFormulation<Space>(method, mechanism);
  first.outcome = formulation->Start(0.0, start.q, start.u);
  if (first.outcome != Outcome::kFinished) return first;
  // speeds of velocity level are the formulation's own: those of the start serve all
  first.outcome = formulation->Evaluate(0.0, start.q, start.u, first.udot);
  first.rank = formulation->diagnostics().rank;
  return first;
}

FirstEvaluation EvaluateAt(const MechanismDescription& problem, const Method& method) {
  return problem.space == SpaceKind::kPlanar ? EvaluateIn<Planar>(problem, method)
                                             : EvaluateIn<Spatial>(problem, method);
}

/// Without those that start in singular positions, where the condition has no bound.
std::vector<std::string> RegularNames() {
  std::vector<std::string> names = ShippedNames();
  std::erase_if(names, [](const std::string& name) { return name.ends_with("singular-start"); });
  return names;
}

class Scales : public testing::TestWithParam<std::string> {};
class RegularScales : public Scales {};

TEST_P(Scales, RankIsThatOfTheOriginal) {
  const MechanismDescription problem = Shipped(GetParam()).description;
  for (const Method& method : PositionMethods()) {
    const FirstEvaluation original = EvaluateAt(problem, method);
    ASSERT_EQ(original.outcome, Outcome::kFinished) << ToString(method);
    for (const double factor : {1e-6, 1e6}) {
      const FirstEvaluation scaled = EvaluateAt(AtScale(problem, factor), method);
      ASSERT_EQ(scaled.outcome, Outcome::kFinished) << ToString(method) << " at " << factor;
      EXPECT_EQ(scaled.rank, original.rank) << ToString(method) << " at " << factor;
    }
  }
}

/// Speeds of joints are angles or lengths per time, whatever the formulation. A power of two
/// rounds nothing, so that what is left comes from the order of sums alone: elimination of some 50
/// unknowns in loops whose condition is 1e4 at worst away from singular positions.
TEST_P(RegularScales, AnglesMoveAsBefore) {
  const MechanismDescription problem = Shipped(GetParam()).description;
  constexpr double kFactor = 1024;
  for (const Method& method : PositionMethods()) {
    if (method.coordinates != Coordinates::kJoint) continue;
    const FirstEvaluation original = EvaluateAt(problem, method);
    const FirstEvaluation scaled = EvaluateAt(AtScale(problem, kFactor), method);
    ASSERT_EQ(scaled.udot.size(), original.udot.size());
    const double bound = 1e-9 * (1.0 + original.udot.cwiseAbs().maxCoeff());
    for (Eigen::Index i = 0; i < scaled.udot.size(); ++i) {
      const char unit = original.units.at(static_cast<std::size_t>(i));
      ASSERT_NE(unit, '?') << ToString(method) << " speed " << i;
      const double factor = unit == 'l' ? kFactor : 1.0;
      EXPECT_NEAR(scaled.udot[i] / factor, original.udot[i], bound)
          << ToString(method) << " speed " << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Scales, testing::ValuesIn(ShippedNames()), NameOfParam());
INSTANTIATE_TEST_SUITE_P(All, RegularScales, testing::ValuesIn(RegularNames()), NameOfParam());

/// D5: stiffness is physical, rank is not.
TEST(Masses, RankOfTheFourBarIgnoresThem) {
  const MechanismDescription problem = Shipped("four-bar").description;
  for (const Method& method : PositionMethods()) {
    const FirstEvaluation original = EvaluateAt(problem, method);
    for (std::size_t body = 1; body < problem.bodies.size(); ++body) {
      MechanismDescription heavy = problem;
      heavy.bodies[body].mass *= 1e9;
      heavy.bodies[body].inertia *= 1e9;
      const FirstEvaluation changed = EvaluateAt(heavy, method);
      ASSERT_EQ(changed.outcome, Outcome::kFinished) << ToString(method);
      EXPECT_EQ(changed.rank, original.rank) << ToString(method) << " body " << body;
    }
  }
}

/// A planar loop of revolute joints described in space has three rows that say nothing new, in
/// every plane and in every one of several loops.
TEST(InSpace, PlanarLoopsReportThreeRedundantRowsEach) {
  const std::vector<std::pair<std::string, int>> loops = {
      {"parallelogram", 1}, {"seven-bar", 2}, {"n-four-bar", 2}, {"andrews-squeezer", 3}};
  for (const auto& [name, count] : loops) {
    const MechanismDescription problem =
        InSpace(Shipped(name).description, Eigen::Vector3d(0.3, -0.5, 0.7));
    for (const Method& method : PositionMethods()) {
      const FirstEvaluation first = EvaluateAt(problem, method);
      ASSERT_EQ(first.outcome, Outcome::kFinished) << name << " " << ToString(method);
      EXPECT_EQ(first.rank, count * (5 - 3)) << name << " " << ToString(method);
    }
  }
}

}  // namespace loopbench::harness::reference::scales_test
