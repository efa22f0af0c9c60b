// Small vectors against Eigen's, and which sums and products of velocities, accelerations and
// forces there are.
#include "mechanism/algebra/spatial_vector.h"

#include "mechanism/algebra/space.h"
#include "tests/contract/generators.h"
#include "tests/standard.h"

namespace loopbench::spatial_vector_test {

template <class A, class B>
concept Addable = requires(A a, B b) {
  a + b;
};
template <class A, class B>
concept Assignable = requires(A a, B b) {
  a = b;
};
template <class A, class B>
concept HaveDot = requires(A a, B b) {
  a.dot(b);
};

template <class Space>
class SpatialVectorTest : public ::testing::Test {
 protected:
  template <class Vector>
  Vector Random() {
    Vector vector;
    for (int i = 0; i < Space::kDim; ++i) vector[i] = random_.Uniform(-1.0, 1.0);
    return vector;
  }
  Block<Space, double> RandomBlock() {
    Block<Space, double> block;
    for (double& number : block.at) number = random_.Uniform(-1.0, 1.0);
    return block;
  }
  Linear<Space, double> RandomArm() { return Random<Velocity<Space, double>>().linear; }

  testing::Random random_{1};
};
using Spaces = ::testing::Types<Planar, Spatial>;
TYPED_TEST_SUITE(SpatialVectorTest, Spaces);

TYPED_TEST(SpatialVectorTest, WhatHasNoMeaningDoesNotCompile) {
  using V = Velocity<TypeParam, double>;
  using A = Acceleration<TypeParam, double>;
  using F = Wrench<TypeParam, double>;
  using D = Direction<TypeParam, double>;
  static_assert(Addable<V, V> && Addable<A, A> && Addable<F, F> && Addable<D, D>);
  static_assert(!Addable<V, A> && !Addable<V, F> && !Addable<A, F>);
  static_assert(!Addable<F, V> && !Addable<A, V> && !Addable<F, A>);
  static_assert(!Assignable<V, A> && !Assignable<A, F> && !Assignable<F, V>);
  static_assert(Addable<V, D> && Addable<A, D> && Addable<F, D>, "times a speed, a force");
  static_assert(Assignable<F, D> && !Assignable<D, F>);
  static_assert(HaveDot<F, V> && HaveDot<V, F> && HaveDot<F, A>, "power, and its rate");
  static_assert(!HaveDot<V, V> && !HaveDot<V, A> && !HaveDot<F, F>);
  static_assert(HaveDot<D, V> && HaveDot<D, A> && HaveDot<D, F> && HaveDot<V, D>);
}

/// A power does not depend on the point that both are taken at.
TYPED_TEST(SpatialVectorTest, ShiftsOfMotionsAndForcesAreTransposed) {
  for (int trial = 0; trial < 20; ++trial) {
    const auto V = this->template Random<Velocity<TypeParam, double>>();
    const auto F = this->template Random<Wrench<TypeParam, double>>();
    const auto r = this->RandomArm();
    // some 12 products of numbers of about one
    EXPECT_NEAR(F.dot(ShiftMotion(V, r)), ShiftForce(F, r).dot(V), 16 * kEps);
    EXPECT_LE((ShiftMotion<TypeParam, double>(ShiftMotion(V, r), -r) - V).norm(), 4 * kEps);
  }
}

TYPED_TEST(SpatialVectorTest, ProductsAreThoseOfEigen) {
  constexpr int kDim = TypeParam::kDim;
  using Matrix = Eigen::Matrix<double, kDim, kDim>;
  for (int trial = 0; trial < 20; ++trial) {
    const auto I = this->RandomBlock(), J = this->RandomBlock();
    const auto V = this->template Random<Velocity<TypeParam, double>>();
    const auto W = this->template Random<Velocity<TypeParam, double>>();
    const Eigen::Matrix<double, kDim, 1> Iv = I.eigen() * V.eigen();
    const auto momentum = Apply<Wrench<TypeParam, double>>(I, V);
    EXPECT_LE((momentum.eigen() - Iv).norm(), 2 * kDim * kEps);
    const Matrix product = I.eigen() * J.eigen();
    EXPECT_LE(((I * J).eigen() - product).norm(), 4 * kDim * kEps);
    EXPECT_EQ(I.transpose().eigen(), Matrix(I.eigen().transpose()));
    auto less = I;
    SubtractOuter(V, W, less);
    EXPECT_LE((less.eigen() - (I.eigen() - V.eigen() * W.eigen().transpose())).norm(), kDim * kEps);
  }
}

TYPED_TEST(SpatialVectorTest, NumbersAreGivenByRowsAndKeptByColumns) {
  const Small<double, 2, 3> matrix(1.0, 2.0, 3.0, 4.0, 5.0, 6.0);
  EXPECT_EQ(matrix(0, 1), 2.0);
  EXPECT_EQ(matrix(1, 0), 4.0);
  EXPECT_EQ(matrix[1], 4.0);
  EXPECT_EQ((Small<double, 2, 3>(matrix.eigen())(1, 2)), 6.0);
}

TEST(QuaternionTest, WhatHasNoLengthTurnsNothing) {
  const double zero[4] = {0.0, 0.0, 0.0, 0.0};
  EXPECT_EQ(FromQuaternion(zero).eigen(), Eigen::Matrix3d::Identity());
  EXPECT_EQ((Small<double, 3>::Zero().normalized().eigen()), Eigen::Vector3d::Zero());
}

/// From orientations of all four branches, the largest component of each kind.
TEST(QuaternionTest, OrientationsGoThereAndBack) {
  testing::Random random(2);
  for (int trial = 0; trial < 200; ++trial) {
    Eigen::Vector4d given = Eigen::Vector4d::NullaryExpr([&] { return random.Uniform(-1.0, 1.0); });
    given[trial % 4] *= 10.0;
    const Eigen::Quaterniond unit =
        Eigen::Quaterniond(given[0], given[1], given[2], given[3]).normalized();
    const Rotation<Spatial, double> R = FromQuaternion(given.data());
    EXPECT_LE((R.eigen() - unit.toRotationMatrix()).norm(), 16 * kEps);
    double q[4];
    ToQuaternion(R, q);
    const double sign = q[0] * unit.w() + q[1] * unit.x() + q[2] * unit.y() + q[3] * unit.z();
    EXPECT_NEAR(std::abs(sign), 1.0, 16 * kEps);
    const Pose<Spatial, double> X{R, Linear<Spatial, double>::Zero()};
    const Eigen::AngleAxisd turn(unit);
    EXPECT_NEAR(RotationVector(X).norm(), std::min(turn.angle(), 2 * M_PI - turn.angle()),
                64 * kEps);
  }
}

}  // namespace loopbench::spatial_vector_test
