// Joint kinds: motion maps and rates against derivatives of the transforms.
#include "mechanism/model/joint.h"

#include "tests/contract/oracle.h"
#include "tests/standard.h"

namespace loopbench::joint_test {

using testing::Jet;
using testing::JetPose;
using testing::Real;

constexpr double kParameter = 0.3;  // pitch [m/rad] or length [m]; for other kinds nothing

template <class Space>
std::vector<JointType> Types() {
  std::vector<JointType> types;
  for (int i = 0; i < std::ssize(AllJointTraits()); ++i) {
    const auto type = static_cast<JointType>(i);
    if (type == JointType::kRod) continue;  // it has no transform: tests of its own
    if (Space::kRot == 3 || TraitsOf(type).in_plane) types.push_back(type);
  }
  return types;
}

template <class Space>
using Matrix = Eigen::Matrix<double, Space::kDim, Space::kDim>;
template <class Space>
using Vector = Eigen::Matrix<double, Space::kDim, 1>;

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
Velocity<Space, double> MotionAlong(JointType type, const JointKind<Space, double>& kind,
                                    const VectorX<double>& q, const VectorX<double>& u) {
  VectorX<double> qdot(kind.num_q);
  kind.rates(q.data(), u.data(), qdot.data());
  std::vector<Jet> curve(kind.num_q + 1);
  for (int i = 0; i < kind.num_q; ++i) curve[i] = Jet(q[i], qdot[i]);
  const JetPose X = testing::Transform(type, Space::kRot == 3, curve.data(), kParameter);
  const auto skew = [&](int i, int j) {
    Real sum = 0;
    for (int k = 0; k < 3; ++k) sum += X.R(i, k).d * X.R(j, k).f;
    return static_cast<double>(sum);
  };
  Velocity<Space, double> V;
  for (int i = 0; i < Space::kLin; ++i) V.linear[i] = static_cast<double>(X.p[i].d);
  if constexpr (Space::kRot == 1) {
    V.angular[0] = skew(1, 0);
  } else {
    V.angular = {skew(2, 1), skew(0, 2), skew(1, 0)};
  }
  return V;
}

/// [H D] in F axes.
template <class Space>
Matrix<Space> BasisAt(const JointKind<Space, double>& kind, const Pose<Space, double>& X) {
  Basis<Space, double> basis;
  kind.basis(X, basis, kind.parameter);
  Matrix<Space> columns;
  for (int i = 0; i < Space::kDim; ++i) columns.col(i) = basis[i].eigen();
  return columns;
}
/// The same at q, of kinds with axes too.
template <class Space>
Matrix<Space> BasisAt(const JointKind<Space, double>& kind, const VectorX<double>& q) {
  Matrix<Space> basis = Matrix<Space>::Zero();
  for (int i = 0; i < Space::kDim; ++i) basis(kind.axes[i], i) = 1.0;
  if (kind.basis == nullptr) return basis;
  const auto X = PoseAt(kind, q.data());
  return BasisAt(kind, X);
}

template <class Space>
class JointTest : public ::testing::Test {};
using Spaces = ::testing::Types<Planar, Spatial>;
TYPED_TEST_SUITE(JointTest, Spaces);

TYPED_TEST(JointTest, KindsAreWhatTheTableOfTraitsSays) {
  constexpr bool kSpace = TypeParam::kRot == 3;
  const SpaceKind space = kSpace ? SpaceKind::kSpatial : SpaceKind::kPlanar;
  for (const JointType type : Types<TypeParam>()) {
    const auto& kind = KindOf<TypeParam, double>(type);
    const auto coordinates = ValueWords(type, space, false), speeds = ValueWords(type, space, true);
    const auto lengths = [](const auto& words) {
      return std::ranges::count_if(words, &ValueWord::is_length);
    };
    EXPECT_EQ(lengths(coordinates), lengths(speeds)) << ToString(type);
    EXPECT_EQ(std::ssize(coordinates), kind.num_q) << ToString(type);
    ASSERT_EQ(std::ssize(speeds), kind.num_u) << ToString(type);
    // a universal joint's directions turn with its first angle: they are no axes
    for (std::size_t i = 0; i < speeds.size() && kind.basis == nullptr; ++i) {
      EXPECT_EQ(speeds[i].is_length(), kind.axes[i] >= TypeParam::kRot) << ToString(type) << i;
    }
  }
}

TYPED_TEST(JointTest, TransformIsTheOracles) {
  for (JointType type : Types<TypeParam>()) {
    const auto kind = KindWith<TypeParam, double>(type, kParameter);
    for (int seed = 0; seed < 5; ++seed) {
      const VectorX<double> q = Coordinates(kind, seed);
      const auto X = PoseAt(kind, q.data());
      std::vector<Jet> jets(kind.num_q + 1);
      for (int i = 0; i < kind.num_q; ++i) jets[i] = Jet(q[i]);
      const JetPose Y = testing::Transform(type, TypeParam::kRot == 3, jets.data(), kParameter);
      for (int i = 0; i < TypeParam::kLin; ++i) {
        EXPECT_NEAR(X.p[i], static_cast<double>(Y.p[i].f), kEps);  // a product at most
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
    const auto kind = KindWith<TypeParam, double>(type, kParameter);
    for (int seed = 0; seed < 5; ++seed) {
      const VectorX<double> q = Coordinates(kind, seed);
      for (int i = 0; i < kind.num_u; ++i) {
        const Vector<TypeParam> V =
            MotionAlong(type, kind, q, VectorX<double>::Unit(kind.num_u, i)).eigen();
        const Vector<TypeParam> H = BasisAt(kind, q).col(i);
        EXPECT_LE((V - H).template lpNorm<Eigen::Infinity>(), 8 * kEps) << ToString(type);
      }
    }
  }
}

/// In kinds with constant axes, only tilts need other directions off the constraint.
TYPED_TEST(JointTest, ExactDirectionsAreThoseOfTilts) {
  for (JointType type : Types<TypeParam>()) {
    const auto& kind = KindOf<TypeParam, double>(type);
    if (kind.basis != nullptr) continue;
    const auto is_turn = [](int axis) { return axis < TypeParam::kRot; };
    const auto turns = std::count_if(kind.axes.begin(), kind.axes.begin() + kind.num_u, is_turn);
    const bool tilts = TypeParam::kRot == 3 && turns == 1;
    EXPECT_EQ(kind.exact_basis != nullptr, tilts) << ToString(type);
    EXPECT_EQ(kind.exact_bias != nullptr, tilts) << ToString(type);
    EXPECT_EQ(kind.exact_basis_rate != nullptr, tilts) << ToString(type);
    EXPECT_EQ(kind.has_quaternion(), TypeParam::kRot == 3 && turns == 3) << ToString(type);
  }
}

TYPED_TEST(JointTest, FreeAndConstrainedAxesShareTheSpaceBetweenThem) {
  for (JointType type : Types<TypeParam>()) {
    const auto kind = KindWith<TypeParam, double>(type, kParameter);
    std::vector<int> seen(TypeParam::kDim, 0);
    for (int axis : kind.axes) ++seen[axis];
    EXPECT_EQ(seen, std::vector<int>(TypeParam::kDim, 1)) << "D^T H = 0 and both are complete";
  }
}

TYPED_TEST(JointTest, BasesAreOrthogonalAndTheirRateIsTheBias) {
  using Space = TypeParam;
  for (JointType type : Types<Space>()) {
    const auto kind = KindWith<Space, double>(type, kParameter);
    for (int seed = 0; seed < 5; ++seed) {
      const VectorX<double> q = Coordinates(kind, seed);
      const Matrix<Space> basis = BasisAt(kind, q);
      Matrix<Space> product = basis.transpose() * basis;
      if (kind.num_u > 0) product.col(0) *= kind.inverse_H_squared;
      EXPECT_LE((product - Matrix<Space>::Identity()).norm(), 16 * kEps) << ToString(type);
      if (kind.bias == nullptr) continue;
      VectorX<double> u(kind.num_u), qdot(kind.num_q);
      for (int i = 0; i < kind.num_u; ++i) u[i] = std::cos(2.3 * i + seed);
      kind.rates(q.data(), u.data(), qdot.data());
      const double step = 1e-5;  // central: truncation 1e-10, round-off eps / step = 2e-11
      const auto motion = [&](double t) -> Vector<Space> {
        return BasisAt<Space>(kind, VectorX<double>(q + t * qdot)).leftCols(kind.num_u) * u;
      };
      const Vector<Space> rate = (motion(step) - motion(-step)) / (2 * step);
      const auto X = PoseAt(kind, q.data());
      const auto bias = kind.bias(X, Velocity<Space, double>(motion(0.0)));
      EXPECT_LE((rate - bias.eigen()).norm(), 1e-9) << ToString(type);
    }
  }
}

TYPED_TEST(JointTest, AdmissiblePosesHaveNoMismatchAndGiveTheirCoordinatesBack) {
  for (JointType type : Types<TypeParam>()) {
    const auto kind = KindWith<TypeParam, double>(type, kParameter);
    for (int seed = 0; seed < 5; ++seed) {
      const VectorX<double> q = Coordinates(kind, seed);
      const auto X = PoseAt(kind, q.data());
      EXPECT_LE((Mismatch(kind, X).eigen().template lpNorm<Eigen::Infinity>()), 32 * kEps);
      VectorX<double> measured(kind.num_q);
      kind.coordinates(X, measured.data(), kind.parameter);
      const auto again = PoseAt(kind, measured.data());
      EXPECT_LE((again.R - X.R).eigen().template lpNorm<Eigen::Infinity>(), 32 * kEps);
      EXPECT_LE((again.p - X.p).norm(), 4 * kEps) << "an angle of a helix: one rounding";
    }
  }
}

TYPED_TEST(JointTest, MismatchAlongConstrainedAxesIsMeasured) {
  const auto& kind = KindOf<TypeParam, double>(JointType::kRevolute);
  const double q = 0.7;
  auto X = PoseAt(kind, &q);
  X.p[1] += 1e-3;
  const Velocity<TypeParam, double> mismatch = Mismatch(kind, X);
  EXPECT_NEAR(mismatch[TypeParam::kRot + 1], 1e-3, 8 * kEps);
  EXPECT_NEAR(mismatch.norm(), 1e-3, 32 * kEps);
}

/// Distance, direction and acceleration term of a rod along a curve p(t) in F.
TYPED_TEST(JointTest, RodMeasuresADistance) {
  using Space = TypeParam;
  const auto kind = KindWith<Space, double>(JointType::kRod, 2.0);
  Linear<Space, double> p, v;
  for (int i = 0; i < Space::kLin; ++i) p[i] = 1.0 + 0.5 * i, v[i] = 0.7 - i;
  Pose<Space, double> X;
  X.p = p;
  const Velocity<Space, double> mismatch = Mismatch(kind, X);
  EXPECT_NEAR(mismatch.norm(), std::abs(p.norm() - 2.0), 4 * kEps);
  const Matrix<Space> basis = BasisAt(kind, X), product = basis.transpose() * basis;
  EXPECT_LE((product - Matrix<Space>::Identity()).norm(), 16 * kEps);
  const Direction<Space, double> D(basis.col(Space::kDim - 1));
  EXPECT_NEAR(D.dot(mismatch), p.norm() - 2.0, 4 * kEps);
  const Velocity<Space, double> V(Angular<Space, double>::Zero(), v);
  const Acceleration<Space, double> bias = kind.bias(X, V);
  const double step = 1e-4;  // second difference: truncation 1e-8, round-off eps / step^2 = 2e-8
  const auto distance = [&](double t) { return (p + t * v).norm(); };
  EXPECT_NEAR(D.dot(V), (distance(step) - distance(-step)) / (2 * step), 1e-8);
  EXPECT_NEAR(-D.dot(bias), (distance(step) - 2 * distance(0.0) + distance(-step)) / (step * step),
              1e-6);
}

/// Angles beyond a turn are known from the shift.
TEST(HelixTest, TurnsAreCounted) {
  const auto kind = KindWith<Spatial, double>(JointType::kHelical, 0.01);
  for (double angle : {-20.0, -3.2, 0.1, 3.2, 7.0, 100.0}) {
    const auto X = PoseAt(kind, &angle);
    double measured = 0.0;
    kind.coordinates(X, &measured, kind.parameter);
    EXPECT_NEAR(measured, angle, 8 * kEps * (1 + std::abs(angle)));
  }
}

}  // namespace loopbench::joint_test
