// What holds for any mechanism whatever: random trees closed at random, seeded.
//
// The scaled spectrum of a sample is that of the project's rank decision (docs/decisions/005): the
// squares of the singular values of K_g^-1 J L_g^-T in joint coordinates, for unit masses with the
// mechanism's length as radius of gyration. It is geometry alone, since rank is; masses here differ
// by a factor of e^2 at most. K_g makes it a pure number near one, and it is compared with one. A
// value between 1e-12 and 1e-4 is neither lost nor kept for certain: such a sample is ambiguous,
// and only a named outcome is required. In all others the rank is the number of values above the
// gap, by an SVD in long double. Formulations must find this rank and the oracle's accelerations.
#include <Eigen/SVD>

#include "lagrange/lagrange.h"
#include "mechanism/formulation/system.h"
#include "odca/odca.h"
#include "reduction/reduction.h"
#include "tests/contract/comparison.h"

namespace loopbench::testing::property_test {

constexpr int kSamples = 300;  // in each space
constexpr Real kLost = 1e-12L, kKept = 1e-4L;
/// Round-off of 24 bodies' equations, magnified by at most 1 / kKept: 1e-11, and masses and early
/// closures of O-DCA may be less well conditioned than the whole.
constexpr double kAgreement = 1e-9;

/// Counts and worst cases of one space.
struct Tally {
  int samples = 0, ambiguous = 0, closed = 0, redundant = 0, locked = 0, driven = 0,
      inconsistent = 0;
  std::map<std::string, int> outcomes;  ///< of every evaluation
  std::map<std::string, double> worst;

  void Note(const std::string& name, double value) {
    worst[name] = std::max(worst[name], std::isnan(value) ? INFINITY : value);
  }
};

/// The description with the bodies that decide rank.
MechanismDescription WithUnitBodies(MechanismDescription description, double length) {
  for (BodyDescription& body : description.bodies) {
    body.mass = 1.0;
    body.inertia = length * length * Eigen::Matrix3d::Identity();
  }
  return description;
}

/// The spectrum, descending. Empty where nothing is constrained or nothing is free.
template <class Space>
RealVector ScaledSpectrum(const Sample<Space>& sample) {
  const Mechanism<Space, double>& mechanism = sample.mechanism(Coordinates::kJoint);
  if (mechanism.num_rows() == 0 || mechanism.num_u() == 0) return {};
  Oracle oracle(WithUnitBodies(sample.description(), mechanism.length()), LayoutOf(mechanism));
  const RealMatrix B = oracle.ScaledConstraints(ToReal(sample.state(Coordinates::kJoint).q));
  return Eigen::JacobiSVD<RealMatrix>(B).singularValues().cwiseAbs2();
}

std::string Text(const RealVector& spectrum) {
  std::string text;
  for (Real value : spectrum) {
    char number[32];
    std::snprintf(number, sizeof number, " %.1e", static_cast<double>(value));
    text += number;
  }
  return text;
}

/// The oracle's values of one sample in one coordinate set.
template <class Space>
struct Truth {
  Truth(const Sample<Space>& sample, Coordinates coordinates)
      : mechanism(sample.mechanism(coordinates)),
        state(sample.state(coordinates)),
        oracle(sample.description(), LayoutOf(mechanism)),
        udot(sample.udot(coordinates)) {
    const RealVector q = ToReal(state.q), u = ToReal(state.u);
    const Equations e = oracle.Form(q, u);
    if (udot.size() == 0) return;
    const RealMatrix L = CholeskyFactor(e.M);
    const RealVector scaled = SolveLower(L, -e.h);
    // without any loop
    free = Real(L.transpose()
                    .template triangularView<Eigen::Upper>()
                    .solve(scaled)
                    .template lpNorm<Eigen::Infinity>());
  }

  const Mechanism<Space, double>& mechanism;
  const State& state;
  Oracle oracle;
  RealVector udot;
  Real free = 0;  ///< largest acceleration that forces would cause without loops
};

/// Whether speeds exist that loops and prescribed motions agree on: the rates left over by those
/// nearest to it, 1 m/s being the size of all speeds drawn.
template <class Space>
bool MotionsAreConsistent(const Truth<Space>& truth) {
  const RealVector rates = truth.oracle.ClosureRates(ToReal(truth.state.q), ToReal(truth.state.u));
  if (rates.size() == 0) return true;
  const Real left = rates.template lpNorm<Eigen::Infinity>();
  EXPECT_TRUE(left < 1e-11L || left > 1e-6L) << "cannot tell whether motions are consistent";
  return left < 1e-9L;
}

struct Method {
  std::string name;
  Enforcement enforcement;
};

template <class Space>
std::unique_ptr<System<Space, double>> Make(const Method& method,
                                            const Mechanism<Space, double>& mechanism) {
  const FormulationOptions options{method.enforcement, SolverKind::kRankRevealing};
  if (method.name == "odca") return MakeSystem<odca::Odca>(mechanism, options);
  if (method.name == "lagrange") return MakeSystem<lagrange::Lagrange>(mechanism, options);
  const auto matrices =
      method.name == "reduction" ? reduction::Matrices::kLessWork : reduction::Matrices::kSparse;
  return MakeSystem<reduction::Reduction>(mechanism, options, matrices);
}

/// Rate of the energy by differences of the oracle's along the motion, against the powers.
template <class Space>
void CheckBalance(Truth<Space>& truth, System<Space, double>& at, Tally& tally) {
  const RealVector q = ToReal(at.q()), u = ToReal(at.u()), udot = ToReal(at.udot());
  VectorX<double> qdot(q.size());
  truth.mechanism.Rates(at.q(), at.u(), qdot);
  const Real step = 1e-7L;  // long double: truncation 1e-14, round-off 1e-12 of the energy
  const auto energy = [&](Real t) {
    truth.oracle.SetTime(t);
    return truth.oracle.TotalEnergy(q + t * ToReal(qdot), u + t * udot);
  };
  const Real rate = (energy(step) - energy(-step)) / (2 * step);
  truth.oracle.SetTime(0);
  const Power<double> forces = AppliedPower(at.kinematics());
  const Real power = Real(forces.supplied) - forces.dissipated + at.DrivePower();
  Real scale = 1 + std::abs(energy(0));
  truth.oracle.SetTime(0);
  if (udot.size() > 0) scale += udot.template lpNorm<Eigen::Infinity>();
  const double error = static_cast<double>(std::abs(rate - power) / scale);
  EXPECT_LE(error, kAgreement);
  tally.Note("balance", error);
}

/// Power of the forces `force(j)` in the given joints, against `expected`. Speeds have the size
/// one.
template <class Space, class Force>
void CheckWork(const System<Space, double>& at, const std::vector<int>& joints, const Force& force,
               double expected, Tally& tally) {
  double power = 0.0, scale = 0.0;
  for (int j : joints) {
    const Velocity<Space, double>& V = at.kinematics().joints()[j].V_rel;
    const Wrench<Space, double> F = force(j);
    power += F.dot(V);
    scale += F.norm() * std::max(1.0, V.norm());
  }
  if (scale == 0.0) {
    EXPECT_EQ(expected, 0.0);
    return;
  }
  const double error = std::abs(power - expected) / scale;
  // speeds are consistent but for rounding, whatever the forces: no condition number
  EXPECT_LE(error, 100 * kEps * at.mechanism().num_bodies());
  tally.Note("work of constraints", error);
}

/// Forces of all user joints (O-DCA) and of all constraints (multipliers): no work without
/// prescribed motions, the drives' power with them. Reduction has no forces of its own: its balance
/// says the same.
template <class Space>
void CheckConstraints(System<Space, double>& at, int user_joints, Tally& tally) {
  const Mechanism<Space, double>& mechanism = at.mechanism();
  const double drives = at.DrivePower();
  if (mechanism.drives().empty()) {
    EXPECT_EQ(drives, 0.0);
  }
  if (mechanism.num_u() == 0) return;  // nothing to solve for, no forces
  if (const auto* odca = dynamic_cast<const odca::Odca<Space, double>*>(&at.solver())) {
    std::vector<int> joints(user_joints);
    for (int j = 0; j < user_joints; ++j) joints[j] = j;
    CheckWork(
        at, joints, [&](int j) { return odca->JointForce(j); }, drives, tally);
  }
  if (dynamic_cast<const lagrange::Lagrange<Space, double>*>(&at.solver()) != nullptr) {
    // in joint coordinates all drives are in the tree, none among the multipliers
    const bool rows = mechanism.coordinates() == Coordinates::kAbsolute;
    const auto force = [&](int j) {
      const JointState<Space, double>& state = at.kinematics().joints()[j];
      auto F = Wrench<Space, double>::Zero();
      for (int r = 0; r < state.rows(); ++r) {
        F += state.D(r) * at.Multipliers()[mechanism.joints()[j].row + r];
      }
      return F;
    };
    CheckWork(at, mechanism.constraints(), force, rows ? drives : 0.0, tally);
  }
}

template <class Space>
void Examine(int number, DrawnKinds kinds, Tally& tally) {
  const std::uint64_t seed = 1000 + number;
  Random random(seed);
  const int bodies = 1 + random.Below(12), closures = random.Below(5);
  const int motions = number % 3 == 0 ? 1 + random.Below(3) : 0;
  const SpaceKind space = Space::kRot == 1 ? SpaceKind::kPlanar : SpaceKind::kSpatial;
  const MechanismDescription description =
      AnyMechanism(bodies, closures, motions, space, seed, kinds);
  const Sample<Space> sample(description, seed);
  const Mechanism<Space, double>& joint_set = sample.mechanism(Coordinates::kJoint);
  const RealVector spectrum = ScaledSpectrum(sample);
  SCOPED_TRACE(description.name + ", spectrum" + Text(spectrum));
  const bool ambiguous =
      std::ranges::any_of(spectrum, [](Real v) { return v >= kLost && v <= kKept; });
  const int rank =
      static_cast<int>(std::ranges::count_if(spectrum, [](Real v) { return v > kKept; }));
  const bool driven = !joint_set.drives().empty();
  const bool immovable = rank == joint_set.num_u();
  const bool consistent =
      ambiguous || MotionsAreConsistent(Truth<Space>(sample, Coordinates::kJoint));
  ++tally.samples;
  tally.closed += joint_set.num_rows() > 0;
  tally.driven += driven;
  tally.ambiguous += ambiguous;
  tally.redundant += !ambiguous && rank < joint_set.num_rows();
  tally.locked += !ambiguous && immovable && !driven;
  tally.inconsistent += !consistent;
  const Start<double> start = Assemble(description, joint_set);
  if (!ambiguous) {
    EXPECT_EQ(start.outcome, !consistent            ? Outcome::kInconsistentStart
                             : immovable && !driven ? Outcome::kLocked
                                                    : Outcome::kFinished)
        << ToString(start.outcome) << " " << start.message;
  }
  for (Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    Truth<Space> truth(sample, coordinates);
    VectorX<double> first;
    for (const Method& method : {Method{"odca", Enforcement::kAcceleration},
                                 {"lagrange", Enforcement::kAcceleration},
                                 {"reduction", Enforcement::kAcceleration},
                                 {"reduction", Enforcement::kVelocity},
                                 {"sparse reduction", Enforcement::kAcceleration},
                                 {"sparse reduction", Enforcement::kVelocity}}) {
      SCOPED_TRACE(method.name + ", " + std::string(ToString(method.enforcement)) + ", " +
                   std::string(ToString(coordinates)));
      const auto formulation = Make(method, truth.mechanism);
      formulation->Start(0.0, truth.state.q, truth.state.u);
      std::vector<double> y(formulation->state_size()), ydot(y.size());
      formulation->ToState(truth.state.q, truth.state.u, y);
      const Outcome outcome = formulation->Examine(0.0, std::span<const double>(y), ydot);
      ++tally.outcomes[std::string(ToString(outcome))];
      if (ambiguous) {
        EXPECT_TRUE(outcome != Outcome::kFinished || formulation->udot().allFinite());
        continue;
      }
      EXPECT_EQ(formulation->diagnostics().rank, rank);
      EXPECT_EQ(outcome, consistent ? Outcome::kFinished : Outcome::kInconsistentMotion)
          << ToString(outcome);
      if (outcome != Outcome::kFinished || !consistent) continue;
      const VectorX<double>& udot = formulation->udot();
      if (udot.size() > 0) {
        // where nothing is free to move, what loops take away is the size of what is left
        const Real size = truth.udot.template lpNorm<Eigen::Infinity>();
        const Real scale = immovable ? std::max(size, truth.free) : size;
        if (first.size() == 0) first = udot;
        const double error = static_cast<double>(
            (ToReal(udot) - truth.udot).template lpNorm<Eigen::Infinity>() / scale);
        const double difference =
            (udot - first).template lpNorm<Eigen::Infinity>() / static_cast<double>(scale);
        EXPECT_LE(error, kAgreement);
        EXPECT_LE(difference, kAgreement);
        tally.Note("error", error);
        tally.Note("disagreement", difference);
      }
      CheckBalance(truth, *formulation, tally);
      CheckConstraints(*formulation, static_cast<int>(description.joints.size()), tally);
    }
  }
}

template <class Space>
void ExamineAll(const char* name, DrawnKinds kinds = DrawnKinds::kUpToHelical) {
  Tally tally;
  for (int i = 0; i < kSamples; ++i) Examine<Space>(i, kinds, tally);
  std::string line = std::to_string(tally.samples) + " samples: " + std::to_string(tally.closed) +
                     " with loops, " + std::to_string(tally.driven) + " driven, " +
                     std::to_string(tally.ambiguous) + " ambiguous, " +
                     std::to_string(tally.redundant) + " redundant, " +
                     std::to_string(tally.locked) + " locked, " +
                     std::to_string(tally.inconsistent) + " inconsistent; evaluations:";
  for (const auto& [outcome, count] : tally.outcomes) {
    line += " " + outcome + " " + std::to_string(count);
  }
  line += "; worst:";
  for (const auto& [what, value] : tally.worst) {
    char number[32];
    std::snprintf(number, sizeof number, " %.1e", value);
    line += " " + what + number;
  }
  std::printf("%-8s %s\n", name, line.c_str());
  ::testing::Test::RecordProperty(name, line);
  EXPECT_LE(10 * tally.ambiguous, tally.samples);
  // the draw must meet what the properties are about
  EXPECT_GE(5 * tally.driven, tally.samples);
  EXPECT_GT(tally.redundant, 0);
  EXPECT_GT(tally.locked, 0);
  EXPECT_GT(tally.inconsistent, 0);
}

TEST(PropertyTest, MechanismsInThePlane) { ExamineAll<Planar>("plane"); }

TEST(PropertyTest, MechanismsInSpace) { ExamineAll<Spatial>("space"); }

TEST(PropertyTest, MechanismsOfAllKindsInSpace) {
  ExamineAll<Spatial>("all kinds", DrawnKinds::kAll);
}

}  // namespace loopbench::testing::property_test
