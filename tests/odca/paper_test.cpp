// The paper's formulas for one loop, (15-42), evaluated as printed, against a dense system of the
// same bodies and against O-DCA: random chains closed on Ground through joints of every kind.
#include "mechanism/description/library.h"
#include "tests/odca/paper_series.h"

namespace loopbench::odca::paper::paper_test {

MechanismDescription ChainOfKinds(int n, SpaceKind space, std::uint64_t seed) {
  Builder b("paper-chain", space, seed);
  return ChainOf(Kinds(b, n + 1, b.spatial ? 8 : 4), b);
}

/// Upsilon_ij (26-28) of every node that is a series of bodies, at the handles: S_i Z_ij S_j^T.
template <class Space>
void HoldAssemblies(const Scene<Space>& scene, Series<Space>& series, int bodies, double bound,
                    Tally& tally) {
  constexpr int d = Space::kDim;
  Deviation deviation;
  for (const Response& response : Responses(scene.odca())) {
    const int first = response.all.front(), last = response.all.back();
    if (response.grounded || last - first + 1 != static_cast<int>(response.all.size())) continue;
    if (first == last || response.kept.size() != 2 || last > bodies) continue;
    const TwoHandles upsilon = series.Assembly(first - 1, last);
    const int at_first = response.kept[0] == first ? 0 : d, at_last = d - at_first;
    const RealMatrix S1 = scene.Shift(scene.Arm(first, scene.JointIndex(first - 1)));
    const RealMatrix S2 = scene.Shift(scene.Arm(last, scene.JointIndex(last)));
    const auto Z = [&](int i, int j) { return response.Z.block(i, j, d, d); };
    deviation.Note(S1 * Z(at_first, at_first) * S1.transpose(), upsilon.z11);
    deviation.Note(S1 * Z(at_first, at_last) * S2.transpose(), upsilon.z12);
    deviation.Note(S2 * Z(at_last, at_first) * S1.transpose(), upsilon.z21);
    deviation.Note(S2 * Z(at_last, at_last) * S2.transpose(), upsilon.z22);
    ++tally.assemblies;
  }
  if (deviation.size > 0) tally.Hold("Upsilon", deviation, bound);
}

template <class Space>
void HoldChain(const MechanismDescription& description, int n, std::uint64_t seed, Tally& tally) {
  Scene<Space> scene(description, seed);
  std::vector<int> bodies, joints;
  for (int i = 0; i <= n; ++i) joints.push_back(scene.JointIndex(i));
  for (int i = 1; i <= n; ++i) bodies.push_back(i);
  Series<Space> series(scene, bodies, joints);
  // seen from Ground, both joints lead to the system
  const GroundedLoop loop(series.Assembly(), scene.JointTo(1, joints[0]),
                          scene.JointTo(n, joints[n]));
  const double rcond = std::min(series.rcond(), Rcond(loop.chi));
  ++tally.scenes;
  if (!(rcond > kMinRcond)) {
    ++tally.left_out;
    return;
  }
  series.Disassemble(loop.F_bb, loop.F_tb);
  const DenseAnswer dense = scene.Solve(bodies, joints, RealVector::Zero(Space::kDim));
  Deviation printed;
  for (int i = 0; i < n; ++i) {
    const bool is_Q = scene.mechanism().joints()[joints[i]].to == bodies[i];
    printed.Note(is_Q ? series.inner(i) : RealVector(-series.inner(i)), dense.forces[i]);
  }
  tally.Hold("printed against dense", printed, static_cast<double>(kMargin * n * kRealEps) / rcond);
  EXPECT_LE(loop.missing37.norm() + loop.missing38.norm(),
            kMargin * n * kRealEps / rcond * (loop.chi.norm() * printed.size + 1));

  const double bound = kMargin * n * kEps / rcond;
  for (const SolverKind solver : {SolverKind::kAsPublished, SolverKind::kRankRevealing}) {
    ASSERT_EQ(scene.Evaluate(solver), Outcome::kFinished) << description.name;
    Deviation forces, accelerations;
    series.Compare(forces, accelerations);
    tally.Hold("forces", forces, bound);
    tally.Hold("accelerations", accelerations, bound);
    HoldAssemblies(scene, series, n, bound, tally);
  }
}

TEST(PaperTest, ChainsClosedOnGroundInThePlane) {
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    for (const int n : {3, 5, 8}) {
      HoldChain<Planar>(ChainOfKinds(n, SpaceKind::kPlanar, seed), n, seed, tally);
    }
  }
  tally.Print("plane, chains");
  EXPECT_LE(3 * tally.left_out, tally.scenes);
  EXPECT_GE(tally.assemblies, tally.scenes);
}

TEST(PaperTest, ChainsClosedOnGroundInSpace) {
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    for (const int n : {4, 7}) {
      HoldChain<Spatial>(ChainOfKinds(n, SpaceKind::kSpatial, seed), n, seed, tally);
    }
  }
  tally.Print("space, chains");
  EXPECT_LE(3 * tally.left_out, tally.scenes);
  EXPECT_GE(tally.assemblies, tally.scenes);
}

/// Returns the largest term of (7), over tree joints, beside H udot and Hdot u with H
/// differentiated in ground axes. Where the joint slides, Mo moves along P, and w_P x v_rel
/// remains.
template <class Space>
double RestOfEquation7(std::uint64_t seed) {
  constexpr double h = 1e-5;  // truncation h^2 and round-off eps / h are both below 1e-9
  const SpaceKind space = Space::kRot == 1 ? SpaceKind::kPlanar : SpaceKind::kSpatial;
  const MechanismDescription description = ChainOfKinds(5, space, seed);
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const testing::State state = testing::ConsistentState(description, mechanism, seed);
  VectorX<double> rates(mechanism.num_q());
  mechanism.Rates(state.q, state.u, rates);
  Kinematics<Space, double> now(mechanism), before(mechanism), after(mechanism);
  now.UpdatePosition(state.q);
  now.UpdateVelocity(state.u);
  before.UpdatePosition(state.q - h * rates);
  after.UpdatePosition(state.q + h * rates);
  double largest = 0.0;
  for (const TreeStep& step : mechanism.tree()) {
    const Joint<Space, double>& joint = mechanism.joints()[step.joint];
    const JointState<Space, double>& at = now.joints()[step.joint];
    auto Hdot_u = Acceleration<Space, double>::Zero();
    for (int i = 0; i < at.num_u; ++i) {
      Hdot_u += (after.joints()[step.joint].H(i) - before.joints()[step.joint].H(i)) *
                (state.u[joint.u_offset + i] / (2 * h));
    }
    const Angular<Space, double>& w_P = now.motions()[joint.from].angular;
    const Acceleration<Space, double> rest(Angular<Space, double>::Zero(),
                                           Cross<double>(w_P, at.V_rel.linear));
    EXPECT_LE((at.g - Hdot_u - rest).norm(), 1e-7 * (1.0 + at.g.norm())) << joint.description;
    largest = std::max(largest, rest.norm());
  }
  return largest;
}

TEST(PaperTest, Equation7NeedsMoreThanHdotUWhereAJointSlides) {
  double plane = 0.0, space = 0.0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    plane = std::max(plane, RestOfEquation7<Planar>(seed));
    space = std::max(space, RestOfEquation7<Spatial>(seed));
  }
  EXPECT_GE(plane, 0.1);
  EXPECT_GE(space, 0.1);
}

/// Section 3.3 says that all matrices stay positive definite. Those of joins with a floating side
/// do; chi of a planar loop has three zero eigenvalues in space, in every position.
TEST(PaperTest, ChiOfAPlanarLoopInSpaceIsNotPositiveDefinite) {
  MechanismDescription description = Chain(3);
  description.space = SpaceKind::kSpatial;
  const int n = static_cast<int>(description.bodies.size()) - 1;
  const Scene<Spatial> scene(description, 1);
  std::vector<int> bodies, joints;
  for (int i = 0; i <= n; ++i) joints.push_back(scene.JointIndex(i));
  for (int i = 1; i <= n; ++i) bodies.push_back(i);
  Series<Spatial> series(scene, bodies, joints);
  const GroundedLoop loop(series.Assembly(), scene.JointTo(1, joints[0]),
                          scene.JointTo(n, joints[n]));
  EXPECT_GE(series.rcond(), 1e-3);
  const RealVector eigenvalues = testing::SymmetricEigenvalues(loop.chi);
  const Real largest = eigenvalues[eigenvalues.size() - 1];
  ASSERT_EQ(eigenvalues.size(), 10);
  for (int i = 0; i < 3; ++i) EXPECT_LE(std::abs(eigenvalues[i]), 1e-14L * largest) << i;
  EXPECT_GE(eigenvalues[3], 1e-4L * largest);
}

}  // namespace loopbench::odca::paper::paper_test
