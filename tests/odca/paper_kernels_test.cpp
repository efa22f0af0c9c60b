// The kernels of short cuts against the paper's formulas as they are printed.
#include "odca/arm_links.h"
#include "odca/path_links.h"
#include "tests/odca/paper_series.h"

namespace loopbench::odca::paper::paper_kernels_test {

template <int n>
RealMatrix ToReal(const Symmetric<double, n>& A) {
  RealMatrix real(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) real(i, j) = real(j, i) = A(i, j);
  }
  return real;
}
template <int n>
RealMatrix Column(const double (&numbers)[n]) {
  RealMatrix column(n, 1);
  for (int i = 0; i < n; ++i) column(i, 0) = numbers[i];
  return column;
}

/// A body between two joints: its kernel alone and behind a joint that moves, and the rows on the D
/// of both handles.
template <int n>
struct Link {
  int body = 0, joint = 0, after = 0;
  RealMatrix on_1, on_2;
  TwoHandle<double, n> alone, behind;
};

/// Joins the bodies of a chain one after another (15-17), (26-30). `turn(k, assembly)` turns an
/// assembly into the axes of body k. Kernels take `gravity` from all accelerations. Axes of joint
/// sides are products of up to so many `rotations`, the chain has so many `bodies`.
template <class Space, int n>
void HoldChain(const Scene<Space>& scene, const std::vector<Link<n>>& links,
               const RealVector& gravity, const auto& turn, int rotations, int bodies,
               Tally& tally) {
  TwoHandle<double, n> all;
  TwoHandles printed;
  double rcond = 1.0;
  const auto difference = [&](const TwoHandle<double, n>& kernel, const TwoHandles& expected,
                              const RealMatrix& on_1, const RealMatrix& on_2) {
    RealMatrix z12(n, n);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) z12(i, j) = kernel.response.zeta12[i][j];
    }
    Deviation deviation;
    deviation.Note(ToReal(kernel.response.zeta11), on_1 * expected.z11 * on_1.transpose());
    deviation.Note(ToReal(kernel.response.zeta22), on_2 * expected.z22 * on_2.transpose());
    deviation.Note(z12, on_1 * expected.z12 * on_2.transpose());
    deviation.Note(Column(kernel.zeta13), on_1 * (expected.z13 - gravity));
    deviation.Note(Column(kernel.zeta23), on_2 * (expected.z23 - gravity));
    return deviation;
  };
  for (int k = 0; k < static_cast<int>(links.size()); ++k) {
    const Link<n>& at = links[k];
    const TwoHandles body = scene.Body(at.body, at.joint, at.after);
    tally.Hold("leaf", difference(at.alone, body, at.on_1, at.on_2), kMargin * rotations * kEps);
    if (k == 0) {
      all = at.alone;
      printed = body;
      continue;
    }
    InnerCut<double, n> cut;
    double slack = 0.0;
    turn(k, all);
    JoinSeries(all, at.behind.response, at.behind.zeta13, at.behind.zeta23, 0.0, cut, slack);
    EXPECT_EQ(slack, 0.0);
    const Cut joint = scene.JointTo(at.body, at.joint);
    const SeriesJoin join(printed, body, joint);
    rcond = std::min(rcond, Rcond(join.X));
    const double bound = kMargin * bodies * kEps / rcond;
    const double all_F[] = {0.3, -0.7, 0.2, 1.1, -0.4, 0.9, 0.1};
    double F1[n], F2[n], force[n];
    std::copy_n(all_F, n, F1);
    std::copy_n(all_F + 2, n, F2);
    ForceIn(cut, at.behind.response, F1, F2, force);
    const RealVector f =
        joint.D * MeasureNumbers(printed, body, joint, join, links[0].on_1.transpose() * Column(F1),
                                 at.on_2.transpose() * Column(F2));
    Deviation deviation;
    deviation.Note(Column(force), at.on_1 * f);
    tally.Hold("force", deviation, bound);
    printed = Assemble(printed, body, join);
    tally.Hold("Upsilon", difference(all, printed, links[0].on_1, at.on_2), bound);
    ++tally.assemblies;
  }
}

template <int n>
TwoHandle<double, n> Handles(const odca::Response<double, n>& response, const auto& free) {
  TwoHandle<double, n> all;
  all.response = response;
  std::copy_n(free.zeta13, n, all.zeta13);
  std::copy_n(free.zeta23, n, all.zeta23);
  return all;
}

/// Free bodies of chains of pins, by the kernels of handles.h and pins.h.
TEST(PaperTest, PinKernelsAreThePrintedFormulas) {
  constexpr int n = 7;
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Builder b("paper-pins", SpaceKind::kPlanar, seed);
    MechanismDescription chain = ChainOf(std::vector(n + 1, JointType::kRevolute), b);
    chain.forces.clear();
    const Scene<Planar> scene(chain, seed);
    const auto path =
        pins::MeasurePath(scene.mechanism(),
                          pins::FindPaths(n + 1, PlanJoints(scene.mechanism())).front())
            .value();
    RealMatrix forces(2, 3);  // in ground axes
    forces << 0, 1, 0, 0, 0, 1;
    std::vector<Link<2>> links;
    for (int k = 1; k < n; ++k) {
      const pins::PathBody& at = path.path[k];
      const pins::Link<double>& link = path.links[k];
      ASSERT_GT(link.mobility, 0.0) << "not pinned by a joint of the tree";
      const auto turned =
          pins::Turn(link, scene.kinematics().poses()[at.body].angle + path.axes[k]);
      const auto leaf =
          Handles(pins::ResponseOf(link, turned),
                  pins::FreeMotion<Unknowns::kAccelerations>(
                      link, turned, scene.kinematics().motions()[at.body].angular[0]));
      const int after = k + 1 < n ? path.path[k + 1].before : at.ground;
      links.push_back({at.body, at.before, after, forces, forces, leaf, leaf});
    }
    HoldChain(
        scene, links, RealVector::Zero(3), [](int, auto&) {}, 1, n, tally);
    ++tally.scenes;
  }
  tally.Print("plane, kernels for pins");
}

/// Rows on D of what is printed in ground axes, in those of a joint side, whose rotation is R.
RealMatrix OnHandle(const Rotation<Spatial, double>& R) {
  constexpr int kComponent[] = {0, 1, 3, 4, 5};
  RealMatrix all = RealMatrix::Zero(6, 6), rows(arms::kRows, 6);
  all.topLeftCorner(3, 3) = all.bottomRightCorner(3, 3) =
      R.transpose().eigen().cast<testing::Real>();
  for (int i = 0; i < arms::kRows; ++i) rows.row(i) = all.row(kComponent[i]);
  return rows;
}
/// A body of an arm and its place among others: rows on the D of both handles.
struct ArmPlace {
  arms::ArmBody constants;
  int body = 0, joint = 0, after = 0;
  RealMatrix on_1, on_2;
};

std::vector<ArmPlace> InnerBodies(const Scene<Spatial>& scene, const arms::Arm& arm) {
  const Mechanism<Spatial, double>& mechanism = scene.mechanism();
  std::vector<ArmPlace> places;
  for (const arms::ArmBody& constants : arm.bodies) {
    const TreeStep step = *std::ranges::find(
        mechanism.tree(), constants.u,
        [&](const TreeStep& one) { return mechanism.joints()[one.joint].u_offset; });
    const auto on_handle = [&](int body) {
      const Joint<Spatial, double>& joint = mechanism.joints()[step.joint];
      const auto& side = joint.from == body ? joint.X_PF : joint.X_QM;
      return OnHandle(scene.kinematics().poses()[body].R * side.R);
    };
    if (!places.empty()) {
      places.back().after = step.joint;
      places.back().on_2 = on_handle(step.parent);
    }
    places.push_back({constants, step.child, step.joint, 0, on_handle(step.child), {}});
  }
  places.pop_back();  // the last one's handle 2 is that of a cut joint
  return places;
}

/// Returns the kernel's handle of a single body; with `speed` it contains g of the joint at
/// handle 1.
arms::Free<double> FreeOf(const Scene<Spatial>& scene, const ArmPlace& at, double speed) {
  const Joint<Spatial, double>& joint = scene.mechanism().joints()[at.joint];
  const auto& side = joint.from == at.body ? joint.X_PF : joint.X_QM;
  const Rotation<Spatial, double> R = scene.kinematics().poses()[at.body].R * side.R;
  arms::Free<double> free;
  arms::FreeMotion<Unknowns::kAccelerations>(
      at.constants.link.shape, R.transpose() * scene.kinematics().motions()[at.body].angular, speed,
      free);
  return free;
}

/// Free bodies of chains of revolute joints in space, by the kernels of handles.h and revolutes.h.
TEST(PaperTest, RevoluteKernelsAreThePrintedFormulas) {
  constexpr int n = 9;
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Builder b("paper-arms", SpaceKind::kSpatial, seed);
    MechanismDescription chain = ChainOf(std::vector(n + 1, JointType::kRevolute), b);
    chain.forces.clear();
    const Scene<Spatial> scene(chain, seed);
    RealVector gravity = RealVector::Zero(6);
    for (int i = 0; i < 3; ++i) gravity[3 + i] = scene.mechanism().gravity()[i];
    for (const arms::Arm& arm : arms::FindArms(scene.mechanism()).arms) {
      const std::vector<ArmPlace> places = InnerBodies(scene, arm);
      std::vector<Link<arms::kRows>> links;
      for (const ArmPlace& at : places) {
        const auto& response = at.constants.link.response;
        const double speed = at.constants.sign * scene.speed(at.constants.u);
        links.push_back({at.body, at.joint, at.after, at.on_1, at.on_2,
                         Handles(response, FreeOf(scene, at, 0.0)),
                         Handles(response, FreeOf(scene, at, speed))});
      }
      const auto turn = [&](int k, TwoHandle<double, arms::kRows>& all) {
        const arms::ArmBody& body = places[k].constants;
        const double angle = body.sign * scene.coordinate(body.u);
        arms::TurnHandle(arms::Turn<double>{std::cos(angle), std::sin(angle)}, all);
      };
      HoldChain(scene, links, gravity, turn, n, n, tally);
    }
    ++tally.scenes;
  }
  tally.Print("space, kernels for revolute joints");
  EXPECT_GE(tally.assemblies, 5 * tally.scenes);
}

}  // namespace loopbench::odca::paper::paper_kernels_test
