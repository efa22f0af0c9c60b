// Whole simulations against motions known in closed form, and against published numbers: every
// formulation at the level of the paper, in both coordinate sets, as published and rank-revealing.
#include "mechanism/description/library.h"
#include "tests/reference/cases.h"
#include "tests/reference/published_numbers.h"

namespace loopbench::harness::reference::closed_forms_test {

constexpr double kGravity = 9.81;
constexpr double kTolerance = 1e-11;  // rtol = atol of every run here

/// Each accepted step adds an error below the tolerance, and all these motions are stable: one that
/// is carried along grows at most with time, and what is propagated is of one order more than what
/// the tolerance bounds.
double Bound(const Record& record) { return record.Number("steps") * kTolerance; }

void Expect(const Record& record, const char* key, double bound) {
  ASSERT_EQ(record.Text("outcome"), "finished") << record.Text("message");
  EXPECT_LE(record.Number(key), bound) << key;
}

double LastAngle(const Record& record, const std::string& joint) {
  const std::vector<double>& series = record.Numbers("series.angle." + joint);
  return series.empty() ? std::nan("") : series.back();
}

/// A01 with a bar: (I + m d^2) / (m d) = (0.25 + 0.25) / 0.5 = 1 m is the length of the equivalent
/// point mass. Body axes along the bar, so that the point at 1 m moves like the mass of A01.
MechanismFile BarOfA01() {
  MechanismFile file;
  MechanismDescription& bar = file.description;
  bar.name = "A01";
  bar.gravity = {0.0, -kGravity, 0.0};
  bar.bodies.push_back(Bar("bar", 1.0, 1.0, 0.25));
  bar.joints.push_back(Revolute("O", kGround, Eigen::Vector3d::Zero(), 1, Eigen::Vector3d::Zero()));
  bar.initial.coordinates.push_back({0, {-kPi}});
  file.observe.closed_form = PendulumForm{"bar", -kPi / 2, kGravity};
  return file;
}

/// A02: cranks up, the tip of the first moving at (1, 0) m/s. Angle from +x falls as phi grows.
///   [(N + 1) / 3 + N] phi'' = [(N + 1) / 2 + N] g sin(phi)
MechanismFile LadderOfA02(int windows) {
  MechanismFile file;
  file.description = Ladder(windows, kPi / 2, -1.0);
  const double n = windows;
  file.observe.closed_form =
      PendulumForm{"crank0", -kPi / 2, ((n + 1) / 2 + n) * kGravity / ((n + 1) / 3 + n)};
  return file;
}

std::vector<Method> AllMethods() {
  std::vector<Method> methods = PublishedMethods();
  for (Method method : PublishedMethods()) {
    method.solver = SolverKind::kRankRevealing;
    methods.push_back(method);
  }
  return methods;
}

class ClosedForm : public testing::TestWithParam<Method> {};

TEST_P(ClosedForm, PendulumIsThatOfA01) {
  const MechanismFile file = BarOfA01();
  for (std::size_t i = 0; i < kA01Published.size(); ++i) {
    const double t = kA01Published[i].t;
    const Record record = RunFile(file, GetParam(), kTolerance, t);
    const double bound = Bound(record);
    Expect(record, "closed_form_error_max", bound);
    const double x = std::cos(LastAngle(record, "O")), y = std::sin(LastAngle(record, "O"));
    EXPECT_NEAR(x, kA01Derived[i].x, bound) << t;
    EXPECT_NEAR(y, kA01Derived[i].y, bound) << t;
    // printed with six digits
    EXPECT_NEAR(x, kA01Published[i].x, 0.5e-6 + bound) << t;
    EXPECT_NEAR(y, kA01Published[i].y, 0.5e-6 + bound) << t;
  }
}

TEST_P(ClosedForm, ParallelogramIsAPendulumBeforeItsSingularPassage) {
  // from 0.5 to 0.12 rad before the position with all bars in one line (a quarter period: 0.67 s)
  const Record record = RunPaper("parallelogram", GetParam(), kTolerance, 0.57);
  Expect(record, "closed_form_error_max", Bound(record));
  Expect(record, "branch_error_max", Bound(record));
}

TEST_P(ClosedForm, ToggleIsAPendulumBeforeItsSingularPassage) {
  // as above; a quarter period is 0.81 s
  const Record record = RunPaper("toggle", GetParam(), kTolerance, 0.68);
  Expect(record, "closed_form_error_max", Bound(record));
  Expect(record, "branch_error_max", Bound(record));
}

TEST_P(ClosedForm, LaddersOfOneAndTwoWindowsArePendulums) {
  for (const int windows : {1, 2}) {
    // 0.01 s before the first singular position
    const Record record = RunFile(LadderOfA02(windows), GetParam(), kTolerance, 0.70);
    Expect(record, "closed_form_error_max", 1e-9);
  }
}

TEST_P(ClosedForm, LaddersPassThroughTheDerivedAngles) {
  for (const auto& [windows, phi] : kA02DerivedAtHalfSecond) {
    if (windows > 2) continue;
    const Record record = RunFile(LadderOfA02(windows), GetParam(), kTolerance, 0.5);
    EXPECT_NEAR(kPi / 2 - LastAngle(record, "O0"), phi, 1e-9) << windows;
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, ClosedForm, testing::ValuesIn(AllMethods()), NameOfParam());

class LongLadder : public testing::TestWithParam<Method> {};

TEST_P(LongLadder, OfFortyWindowsIsAPendulum) {
  Expect(RunFile(LadderOfA02(40), GetParam(), kTolerance, 0.70), "closed_form_error_max", 1e-9);
}

TEST_P(LongLadder, OfFortyWindowsFollowsThePublishedFile) {
  // ADAMS's file is within 1.5e-6 of the closed form, its printed digits included
  for (const auto& [t, x, y] : kA02PublishedN40) {
    const Record record = RunFile(LadderOfA02(40), GetParam(), kTolerance, t);
    const double angle = LastAngle(record, "O0");
    EXPECT_NEAR(std::cos(angle), x, 1.5e-6) << t;
    EXPECT_NEAR(std::sin(angle), y, 1.5e-6) << t;
  }
  const Record record = RunFile(LadderOfA02(40), GetParam(), kTolerance, 0.5);
  EXPECT_NEAR(kPi / 2 - LastAngle(record, "O0"), kA02DerivedAtHalfSecond[2].phi, 1e-9);
}

// the dense matrices of the other two, three times as large, take seconds
INSTANTIATE_TEST_SUITE_P(Methods, LongLadder,
                         testing::Values(Published("odca", Coordinates::kJoint),
                                         Published("odca", Coordinates::kAbsolute),
                                         Published("lagrange", Coordinates::kJoint),
                                         Published("reduction", Coordinates::kJoint)),
                         NameOfParam());

}  // namespace loopbench::harness::reference::closed_forms_test
