// Jacobians by forward differentiation against difference quotients of the right-hand side itself,
// for every shipped mechanism and for random ones, in all formulations, levels and coordinate sets.
#include "mechanism/formulation/forward_jacobian.h"

#include <Eigen/Eigenvalues>

#include "harness/integrator/arkode.h"
#include "mechanism/start/assembly.h"
#include "odca/odca.h"
#include "tests/contract/allocations.h"
#include "tests/contract/generators.h"
#include "tests/reference/cases.h"

namespace loopbench::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using harness::Method;

constexpr int kMaxColumns = 12;

/// One column of a Jacobian by differences, and what each entry may be wrong by.
struct Quotient {
  VectorXd value, error;
  double worst() const { return error.size() == 0 ? INFINITY : error.maxCoeff(); }
};

/// f(y) and the powers of its mechanism, at one time.
template <class Space>
class RightHandSide {
 public:
  RightHandSide(System<Space, double>& formulation, double t)
      : formulation_(formulation), t_(t), size_(formulation.state_size()) {}

  VectorXd operator()(const VectorXd& y) {
    VectorXd f(size_ + 2);
    const Outcome outcome = formulation_.Examine(t_, {y.data(), static_cast<std::size_t>(size_)},
                                                 {f.data(), static_cast<std::size_t>(size_)});
    EXPECT_EQ(outcome, Outcome::kFinished) << ToString(outcome);
    const Power<double> power = formulation_.TotalPower();
    f.tail<2>() << power.supplied, power.dissipated;
    return f;
  }

  /// Central differences at h, h/2, h/4, h/8, extrapolated (Romberg). The error of the last number
  /// on the diagonal is below its distance from the one before; round-off of f comes on top, the
  /// weights of the extrapolation being below two.
  Quotient Differentiate(const VectorXd& y, int column, double h, double noise, int levels) {
    std::vector<VectorXd> row;
    Quotient quotient;
    for (int level = 0; level < levels; ++level, h /= 2) {
      VectorXd up = y, down = y;
      up[column] += h;
      down[column] -= h;
      const double width = up[column] - down[column];
      std::vector<VectorXd> next = {((*this)(up) - (*this)(down)) / width};
      double power = 1.0;
      for (const VectorXd& before : row) {
        power *= 4.0;
        next.push_back(next.back() + (next.back() - before) / (power - 1.0));
      }
      if (level > 0) {
        quotient.error = (next.back() - row.back()).cwiseAbs().array() + 2.0 * noise / h;
      }
      row = next;
    }
    quotient.value = row.back();
    return quotient;
  }

  /// The same with the widest increment that promises the least error, and a second opinion: that
  /// of the next best, for round-off that the noise does not know.
  Quotient Differentiate(const VectorXd& y, int column, double widest, double noise) {
    Quotient best, second;
    widest *= std::max(1.0, std::abs(y[column]));
    for (double h = widest; h > 1e-5 * widest; h /= 32) {
      Quotient one = Differentiate(y, column, h, noise, 4);
      if (second.worst() > one.worst()) std::swap(second, one);
      if (best.worst() > second.worst()) std::swap(best, second);
    }
    best.error.array() += (best.value - second.value).cwiseAbs().maxCoeff();
    return best;
  }

 private:
  System<Space, double>& formulation_;
  double t_;
  int size_;
};

/// Smallest over largest principal moment of inertia. O-DCA starts from what bodies would do alone:
/// a slender shaft a hundred thousand times more than with its load, and that has to cancel.
template <class Space>
double Slenderness(const Mechanism<Space, double>& mechanism) {
  double smallest = INFINITY, largest = 0.0;
  for (std::size_t body = 1; body < mechanism.bodies().size(); ++body) {
    const auto moments = MatrixXd(mechanism.bodies()[body].rotational.eigen())
                             .selfadjointView<Eigen::Lower>()
                             .eigenvalues();
    smallest = std::min(smallest, moments.minCoeff());
    largest = std::max(largest, moments.maxCoeff());
  }
  return smallest / largest;
}

struct Worst {
  int comparisons = 0;
  double ratio = 0.0, relative = 0.0, blunt = 0.0;
};

/// At a state of a formulation that has started.
template <class Space>
void CompareAt(const MechanismDescription& description, System<Space, double>& formulation,
               double t, const VectorXd& y, Worst& worst) {
  const int n = formulation.state_size();
  if (n == 0) return;
  RightHandSide<Space> f(formulation, t);
  const VectorXd f0 = f(y);
  if (::testing::Test::HasFailure()) return;
  MatrixXd jacobian = MatrixXd::Zero(n + 2, n);
  ForwardJacobian<Space> forward(description, formulation);
  const long before = CountAllocations();
  forward.Evaluate(jacobian);
  EXPECT_EQ(CountAllocations(), before);
  const Diagnostics at = formulation.diagnostics();
  // Redundant constraints become independent ones some 1e-4 off their closure (kTheta), and f
  // another function. Those that count are at least as well conditioned as the solver's fast path
  // asks for.
  const bool redundant = at.smallest_weight < 1.0;
  const double widest = redundant ? 1e-6 : 1.0 / 16;
  const double rcond = redundant ? LoopSolver<double>::kSuspicious : at.rcond;
  // round-off of accelerations (CONTRIBUTING.md, tolerances)
  const bool is_odca =
      dynamic_cast<const odca::Odca<Space, double>*>(&formulation.solver()) != nullptr;
  const double cancels = is_odca && !redundant ? Slenderness(formulation.mechanism()) : 1.0;
  const double relative = 100 * kEps * formulation.mechanism().num_bodies() / (rcond * cancels);
  const double noise = relative * f0.cwiseAbs().maxCoeff();
  // of large states some columns, other ones for every method
  const int stride = 1 + n / kMaxColumns;
  for (int j = worst.comparisons++ % stride; j < n; j += stride) {
    const Quotient quotient = f.Differentiate(y, j, widest, noise);
    const double size = std::max(1.0, quotient.value.cwiseAbs().maxCoeff());
    for (int i = 0; i < n + 2; ++i) {
      const double error = std::abs(jacobian(i, j) - quotient.value[i]);
      const double bound = quotient.error[i] + relative * size;
      EXPECT_LE(error, bound) << "d ydot[" << i << "] / dy[" << j << "] is " << quotient.value[i]
                              << ", not " << jacobian(i, j);
      worst.ratio = std::max(worst.ratio, error / bound);
      worst.relative = std::max(worst.relative, error / size);
      worst.blunt = std::max(worst.blunt, bound / size);
    }
  }
}

template <class Space>
void Compare(const MechanismDescription& description, const Method& column, double t,
             const VectorXd& q, const VectorXd& u, Worst& worst) {
  SCOPED_TRACE(ToString(column));
  const Mechanism<Space, double> mechanism(description, column.coordinates);
  const auto formulation = harness::MakeFormulation<Space>(column, mechanism);
  ASSERT_EQ(formulation->Start(t, q, u), Outcome::kFinished);
  VectorXd y(formulation->state_size());
  formulation->ToState(q, u, {y.data(), static_cast<std::size_t>(y.size())});
  CompareAt(description, *formulation, t, y, worst);
}

template <class Space>
Worst CompareAll(const MechanismDescription& description, double t, const VectorXd& q_joint,
                 const VectorXd& u_joint) {
  const Mechanism<Space, double> joint(description, Coordinates::kJoint);
  Worst worst;
  for (Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    const Mechanism<Space, double> mechanism(description, coordinates);
    Kinematics<Space, double> from(joint), to(mechanism);
    from.SetTime(t);
    from.UpdatePosition(q_joint);
    from.UpdateVelocity(u_joint);
    to.SetTime(t);
    const VectorXd q = from.CoordinatesIn(mechanism);
    to.UpdatePosition(q);
    const VectorXd u = from.SpeedsIn(to);
    for (const std::string formulation : {"odca", "lagrange", "reduction"}) {
      for (Enforcement level :
           {Enforcement::kAcceleration, Enforcement::kVelocity, Enforcement::kBaumgarte}) {
        Method column{formulation, level, coordinates, SolverKind::kRankRevealing};
        if (level == Enforcement::kBaumgarte) column.gains = BaumgarteGains{3.0, 4.0};
        Compare<Space>(description, column, t, q, u, worst);
      }
    }
  }
  std::printf("%s: error / bound %.1e, error %.1e, bound %.1e\n", description.name.c_str(),
              worst.ratio, worst.relative, worst.blunt);
  return worst;
}

/// Some way into the motion, where nothing is zero by symmetry.
template <class Space>
void CompareShipped(const MechanismDescription& description, double t) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  const auto formulation =
      MakeSystem<odca::Odca>(mechanism, {.enforcement = Enforcement::kVelocity});
  ASSERT_EQ(formulation->Start(0.0, start.q, start.u), Outcome::kFinished);
  std::vector<double> y(static_cast<std::size_t>(formulation->state_size()));
  formulation->ToState(start.q, start.u, y);
  harness::IntegratorOptions options;
  options.rtol = options.atol = 1e-11;
  y.resize(static_cast<std::size_t>(formulation->size()));
  ASSERT_EQ(Integrate(*formulation, 0.0, t, y, options).outcome, Outcome::kFinished);
  y.resize(static_cast<std::size_t>(formulation->state_size()));
  ASSERT_EQ(formulation->FromState(t, std::span<const double>(y)), Outcome::kFinished);
  CompareAll<Space>(description, t, formulation->q(), formulation->u());
}

class ForwardJacobianOf : public ::testing::TestWithParam<std::string> {};

TEST_P(ForwardJacobianOf, ShippedMechanismIsThatOfDifferences) {
  const MechanismDescription description =
      harness::ReadMechanism(harness::kConfigs / "mechanisms" / (GetParam() + ".json")).description;
  const double t = GetParam() == "andrews-squeezer" ? 0.005 : 0.05;
  if (description.space == SpaceKind::kPlanar) {
    CompareShipped<Planar>(description, t);
  } else {
    CompareShipped<Spatial>(description, t);
  }
}

INSTANTIATE_TEST_SUITE_P(All, ForwardJacobianOf, ::testing::ValuesIn(harness::ShippedNames()),
                         [](const auto& name) {
                           std::string text = name.param;
                           std::erase(text, '-');
                           return text;
                         });

/// Joints, forces and motions of these kinds.
template <class Space>
void CompareRandom(std::uint64_t seed, DrawnKinds kinds = DrawnKinds::kUpToHelical) {
  const SpaceKind space = Space::kRot == 1 ? SpaceKind::kPlanar : SpaceKind::kSpatial;
  const MechanismDescription description = MixedGraph(2, space, seed, seed % 2 == 0 ? 2 : 0, kinds);
  SCOPED_TRACE(description.name);
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const State state = ConsistentState<Space>(description, mechanism, seed);
  CompareAll<Space>(description, 0.0, state.q, state.u);
}

// A constraint measures its angle modulo a turn, and a spring on it remembers how far it is wound.
// Its moment turns with the arm that carries it, but what the turns add to that the joint takes up.
TEST(ForwardJacobian, NeedNotKnowHowFarASpringIsWound) {
  MechanismDescription description;
  description.space = SpaceKind::kSpatial;
  description.gravity = {0.0, 0.0, -9.81};
  const Eigen::Vector3d moments(0.1, 0.2, 0.3);
  for (const char* name : {"arm", "bar"}) {
    BodyDescription& body = description.bodies.emplace_back();
    body.name = name;
    body.mass = 1.0;
    body.com = {0.5, 0.0, 0.0};
    body.inertia = moments.asDiagonal();
  }
  JointDescription arm, bar;
  arm.name = "a";
  arm.to.body = 1;
  bar.name = "b";
  bar.from.body = 1;
  bar.from.position = {1.0, 0.0, 0.0};
  bar.to.body = 2;
  bar.axis = {0.0, 1.0, 0.0};
  description.joints = {arm, bar};
  description.forces = {JointSpring{.joint = 1, .stiffness = 3.0}};
  const Mechanism<Spatial, double> joint(description, Coordinates::kJoint);
  const Mechanism<Spatial, double> absolute(description, Coordinates::kAbsolute);
  const auto formulation = MakeSystem<odca::Odca>(absolute);
  VectorXd y(formulation->state_size());
  const std::span<double> state(y.data(), static_cast<std::size_t>(y.size()));
  for (const double angle : {0.0, 2.0, 4.0, 6.0, 7.0}) {
    Kinematics<Spatial, double> from(joint), to(absolute);
    from.UpdatePosition(Eigen::Vector2d(0.3, angle));
    from.UpdateVelocity(Eigen::Vector2d(0.7, -0.4));
    const VectorXd q = from.CoordinatesIn(absolute);
    to.UpdatePosition(q);
    const VectorXd u = from.SpeedsIn(to);
    if (angle == 0.0) formulation->Start(0.0, q, u);
    formulation->ToState(q, u, state);
    formulation->BeginStep(0.0, state);
  }
  EXPECT_NEAR(formulation->kinematics().JointCoordinate(1), 7.0, 1e-12);
  Worst worst;
  CompareAt<Spatial>(description, *formulation, 0.0, y, worst);
  EXPECT_EQ(worst.comparisons, 1);
}

class ForwardJacobianOfRandom : public ::testing::TestWithParam<std::uint64_t> {};
TEST_P(ForwardJacobianOfRandom, MechanismInThePlane) { CompareRandom<Planar>(GetParam()); }
TEST_P(ForwardJacobianOfRandom, MechanismInSpace) { CompareRandom<Spatial>(GetParam()); }
TEST_P(ForwardJacobianOfRandom, MechanismOfAllKinds) {
  if (GetParam() <= 4) CompareRandom<Spatial>(GetParam(), DrawnKinds::kAll);
}
INSTANTIATE_TEST_SUITE_P(Seeds, ForwardJacobianOfRandom, ::testing::Range<std::uint64_t>(1, 11));

}  // namespace
}  // namespace loopbench::testing
