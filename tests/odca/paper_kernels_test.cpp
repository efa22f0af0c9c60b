// The kernels of short cuts against the paper's formulas as they are printed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "odca/arm_links.h"
#include "odca/path_links.h"
#include "tests/odca/paper_series.h"

namespace loopbench::odca::paper {
namespace paper_kernels_test {

/// Returns the numbers of a kernel, which are projected on the D of planar revolute joints.
RealMatrix ToReal(const pins::Matrix2<double>& A) {
  RealMatrix real(2, 2);
  real << A.xx, A.xy, A.yx, A.yy;
  return real;
}
RealMatrix ToReal(const pins::Symmetric2<double>& A) {
  return ToReal(pins::Matrix2<double>{A.xx, A.xy, A.xy, A.yy});
}
RealMatrix ToReal(const pins::Vector2<double>& a) {
  RealMatrix real(2, 1);
  real << a.x, a.y;
  return real;
}
/// The largest difference between a two-handle kernel's numbers and those of printed equations.
Deviation Difference(const pins::TwoHandle<double>& kernel, const TwoHandles& printed) {
  Deviation deviation;
  deviation.Note(ToReal(kernel.zeta11), printed.z11.bottomRightCorner(2, 2));
  deviation.Note(ToReal(kernel.zeta22), printed.z22.bottomRightCorner(2, 2));
  deviation.Note(ToReal(kernel.zeta12), printed.z12.bottomRightCorner(2, 2));
  deviation.Note(ToReal(kernel.zeta13), printed.z13.tail(2));
  deviation.Note(ToReal(kernel.zeta23), printed.z23.tail(2));
  return deviation;
}

/// Free bodies of chains of pins, by the kernels of two_handle.h: leaves (1-4), and joins of one
/// after another (15-17), (26-30).
TEST(PaperTest, TwoHandleKernelsAreThePrintedFormulas) {
  constexpr int n = 7;
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Builder b("paper-pins", SpaceKind::kPlanar, seed);
    MechanismDescription chain = ChainOf(std::vector(n + 1, JointType::kRevolute), b);
    chain.forces.clear();
    const Scene<Planar> scene(chain, seed);
    const auto links =
        pins::MeasurePath(scene.mechanism(),
                          pins::FindPaths(n + 1, PlanJoints(scene.mechanism())).front())
            .value();
    pins::TwoHandle<double> all;
    TwoHandles printed;
    double rcond = 1.0;
    for (int k = 1; k < n; ++k) {
      const pins::PathBody& at = links.path[k];
      const pins::Link<double>& link = links.links[k];
      ASSERT_GT(link.mobility, 0.0) << "not pinned by a joint of the tree";
      const double angle = scene.kinematics().poses()[at.body].angle + links.axes[k];
      const double speed = scene.kinematics().motions()[at.body].angular[0];
      const auto leaf = pins::Leaf<Unknowns::kAccelerations>(link, pins::Turn(link, angle), speed);
      const int after = k + 1 < n ? links.path[k + 1].before : at.ground;
      const TwoHandles body = scene.Body(at.body, at.before, after);
      tally.Hold("leaf", Difference(leaf, body), kMargin * kEps);
      if (k == 1) {
        all = leaf;
        printed = body;
        continue;
      }
      pins::Cut<double> cut;
      double slack = 0.0;
      const auto joined = pins::Join(all, leaf, 0.0, cut, slack);
      const Cut joint = scene.JointTo(at.body, at.before);
      const SeriesJoin join(printed, body, joint);
      rcond = std::min(rcond, Rcond(join.X));
      const double bound = kMargin * n * kEps / rcond;
      const pins::Vector2<double> F1 = {0.3, -0.7}, F2 = {1.1, 0.4};
      RealVector F_k = RealVector::Zero(3), F_k1 = F_k;
      F_k.tail(2) = ToReal(F1);
      F_k1.tail(2) = ToReal(F2);
      Deviation force;
      force.Note(ToReal(pins::ForceIn(cut, F1, F2)),
                 MeasureNumbers(printed, body, joint, join, F_k, F_k1));
      tally.Hold("force", force, bound);
      all = joined;
      printed = Assemble(printed, body, join);
      tally.Hold("Upsilon", Difference(all, printed), bound);
      ++tally.assemblies;
    }
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
RealMatrix ToReal(const arms::Symmetric<double, arms::kRows>& A) {
  RealMatrix real(arms::kRows, arms::kRows);
  for (int i = 0; i < arms::kRows; ++i) {
    for (int j = 0; j <= i; ++j) real(i, j) = real(j, i) = A(i, j);
  }
  return real;
}
RealMatrix Column(const double* numbers) {
  RealMatrix column(arms::kRows, 1);
  for (int i = 0; i < arms::kRows; ++i) column(i, 0) = numbers[i];
  return column;
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

/// Kernels take gravity from all accelerations.
Deviation Difference(const arms::Piece<double>& kernel, const TwoHandles& printed,
                     const RealMatrix& on_1, const RealMatrix& on_2, const RealVector& gravity) {
  RealMatrix z12(arms::kRows, arms::kRows);
  for (int i = 0; i < arms::kRows; ++i) {
    for (int j = 0; j < arms::kRows; ++j) z12(i, j) = kernel.response.zeta12[i][j];
  }
  Deviation deviation;
  deviation.Note(ToReal(kernel.response.zeta11), on_1 * printed.z11 * on_1.transpose());
  deviation.Note(ToReal(kernel.response.zeta22), on_2 * printed.z22 * on_2.transpose());
  deviation.Note(z12, on_1 * printed.z12 * on_2.transpose());
  deviation.Note(Column(kernel.zeta13), on_1 * (printed.z13 - gravity));
  deviation.Note(Column(kernel.zeta23), on_2 * (printed.z23 - gravity));
  return deviation;
}

/// The inner bodies of an arm joined one after another.
void HoldArm(const Scene<Spatial>& scene, const arms::Arm& arm, int n, Tally& tally) {
  RealVector gravity = RealVector::Zero(6);
  for (int i = 0; i < 3; ++i) gravity[3 + i] = scene.mechanism().gravity()[i];
  arms::Piece<double> piece;
  TwoHandles printed;
  RealMatrix on_first;
  double rcond = 1.0;
  for (const ArmPlace& at : InnerBodies(scene, arm)) {
    const arms::Link<double>& link = at.constants.link;
    const arms::Free<double> alone = FreeOf(scene, at, 0.0);
    arms::Piece<double> leaf;
    leaf.response = link.response;
    std::copy_n(alone.zeta13, arms::kRows, leaf.zeta13);
    std::copy_n(alone.zeta23, arms::kRows, leaf.zeta23);
    const TwoHandles body = scene.Body(at.body, at.joint, at.after);
    // axes of joint sides are products of up to n rotations
    tally.Hold("leaf", Difference(leaf, body, at.on_1, at.on_2, gravity), kMargin * n * kEps);
    if (on_first.size() == 0) {
      piece = leaf;
      printed = body;
      on_first = at.on_1;
      continue;
    }
    const double sign = at.constants.sign, angle = sign * scene.coordinate(at.constants.u);
    const arms::Free<double> free = FreeOf(scene, at, sign * scene.speed(at.constants.u));
    arms::Cut<double> cut;
    double slack = 0.0;
    Join(piece, arms::Turn<double>{std::cos(angle), std::sin(angle)}, link.response, free, cut,
         slack);
    EXPECT_EQ(slack, 0.0);
    const Cut joint = scene.JointTo(at.body, at.joint);
    const SeriesJoin join(printed, body, joint);
    rcond = std::min(rcond, Rcond(join.X));
    const double bound = kMargin * n * kEps / rcond;
    const double F1[] = {0.3, -0.7, 0.2, 1.1, -0.4}, F2[] = {1.1, 0.4, -0.9, 0.1, 0.6};
    double force[arms::kRows];
    ForceIn(cut, link.response.zeta12, F1, F2, force);
    const RealVector f =
        joint.D * MeasureNumbers(printed, body, joint, join, on_first.transpose() * Column(F1),
                                 at.on_2.transpose() * Column(F2));
    Deviation deviation;
    deviation.Note(Column(force), at.on_1 * f);
    tally.Hold("force", deviation, bound);
    printed = Assemble(printed, body, join);
    tally.Hold("Upsilon", Difference(piece, printed, on_first, at.on_2, gravity), bound);
    ++tally.assemblies;
  }
}

/// Free bodies of chains of revolute joints in space, by the kernels of revolute_handles.h: leaves
/// (1-4), and joins of one after another (15-17), (26-30).
TEST(PaperTest, RevoluteKernelsAreThePrintedFormulas) {
  constexpr int n = 9;
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Builder b("paper-arms", SpaceKind::kSpatial, seed);
    MechanismDescription chain = ChainOf(std::vector(n + 1, JointType::kRevolute), b);
    chain.forces.clear();
    const Scene<Spatial> scene(chain, seed);
    for (const arms::Arm& arm : arms::FindArms(scene.mechanism()).arms) {
      HoldArm(scene, arm, n, tally);
    }
    ++tally.scenes;
  }
  tally.Print("space, kernels for revolute joints");
  EXPECT_GE(tally.assemblies, 5 * tally.scenes);
}

}  // namespace paper_kernels_test
}  // namespace loopbench::odca::paper
