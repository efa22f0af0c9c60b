// Joint kinds: motion maps and rates against derivatives of the transforms.
#include "mechanism/joint.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/contract/oracle.h"

namespace loopbench {
namespace {

using testing::Jet;
using testing::JetPose;
using testing::Real;

constexpr double kEps = std::numeric_limits<double>::epsilon();

template <class Space>
std::vector<JointType> Types() {
  std::vector<JointType> types;
  for (int i = 0; i < kNumJointTypes; ++i) {
    const auto type = static_cast<JointType>(i);
    if (Space::kRot == 3 || ExistsInPlane(type)) types.push_back(type);
  }
  return types;
}

/// Coordinates of a kind; angles beyond half a turn are the mechanism's business, not the kind's.
template <class Space>
VectorX<double> Coordinates(const JointKind<Space, double>& kind, int seed) {
  VectorX<double> q(kind.num_q);
  for (int i = 0; i < kind.num_q; ++i) q[i] = std::sin(1.7 * (i + 1) + 0.9 * seed);
  if (kind.has_quaternion()) q.head<4>().normalize();
  return q;
}

/// [w; v] of M in F along the curve q + t N u, by differentiating the oracle's own transform.
template <class Space>
Motion<Space, double> MotionAlong(JointType type, const JointKind<Space, double>& kind,
                                  const VectorX<double>& q, const VectorX<double>& u) {
  VectorX<double> qdot(kind.num_q);
  kind.rates(q.data(), u.data(), qdot.data());
  std::vector<Jet> curve(kind.num_q + 1);
  for (int i = 0; i < kind.num_q; ++i) curve[i] = Jet(q[i], qdot[i]);
  const JetPose X = testing::Transform(type, Space::kRot == 3, curve.data());
  const auto skew = [&](int i, int j) {
    Real sum = 0;
    for (int k = 0; k < 3; ++k) sum += X.R(i, k).d * X.R(j, k).f;
    return static_cast<double>(sum);
  };
  Motion<Space, double> V;
  if constexpr (Space::kRot == 1) {
    V << skew(1, 0), static_cast<double>(X.p[0].d), static_cast<double>(X.p[1].d);
  } else {
    V << skew(2, 1), skew(0, 2), skew(1, 0), static_cast<double>(X.p[0].d),
        static_cast<double>(X.p[1].d), static_cast<double>(X.p[2].d);
  }
  return V;
}

/// [H D] in F axes at q.
template <class Space>
Block<Space, double> Basis(const JointKind<Space, double>& kind, const VectorX<double>& q) {
  Block<Space, double> basis = Block<Space, double>::Zero();
  for (int i = 0; i < Space::kDim; ++i) basis(kind.axes[i], i) = 1.0;
  if (kind.basis == nullptr) return basis;
  Pose<Space, double> X;
  kind.transform(q.data(), X);
  kind.basis(X, basis);
  return basis;
}

template <class Space>
class JointTest : public ::testing::Test {};
using Spaces = ::testing::Types<Planar, Spatial>;
TYPED_TEST_SUITE(JointTest, Spaces);

TYPED_TEST(JointTest, TransformIsTheOracles) {
  for (JointType type : Types<TypeParam>()) {
    const auto& kind = KindOf<TypeParam, double>(type);
    for (int seed = 0; seed < 5; ++seed) {
      const VectorX<double> q = Coordinates(kind, seed);
      Pose<TypeParam, double> X;
      kind.transform(q.data(), X);
      std::vector<Jet> jets(kind.num_q + 1);
      for (int i = 0; i < kind.num_q; ++i) jets[i] = Jet(q[i]);
      const JetPose Y = testing::Transform(type, TypeParam::kRot == 3, jets.data());
      for (int i = 0; i < TypeParam::kLin; ++i) {
        EXPECT_EQ(X.p[i], static_cast<double>(Y.p[i].f));
        // normalising a quaternion and products of its components: a few roundings
        for (int j = 0; j < TypeParam::kLin; ++j) {
          EXPECT_NEAR(X.R(i, j), static_cast<double>(Y.R(i, j).f), 8 * kEps) << ToString(type);
        }
      }
    }
  }
}

TYPED_TEST(JointTest, MotionMapAndRatesAreTheDerivativeOfTheTransform) {
  for (JointType type : Types<TypeParam>()) {
    const auto& kind = KindOf<TypeParam, double>(type);
    for (int seed = 0; seed < 5; ++seed) {
      const VectorX<double> q = Coordinates(kind, seed);
      for (int i = 0; i < kind.num_u; ++i) {
        const Motion<TypeParam, double> V =
            MotionAlong(type, kind, q, VectorX<double>::Unit(kind.num_u, i));
        const Motion<TypeParam, double> H = Basis(kind, q).col(i);
        EXPECT_LE((V - H).template lpNorm<Eigen::Infinity>(), 8 * kEps) << ToString(type);
      }
    }
  }
}

TYPED_TEST(JointTest, FreeAndConstrainedAxesShareTheSpaceBetweenThem) {
  for (JointType type : Types<TypeParam>()) {
    const auto& kind = KindOf<TypeParam, double>(type);
    std::vector<int> seen(TypeParam::kDim, 0);
    for (int axis : kind.axes) ++seen[axis];
    EXPECT_EQ(seen, std::vector<int>(TypeParam::kDim, 1)) << "D^T H = 0 and both are complete";
  }
}

TYPED_TEST(JointTest, BasesAreOrthogonalAndTheirRateIsTheBias) {
  using Space = TypeParam;
  for (JointType type : Types<Space>()) {
    const auto& kind = KindOf<Space, double>(type);
    for (int seed = 0; seed < 5; ++seed) {
      const VectorX<double> q = Coordinates(kind, seed);
      const Block<Space, double> basis = Basis(kind, q);
      const Block<Space, double> product = basis.transpose() * basis;
      EXPECT_LE((product - Block<Space, double>::Identity()).norm(), 16 * kEps) << ToString(type);
      ASSERT_EQ(kind.basis == nullptr, kind.bias == nullptr);
      if (kind.basis == nullptr) continue;
      VectorX<double> u(kind.num_u), qdot(kind.num_q);
      for (int i = 0; i < kind.num_u; ++i) u[i] = std::cos(2.3 * i + seed);
      kind.rates(q.data(), u.data(), qdot.data());
      const double step = 1e-5;  // central: truncation 1e-10, round-off eps / step = 2e-11
      const auto motion = [&](double t) -> Motion<Space, double> {
        return Basis(kind, q + t * qdot).leftCols(kind.num_u) * u;
      };
      const Motion<Space, double> rate = (motion(step) - motion(-step)) / (2 * step);
      Pose<Space, double> X;
      kind.transform(q.data(), X);
      Motion<Space, double> bias;
      kind.bias(X, motion(0.0), bias);
      EXPECT_LE((rate - bias).norm(), 1e-9) << ToString(type);
    }
  }
}

TYPED_TEST(JointTest, AdmissiblePosesHaveNoMismatchAndGiveTheirCoordinatesBack) {
  for (JointType type : Types<TypeParam>()) {
    const auto& kind = KindOf<TypeParam, double>(type);
    for (int seed = 0; seed < 5; ++seed) {
      const VectorX<double> q = Coordinates(kind, seed);
      Pose<TypeParam, double> X, again;
      kind.transform(q.data(), X);
      EXPECT_LE((Mismatch(kind, X).template lpNorm<Eigen::Infinity>()), 32 * kEps);
      VectorX<double> measured(kind.num_q);
      kind.coordinates(X, measured.data());
      kind.transform(measured.data(), again);
      EXPECT_LE((again.R - X.R).template lpNorm<Eigen::Infinity>(), 32 * kEps);
      EXPECT_EQ(again.p, X.p);
    }
  }
}

TYPED_TEST(JointTest, MismatchAlongConstrainedAxesIsMeasured) {
  const auto& kind = KindOf<TypeParam, double>(JointType::kRevolute);
  Pose<TypeParam, double> X;
  const double q = 0.7;
  kind.transform(&q, X);
  X.p[1] += 1e-3;
  const Motion<TypeParam, double> mismatch = Mismatch(kind, X);
  EXPECT_NEAR(mismatch[TypeParam::kRot + 1], 1e-3, 8 * kEps);
  EXPECT_NEAR(mismatch.norm(), 1e-3, 32 * kEps);
}

}  // namespace
}  // namespace loopbench
