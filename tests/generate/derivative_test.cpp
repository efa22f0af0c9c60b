// Recorded right-hand sides: their numbers are those of the library's text, whatever the state, and
// compiled code has the bits of the graph.
#include "harness/base/text.h"
#include "harness/config/formulations.h"
#include "harness/config/mechanism_reader.h"
#include "harness/generate/generated.h"
#include "harness/generate/record.h"
#include "harness/run/run.h"
#include "harness/run/timing.h"
#include "mechanism/algebra/lanes.h"
#include "mechanism/description/library.h"
#include "mechanism/formulation/forward_jacobian.h"
#include "tests/contract/generators.h"
#include "tests/standard.h"

namespace loopbench::generate {
namespace {

const std::filesystem::path kMechanisms =
    std::filesystem::path(LOOPBENCH_SOURCE_DIR) / "configs/mechanisms";
constexpr BaumgarteGains kGains = {.alpha = 5.0, .beta = 5.0};
constexpr Enforcement kLevels[] = {Enforcement::kAcceleration, Enforcement::kVelocity,
                                   Enforcement::kBaumgarte};
const std::string kFormulations[] = {"odca", "lagrange", "reduction"};

/// The description of a shipped mechanism as it is run.
MechanismDescription Shipped(const std::string& name) {
  const harness::MechanismFile file = harness::ReadMechanism(kMechanisms / (name + ".json"));
  return harness::SimplifyProblem(file.description, file.observe, {})
      .compiled.parts.front()
      .description;
}

/// The graph's own arithmetic; `ok` becomes false where a comparison comes out otherwise.
std::vector<double> Evaluate(const RecordedFunction& recorded, const std::vector<double>& x,
                             bool* ok) {
  const std::vector<double> values = recorded.graph.Values(x);
  *ok = *ok && recorded.graph.Holds(values);
  std::vector<double> result;
  for (const int node : recorded.outputs) result.push_back(values[node]);
  return result;
}

/// A mechanism of equal topology with other masses, inertias, gravity and one other length. The
/// factors have many digits, so that no two numbers are equal by chance.
MechanismDescription Varied(MechanismDescription description, int k) {
  description.gravity *= 1.0 + 0.0112353 * k;
  for (std::size_t i = 1; i < description.bodies.size(); ++i) {
    description.bodies[i].mass *= 1.0 + 0.0313717 * k * static_cast<double>(i);
    description.bodies[i].inertia *= 1.0 + 0.0523771 * k * static_cast<double>(i);
  }
  description.joints[1].from.position *= 1.0 + 0.00712347 * k;
  return description;
}

/// Records with numbers as constants of the text, or as its inputs.
RecordedFunction RecordWith(RecordingSubject subject, const RecordingStart& start, bool keeps) {
  subject.keeps_numbers = keeps;
  return RecordFunction(subject, start);
}

/// The literal text of a function as a library.
CompiledBranch CompileOwn(const RecordedFunction& recorded) {
  int room = 0;
  const std::string function = PrintFunction(recorded, "own", &room);
  return CompileBranch("own " + function, [&] {
    return fmt::format(
        "#include <math.h>\nstatic void (*sines)(double, double*, double*);\n"
        "void loopbench_use_sines(void (*s)(double, double*, double*)) {{ sines = s; }}\n{}{}"
        "const int loopbench_room = {};\nint loopbench_function(const double* x, const double* c, "
        "double* y, double* w) {{ return (void)c, own(x, y, w); }}\n",
        kPrintedHelpers, function, room);
  });
}

CompiledBranch CompileShared(const RecordedFunction& recorded) {
  return CompileBranch(recorded.structure, [&] { return PrintLibrary(recorded); });
}

/// Equal bits, except for the sign of zeros.
void ExpectSameBits(const std::vector<double>& found, const std::vector<double>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i], expected[i]) << i;
}

template <class Space>
class Library {
 public:
  Library(const MechanismDescription& description, const std::string& formulation,
          Enforcement level, Coordinates set = Coordinates::kJoint)
      : description_(description), mechanism_(description_, set) {
    const harness::BenchmarkState state = harness::ComputeState(description, set);
    EXPECT_EQ(state.outcome, Outcome::kFinished) << state.message;
    system_ = harness::MakeFormulation<Space>(
        formulation, mechanism_, {.enforcement = level, .gains = kGains, .general = true});
    EXPECT_EQ(system_->Start(0.0, state.q, state.u), Outcome::kFinished);
    subject_.emplace(RecordingSubject{description_, set, formulation, system_->options()});
    start_ = {0.0, state.q, state.u};
    y_.resize(static_cast<std::size_t>(system_->size()));
    system_->ToState(state.q, state.u, y_);
  }

  std::vector<double> Examine(double t, const std::vector<double>& y) {
    std::vector<double> ydot(y.size());
    EXPECT_EQ(system_->Examine(t, y, ydot), Outcome::kFinished);
    return ydot;
  }
  /// A state near the start that is off the constraints, as a trial step is.
  std::vector<double> Near(double size, unsigned seed = 1) const {
    std::mt19937 numbers(seed);
    std::uniform_real_distribution<double> shift(-size, size);
    std::vector<double> y = y_;
    for (double& number : y) number += shift(numbers);
    return y;
  }

  System<Space, double>& system() { return *system_; }
  const RecordingSubject& subject() const { return *subject_; }
  const RecordingStart& start() const { return start_; }
  const std::vector<double>& y() const { return y_; }

 private:
  MechanismDescription description_;
  Mechanism<Space, double> mechanism_;
  std::unique_ptr<System<Space, double>> system_;
  std::optional<RecordingSubject> subject_;
  RecordingStart start_;
  std::vector<double> y_;
};

/// A bar of 2 m on a pin, its centre of mass at r = (c, s) for the angle x, with speed w. By hand:
///
///   c, s                  2 sines
///   w r                   2 *
///   a = w (w r)           2 *
///   m r, M = r . m r + I  4 *, 2 +
///   f = m a - m g         2 *, 1 +      g has one component, and m g is a constant
///   h = r x f             2 *, 1 +
///   M = L L^T, -h/L/L     1 sqrt, 2 /
///
/// The longest path: s, w s, w (w s), m a, + m g, c f, h, / L, / L.
TEST(CountsTest, APendulumHasTheOperationsThatAHandCounts) {
  MechanismDescription pendulum;
  pendulum.gravity = {0.0, -9.81, 0.0};
  pendulum.bodies.push_back(Bar("bar", 2.0, 3.0, 0.7));
  const Eigen::Vector3d pin = Eigen::Vector3d::Zero();
  pendulum.joints.push_back(Revolute("O", kGround, pin, 1, pin));
  const RecordingStart start = {.q = Eigen::VectorXd::Constant(1, 0.3),
                                .u = Eigen::VectorXd::Constant(1, 0.2)};
  for (const std::string formulation : {"lagrange", "reduction"}) {
    const MethodCounts counts =
        CountsOf(RecordFunction({.description = pendulum, .formulation = formulation}, start));
    const OperationCounts by_hand = {
        .additions = 4, .multiplications = 12, .divisions = 2, .roots = 1, .sines = 2};
    EXPECT_EQ(counts.result, by_hand) << formulation;
    EXPECT_EQ(counts.result.flops(), 4 + 12 + 4 * 3 + 8 * 2);
    EXPECT_EQ(counts.depth, 9);
    EXPECT_GT(counts.as_run.flops(), 4 * counts.result.flops());
  }
}

/// One join of the paper: two bars P and Q that float in the plane, and the pin between them. With
/// r from a centre of mass to the pin, c is +-[-r_y, 1, 0] and +-[r_x, 0, 1]. By hand, by
/// equations:
///
///   angle and speed of Q                          2 +
///   c, s                                          4 sines
///   r of both, along the bars                     4 *
///   n = w x (w x r) of both                       8 *
///   (12)   c0 = n_Q - n_P                         2 +
///   (1-4)  r_y / I, r_x / I of both               4 *          1 / I and 1 / m are constants
///   (16)   r_y (r_y / I) + 1 / m, r_x (r_y / I),
///          r_x (r_x / I) + 1 / m of both          6 *, 4 +
///          X, the sum of both                     3 +
///   (17)   X = L L^T                              2 sqrt, 2 /, 2 *, 1 +
///   (21)   s = L^-1 c0                            3 *, 1 +
///   (17)   phi = -L^-T s                          3 *, 1 +
///   (18)   moments c phi on both                  4 *, 2 +
///   (1-4)  acceleration of P, angular one of Q    4 *
///   (7)    udot of the pin                        1 +
///
/// The longest path: angle, sine, r (3); r_y / I, its product, X (3, 7); the first pivot, its root
/// and quotient, L_21, its square, the second pivot, root, quotient (14); s_2, phi_2, phi_1 (19);
/// the moment (21), / I, udot.
TEST(CountsTest, OneJoinHasTheOperationsThatAHandCounts) {
  MechanismDescription bars;
  bars.gravity.setZero();
  bars.bodies.push_back(Bar("P", 1.4, 3.0, 0.7));
  bars.bodies.push_back(Bar("Q", 1.2, 1.7, 0.4));
  JointDescription free;  // at the centre of mass of P
  free.name = "free";
  free.type = JointType::kFree;
  free.to = {1, {0.7, 0.0, 0.0}, Eigen::Vector3d::Zero()};
  bars.joints = {free, Revolute("pin", 1, {1.4, 0.0, 0.0}, 2, {0.0, 0.0, 0.0})};
  const RecordingStart start = {.q = Eigen::Vector4d(0.3, 0.2, 0.1, 0.7),
                                .u = Eigen::Vector4d(0.5, 0.2, 0.3, 1.1)};
  FormulationOptions options;
  options.solver = SolverKind::kAsPublished;
  const MethodCounts counts =
      CountsOf(RecordFunction({.description = bars, .options = options}, start));
  const OperationCounts by_hand = {
      .additions = 17, .multiplications = 38, .divisions = 2, .roots = 2, .sines = 4};
  EXPECT_EQ(counts.result, by_hand);
  EXPECT_EQ(counts.depth, 23);
}

/// Calls see(library, name) for all shipped mechanisms, formulations and recorded levels.
void ForAllShipped(Coordinates set, auto see) {
  for (const auto& entry : std::filesystem::directory_iterator(kMechanisms)) {
    const std::string name = entry.path().stem();
    const MechanismDescription description = Shipped(name);
    for (const std::string& formulation : kFormulations) {
      for (const Enforcement level : kLevels) {
        const std::string what = name + " " + formulation + " " + std::string(ToString(level));
        if (description.space == SpaceKind::kPlanar) {
          see(Library<Planar>(description, formulation, level, set), what);
        } else {
          see(Library<Spatial>(description, formulation, level, set), what);
        }
      }
    }
  }
}

/// Elsewhere, where every comparison has its outcome, a graph gives the bits of the text itself,
/// both in double and in the recording scalar.
struct BitsOfTheText {
  int compared = 0, branched = 0, refused = 0;

  void operator()(auto&& library, const std::string& what) {
    SCOPED_TRACE(what);
    const std::vector<double> y = library.Near(1e-6);
    std::vector<double> x = {0.01};
    x.insert(x.end(), y.begin(), y.end());
    try {
      const RecordedFunction recorded = RecordFunction(library.subject(), library.start());
      bool ok = true;
      const std::vector<double> found = Evaluate(recorded, x, &ok);
      ++(ok ? compared : branched);
      if (!ok) return;
      const RecordedFunction keeping = RecordWith(library.subject(), library.start(), true);
      ExpectSameBits(Evaluate(keeping, x, &ok), found);
      EXPECT_TRUE(ok);
      ExpectSameBits(found, RecordFunction(library.subject(), library.start(), 0.01, y).numbers);
      ExpectSameBits(found, library.Examine(0.01, y));
    } catch (const NotCovered& why) {
      const std::string reason = why.what();
      EXPECT_TRUE(reason.find("factorisation that iterates") != std::string::npos ||
                  reason.find("counted from the last step") != std::string::npos)
          << reason;
      ++refused;
    }
  }
};

void ExpectBitsOfTheText(Coordinates set) {
  BitsOfTheText bits;
  ForAllShipped(set, [&](auto library, const std::string& what) { bits(library, what); });
  // pivots of equal size, in absolute coordinates above all, change with every state
  EXPECT_GT(bits.compared, 2 * bits.branched);
  EXPECT_LT(bits.refused, 12);
}

/// Chains, trees, and loops that share bodies: two of each in the plane and two of each in space.
TEST(RecordedFunctionTest, RandomMechanismsHaveTheBitsOfTheText) {
  BitsOfTheText bits;
  for (int k = 0; k < 12; ++k) {
    const bool is_planar = k % 2 == 0;
    const SpaceKind space = is_planar ? SpaceKind::kPlanar : SpaceKind::kSpatial;
    const auto seed = static_cast<std::uint64_t>(k);
    const MechanismDescription description =
        k % 3 == 0   ? loopbench::testing::RandomChain(is_planar ? 3 + k / 3 : 7, space, seed)
        : k % 3 == 1 ? loopbench::testing::RandomTree(2 + k / 3, space, seed)
                     : loopbench::testing::RandomGraph(1 + k % 2, space, seed);
    for (const std::string& formulation : kFormulations) {
      for (const Coordinates set : {Coordinates::kJoint, Coordinates::kAbsolute}) {
        const std::string what = fmt::format("{} {} {}", k, formulation, ToString(set));
        if (is_planar) {
          bits(Library<Planar>(description, formulation, Enforcement::kVelocity, set), what);
        } else {
          bits(Library<Spatial>(description, formulation, Enforcement::kVelocity, set), what);
        }
      }
    }
  }
  // 8 of 72 right-hand sides are not covered, each for a named reason
  EXPECT_GE(bits.compared, 60);
  EXPECT_LE(bits.refused, 8);
}

TEST(RecordedFunctionTest, AllShippedMechanismsHaveTheBitsOfTheTextInJointCoordinates) {
  ExpectBitsOfTheText(Coordinates::kJoint);
}

TEST(RecordedFunctionTest, AllShippedMechanismsHaveTheBitsOfTheTextInAbsoluteCoordinates) {
  ExpectBitsOfTheText(Coordinates::kAbsolute);
}

TEST(RecordedFunctionTest, TheTextDoesNotDependOnTheStateWhereItWasRecorded) {
  for (const std::string& formulation : kFormulations) {
    Library<Planar> library(Shipped("slider-crank"), formulation, Enforcement::kAcceleration);
    const std::string here = PrintLibrary(RecordFunction(library.subject(), library.start()));
    const std::string there =
        PrintLibrary(RecordFunction(library.subject(), library.start(), 0.1, library.Near(1e-3)));
    EXPECT_EQ(here, there) << formulation;
  }
}

TEST(RecordedFunctionTest, WhatIsNotCoveredIsRefusedByName) {
  Library<Planar> library(Shipped("four-bar"), "odca", Enforcement::kAcceleration);
  const auto why = [&](RecordingSubject subject) -> std::string {
    try {
      RecordFunction(subject, library.start());
    } catch (const NotCovered& refused) {
      return refused.what();
    }
    return "recorded";
  };
  RecordingSubject subject = library.subject();
  EXPECT_EQ(why(subject), "recorded");
  subject.options.enforcement = Enforcement::kPosition;
  EXPECT_EQ(why(subject), "recorded");
  subject.most_nodes = 100;
  EXPECT_NE(why(subject).find("more than 100 operations"), std::string::npos);
  RecordingSubject mine = library.subject();
  mine.formulation = "mine";
  EXPECT_NE(why(mine).find("formulation \"mine\""), std::string::npos);
}

template <class Space>
void ExpectBitsOfTheGraph(const std::string& name, const std::string& formulation,
                          Enforcement level) {
  SCOPED_TRACE(name + " " + formulation);
  Library<Space> library(Shipped(name), formulation, level);
  const RecordedFunction recorded = RecordWith(library.subject(), library.start(), true);
  const CompiledBranch branch = CompileShared(recorded);
  const std::vector<double> constants = ConstantsOf(recorded);
  std::vector<double> room(static_cast<std::size_t>(branch.room));
  for (unsigned state = 0; state < 100; ++state) {
    const std::vector<double> y = library.Near(1e-4, state);
    std::vector<double> x = {0.25}, ydot(y.size());
    x.insert(x.end(), y.begin(), y.end());
    EXPECT_EQ(branch.function(x.data(), constants.data(), ydot.data(), room.data()), 1);
    bool ok = true;
    ExpectSameBits(ydot, Evaluate(recorded, x, &ok));
    EXPECT_TRUE(ok);
  }
}

/// Bennett's linkage: its sums and differences of products tempt compilers to fuse them.
TEST(GeneratedDerivativeTest, CompiledCodeHasTheBitsOfTheGraph) {
  for (const std::string& formulation : kFormulations) {
    ExpectBitsOfTheGraph<Planar>("four-bar", formulation, Enforcement::kVelocity);
  }
  ExpectBitsOfTheGraph<Spatial>("bennett", "odca", Enforcement::kAcceleration);
}

template <class Space>
void ExpectOneTextForOtherNumbers(const std::string& name, const std::string& formulation) {
  SCOPED_TRACE(name + " " + formulation);
  std::string first;
  for (int k = 1; k <= 4; ++k) {
    Library<Space> library(Varied(Shipped(name), k), formulation, Enforcement::kAcceleration);
    const RecordedFunction literal = RecordWith(library.subject(), library.start(), false);
    const RecordedFunction recorded = RecordWith(library.subject(), library.start(), true);
    if (k == 1) first = PrintLibrary(recorded);
    EXPECT_EQ(PrintLibrary(recorded), first) << k;
    const CompiledBranch shared = CompileShared(recorded), own = CompileOwn(literal);
    const std::vector<double> y = library.Near(1e-6), constants = ConstantsOf(recorded);
    std::vector<double> x = {0.25}, found(y.size()), expected(y.size());
    x.insert(x.end(), y.begin(), y.end());
    std::vector<double> room(static_cast<std::size_t>(std::max(shared.room, own.room)));
    EXPECT_EQ(shared.function(x.data(), constants.data(), found.data(), room.data()), 1);
    EXPECT_EQ(own.function(x.data(), nullptr, expected.data(), room.data()), 1);
    ExpectSameBits(found, expected);
    bool ok = true;
    ExpectSameBits(found, Evaluate(recorded, x, &ok));
    ExpectSameBits(found, Evaluate(literal, x, &ok));
    EXPECT_TRUE(ok);
  }
}

TEST(SharedCodeTest, MechanismsOfOtherNumbersShareATextAndHaveTheBitsOfTheirOwn) {
  for (const std::string& formulation : kFormulations) {
    ExpectOneTextForOtherNumbers<Planar>("four-bar", formulation);
    ExpectOneTextForOtherNumbers<Planar>("slider-crank", formulation);
    ExpectOneTextForOtherNumbers<Planar>("seven-bar", formulation);
  }
  ExpectOneTextForOtherNumbers<Spatial>("spatial-four-bar", "odca");
}

/// Shipped bars have length and mass 1: their graph has fewer operations, of which nothing is
/// assumed of other bars.
TEST(SharedCodeTest, ANumberThatIsOneOrZeroInOneMechanismIsOneThereAlone) {
  for (const std::string& formulation : kFormulations) {
    std::vector<std::string> structures;
    for (const auto& [k, gravity] : {std::pair(0, 1.0), std::pair(1, 1.0), std::pair(1, 0.0)}) {
      MechanismDescription description = Varied(Shipped("four-bar"), k);
      description.gravity *= gravity;
      Library<Planar> library(description, formulation, Enforcement::kAcceleration);
      const RecordedFunction recorded = RecordWith(library.subject(), library.start(), true);
      structures.push_back(recorded.structure);
      bool ok = true;
      const std::vector<double> y = library.Near(1e-3);
      std::vector<double> x = {0.25};
      x.insert(x.end(), y.begin(), y.end());
      const std::vector<double> found = Evaluate(recorded, x, &ok);
      ExpectSameBits(found, RecordFunction(library.subject(), library.start(), 0.25, y).numbers);
    }
    EXPECT_NE(structures[0], structures[1]);
    EXPECT_NE(structures[1], structures[2]);
  }
}

TEST(SharedCodeTest, OneFileServesMechanismsOfOtherNumbers) {
  const harness::TemporaryFolder folder("loopbench-shared-test");
  ::setenv("XDG_CACHE_HOME", folder.path().c_str(), 1);
  for (int k = 1; k <= 4; ++k) {
    Library<Planar> library(Varied(Shipped("four-bar"), k), "odca", Enforcement::kAcceleration);
    GeneratedDerivative<Planar> derivative(library.subject(), library.system());
    std::vector<double> ydot(library.y().size());
    EXPECT_TRUE(derivative.Evaluate(0.0, library.y(), ydot));
    ExpectSameBits(ydot, library.Examine(0.0, library.y()));
  }
  ::unsetenv("XDG_CACHE_HOME");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path() / "loopbench"), {}), 1);
}

/// Some hundred roundings, each of half a unit in the last place: 1e-12 of the largest number.
TEST(GeneratedDerivativeTest, FusedMultiplyAddChangesRoundingAlone) {
  bool any = false;
  for (const std::string& formulation : kFormulations) {
    Library<Planar> library(Shipped("four-bar"), formulation, Enforcement::kVelocity);
    const RecordedFunction recorded = RecordFunction(library.subject(), library.start());
    const std::vector<double> constants = ConstantsOf(recorded);
    std::vector<double> x = {0.25}, results[2];
    x.insert(x.end(), library.y().begin(), library.y().end());
    for (const Contraction contraction : {Contraction::kNone, Contraction::kFused}) {
      const CompiledBranch branch = CompileBranch(
          recorded.structure, [&] { return PrintLibrary(recorded); }, contraction);
      std::vector<double>& ydot = results[contraction == Contraction::kFused ? 1 : 0];
      ydot.resize(x.size() - 1);
      std::vector<double> room(static_cast<std::size_t>(branch.room));
      EXPECT_EQ(branch.function(x.data(), constants.data(), ydot.data(), room.data()), 1);
    }
    double largest = 0.0;
    for (const double number : results[0]) largest = std::max(largest, std::abs(number));
    for (std::size_t i = 0; i < results[0].size(); ++i) {
      EXPECT_NEAR(results[0][i], results[1][i], 1e-12 * largest) << formulation;
      any |= results[0][i] != results[1][i];
    }
  }
#ifdef __FMA__
  EXPECT_TRUE(any);
#endif
}

/// Against dual numbers: the same rules in another order, so 1e-12 of the largest entry for some
/// hundred operations.
TEST(GeneratedDerivativeTest, JacobiansAreThoseOfDualNumbers) {
  for (const std::string& formulation : kFormulations) {
    const MechanismDescription description = Shipped("four-bar");
    Library<Planar> library(description, formulation, Enforcement::kAcceleration);
    System<Planar, double>& system = library.system();
    system.UseJacobian(std::make_unique<ForwardJacobian<Planar>>(description, system));
    const std::size_t n = library.y().size();
    std::vector<double> dual(n * n), generated(n * n);
    EXPECT_GT(system.Jacobian(0.1, library.y(), dual)->dual_evaluations, 0);
    system.UseCompiled(std::make_unique<GeneratedDerivative<Planar>>(library.subject(), system));
    EXPECT_EQ(system.Jacobian(0.1, library.y(), generated)->dual_evaluations, 0);
    double largest = 0.0;
    for (const double number : dual) largest = std::max(largest, std::abs(number));
    for (std::size_t i = 0; i < n * n; ++i) {
      EXPECT_NEAR(generated[i], dual[i], 1e-12 * largest) << formulation << " " << i;
    }
    EXPECT_EQ(system.compiled()->misses(), 0);
  }
}

/// As published, multipliers choose pivots by comparing magnitudes: other masses choose others.
TEST(GeneratedDerivativeTest, WhereAComparisonFlipsTheLibraryEvaluatesWithEqualResults) {
  Library<Planar> library(Shipped("four-bar"), "odca", Enforcement::kAcceleration);
  System<Planar, double>& system = library.system();
  RecordingSubject subject = library.subject();
  system.UseCompiled(std::make_unique<GeneratedDerivative<Planar>>(subject, system));
  const auto derivative = [&](const std::vector<double>& y) {
    std::vector<double> ydot(y.size());
    EXPECT_EQ(system.Derivative(0.0, y, ydot), Outcome::kFinished);
    return ydot;
  };
  derivative(library.y());
  EXPECT_EQ(system.compiled()->misses(), 0);
  // bars in line: the loop's pivot is lost, and the general text regularizes a direction
  std::vector<double> line = library.y();
  for (int i = 0; i < system.mechanism().num_q(); ++i) line[static_cast<std::size_t>(i)] = 0.0;
  const std::vector<double> found = derivative(line);
  EXPECT_EQ(system.compiled()->misses(), 1);
  ExpectSameBits(found, library.Examine(0.0, line));
  derivative(library.y());
  EXPECT_EQ(system.compiled()->misses(), 1);
}

/// Reduction exchanges its partition several times in a turn of the crank; Bennett's linkage
/// releases other directions.
TEST(GeneratedDerivativeTest, AModeKeepsItsBranchesWhileAnotherIsInUse) {
  for (const auto& [name, level] : {std::pair{"spatial-four-bar", Enforcement::kPosition},
                                    {"bennett", Enforcement::kAcceleration}}) {
    SCOPED_TRACE(name);
    Library<Spatial> library(Shipped(name), "reduction", level);
    Library<Spatial> other(Shipped(name), "reduction", level);
    System<Spatial, double>&system = library.system(), &uncompiled = other.system();
    system.UseCompiled(std::make_unique<GeneratedDerivative<Spatial>>(library.subject(), system));
    std::vector<double> y = library.y(), at(y.size()), k(y.size()), sum(y.size()),
                        expected(y.size());
    constexpr double kStep = 5e-3;
    for (int step = 0; step < 2000; ++step) {
      // Runge and Kutta's method of order 4
      std::ranges::fill(sum, 0.0);
      for (const auto& [share, weight] :
           {std::pair{0.0, 1.0}, {0.5, 2.0}, {0.5, 2.0}, {1.0, 1.0}}) {
        for (std::size_t i = 0; i < y.size(); ++i) at[i] = y[i] + share * kStep * k[i];
        const double t = kStep * (step + share);
        ASSERT_EQ(system.Derivative(t, at, k), Outcome::kFinished);
        ASSERT_EQ(uncompiled.Derivative(t, at, expected), Outcome::kFinished);
        ASSERT_TRUE(std::ranges::equal(k, expected)) << step;
        for (std::size_t i = 0; i < y.size(); ++i) sum[i] += weight * k[i];
      }
      for (std::size_t i = 0; i < y.size(); ++i) y[i] += kStep / 6.0 * sum[i];
      std::vector<double> same = y;
      system.BeginStep(kStep * (step + 1), y);
      uncompiled.BeginStep(kStep * (step + 1), same);
      ASSERT_TRUE(std::ranges::equal(y, same)) << step;
    }
    const auto& generated = dynamic_cast<const GeneratedDerivative<Spatial>&>(*system.compiled());
    EXPECT_EQ(system.diagnostics().mode_changes, uncompiled.diagnostics().mode_changes);
    EXPECT_GT(generated.modes(), 1);
    EXPECT_LT(generated.misses(), 8000 / 20);
  }
}

/// Explicit Euler's steps, whose drift needs several Newton steps each.
template <class Space>
void ExpectBitsOfProjections(const std::string& name) {
  for (const std::string& formulation : kFormulations) {
    SCOPED_TRACE(name + " " + formulation);
    Library<Space> library(Shipped(name), formulation, Enforcement::kPosition);
    Library<Space> other(Shipped(name), formulation, Enforcement::kPosition);
    System<Space, double>&system = library.system(), &uncompiled = other.system();
    system.UseCompiled(std::make_unique<GeneratedDerivative<Space>>(library.subject(), system));
    std::vector<double> y = library.y(), same = y, rates(y.size());
    constexpr double kStep = 1e-3;
    const auto step = [&](System<Space, double>& by, int k, std::vector<double>& state) {
      ASSERT_EQ(by.Derivative(kStep * k, state, rates), Outcome::kFinished);
      for (std::size_t i = 0; i < state.size(); ++i) state[i] += kStep * rates[i];
      ASSERT_TRUE(by.BeginStep(kStep * (k + 1), state));
    };
    for (int k = 0; k < 100; ++k) {
      step(system, k, y);
      step(uncompiled, k, same);
      ExpectSameBits(y, same);
      EXPECT_EQ(system.level().correction().iterations, uncompiled.level().correction().iterations);
    }
    const auto& generated = dynamic_cast<const GeneratedDerivative<Space>&>(*system.compiled());
    EXPECT_GT(generated.branches(Quantity::kMismatch), 0);
    EXPECT_GT(generated.branches(Quantity::kPositionStep), 0);
    EXPECT_GT(generated.branches(Quantity::kSpeedStep), 0);
  }
}

TEST(GeneratedDerivativeTest, StepsOfLevelProjectionHaveTheBitsOfTheLibrary) {
  ExpectBitsOfProjections<Planar>("seven-bar");
  ExpectBitsOfProjections<Spatial>("bennett");
}

/// More runs than lanes, with three sets of masses. Tables of torques differ where the first branch
/// does not reach. Some runs take a branch that is not compiled.
TEST(LanesTest, RunsSideBySideHaveTheBitsThatTheyHaveAlone) {
  constexpr int kRuns = 2 * kLanes + 3;
  for (const std::string& formulation : kFormulations) {
    const auto derivatives = [&](int run, SideBySide* beside, std::int64_t* misses) {
      MechanismDescription description = Varied(Shipped("four-bar"), 1 + run % 3);
      description.forces.emplace_back(
          JointTorque{0, TimeTable{{0.0, 0.35, 0.9}, {1.0, 2.0, 3.0 + 0.137 * run}, false}});
      const Mechanism<Planar, double> mechanism(description, Coordinates::kJoint);
      const harness::BenchmarkState state = harness::ComputeState(description, Coordinates::kJoint);
      const auto system = harness::MakeFormulation<Planar>(formulation, mechanism,
                                                           {.general = true, .beside = beside});
      EXPECT_EQ(system->Start(0.0, state.q, state.u), Outcome::kFinished);
      system->UseCompiled(std::make_unique<GeneratedDerivative<Planar>>(
          RecordingSubject{.description = description,
                           .formulation = formulation,
                           .options = system->options(),
                           .least_in_lanes = 0},
          *system));
      std::vector<double> y(static_cast<std::size_t>(system->size())), ydot(y.size()), all;
      system->ToState(state.q, state.u, y);
      for (int call = 0; call < 5 + run; ++call) {
        y.back() += 1e-3 * (run + 1);
        if (call == 2 && run % 3 == 0) std::fill_n(y.begin(), mechanism.num_q(), 0.0);
        EXPECT_EQ(system->Derivative(0.1 * call, y, ydot), Outcome::kFinished);
        all.insert(all.end(), ydot.begin(), ydot.end());
      }
      *misses = system->compiled()->misses();
      return all;
    };
    std::vector<std::vector<double>> found(kRuns);
    std::vector<std::int64_t> misses(kRuns);
    harness::RunSideBySide(kRuns, 1, [&](int run, SideBySide& beside) {
      found[run] = derivatives(run, &beside, &misses[run]);
    });
    for (int run = 0; run < kRuns; ++run) {
      std::int64_t alone = 0;
      ExpectSameBits(found[run], derivatives(run, nullptr, &alone));
      EXPECT_EQ(misses[run], alone) << formulation << " " << run;
    }
  }
}

}  // namespace
}  // namespace loopbench::generate
