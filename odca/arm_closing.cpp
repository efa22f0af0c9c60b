#include "odca/arm_closing.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>
#include <utility>

namespace loopbench::odca::arms {

namespace {

using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kAll, kAll>;
using Column = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kAll, 1>;
using V3 = Linear<Spatial, double>;

/// X += C zeta C^T, rows of C being `count` forces on the handle. The lower triangle.
void AddResponse(const Symmetric<double, kAll>& zeta, const double (*C)[kAll], int count,
                 Square& X) {
  for (int a = 0; a < count; ++a) {
    double response[kAll] = {};
    for (int i = 0; i < kAll; ++i) {
      for (int j = 0; j <= i; ++j) {
        response[i] += zeta(i, j) * C[a][j];
        if (j < i) response[j] += zeta(i, j) * C[a][i];
      }
    }
    for (int b = a; b < count; ++b) X(b, a) += std::inner_product(C[b], C[b] + kAll, response, 0.0);
  }
}

}  // namespace

template <class Kind>
SpatialVector<Spatial, double, Kind> Closing::Way::Of(const double* rows) const {
  const SpatialVector<Spatial, double, Kind> motion(V3(rows[0], rows[1], rows[5]),
                                                    V3(rows[2], rows[3], rows[4]));
  return ShiftMotion<Spatial, double>(Rotate<Spatial, double>(R, motion), e);
}

void Closing::Way::Back(const Wrench<Spatial, double>& F, double* rows) const {
  const auto on_side = Rotate<Spatial, double>(R.transpose(), ShiftForce<Spatial, double>(F, e));
  constexpr int kComponent[kAll] = {0, 1, 3, 4, 5, 2};
  for (int i = 0; i < kAll; ++i) rows[i] = on_side[kComponent[i]];
}

void Closing::Place(const ClosingSide& P, const ClosingSide& Q, Correction<double>* largest) {
  const Pose<Spatial, double> X_FM = Compose(Inverse(P.pose), Q.pose);
  from_P_ = {Rotation<Spatial, double>::Identity(), X_FM.p};
  from_Q_ = {X_FM.R, V3::Zero()};
  V_P_ = ShiftMotion<Spatial, double>(P.V, X_FM.p);
  V_rel_ = Rotate<Spatial, double>(X_FM.R, Q.V) - V_P_;
  if (largest == nullptr) return;
  mismatch_ = Mismatch(joint_.kind, X_FM);
  auto constrained = Direction<Spatial, double>::Zero();
  for (int i = 0; i < joint_.rows(); ++i) {
    constrained += joint_.D(i) * joint_.D(i).dot(mismatch_);
  }
  largest->rotation = std::max(largest->rotation, constrained.angular.norm());
  largest->shift = std::max(largest->shift, constrained.linear.norm());
}

/// What A_Q - A_P must be beside H udot, less what it is without a force in the joint.
template <Sought kSought>
Acceleration<Spatial, double> Closing::Missing(const ClosingSide& P, const ClosingSide& Q) const {
  if constexpr (kSought == Sought::kAccelerations) {
    const V3& w = V_P_.angular;
    const Acceleration<Spatial, double> g(w.cross(V_rel_.angular), 2.0 * w.cross(V_rel_.linear));
    auto A_P = from_P_.Of<AccelerationKind>(P.assembly.zeta23);
    A_P.linear += w.cross(w.cross(from_P_.e));
    return g + A_P - from_Q_.Of<AccelerationKind>(Q.assembly.zeta23);  // (7)
  } else {
    const auto& V = kSought == Sought::kSpeeds ? V_rel_ : mismatch_;
    return {-V.angular, -V.linear};
  }
}

/// X = D^T (S zeta S^T of both) D as (16), or one of them at Ground (33, 34). The least eigenvalue
/// of X over X_alone is at least 1 / tr(X^-1 X_alone).
template <Sought kSought>
double Closing::Close(ClosingSide& P, ClosingSide& Q) const {
  const int n = joint_.rows();
  Square X = Square::Zero(n, n), X_alone = X;
  for (const auto& [side, way] : {std::pair(&P, &from_P_), std::pair(&Q, &from_Q_)}) {
    if (side->alone == nullptr) continue;
    double C[kAll][kAll];
    for (int a = 0; a < n; ++a) way->Back(joint_.D(a), C[a]);
    AddResponse(side->assembly.zeta22, C, n, X);
    AddResponse(*side->alone, C, n, X_alone);
  }
  const Acceleration<Spatial, double> missing = Missing<kSought>(P, Q);
  Column phi(n);
  for (int a = 0; a < n; ++a) phi[a] = joint_.D(a).dot(missing);
  const Eigen::LLT<Square> factors(X);
  if (factors.info() != Eigen::Success) return -1.0;
  factors.solveInPlace(phi);
  auto force = Direction<Spatial, double>::Zero();
  for (int a = 0; a < n; ++a) force += joint_.D(a) * phi[a];  // (13)
  from_Q_.Back(force, Q.F2);
  from_P_.Back(-force, P.F2);
  const Square all = X_alone.template selfadjointView<Eigen::Lower>();
  return 1.0 - limit_ * factors.solve(all).trace();
}

template double Closing::Close<Sought::kAccelerations>(ClosingSide&, ClosingSide&) const;
template double Closing::Close<Sought::kSpeeds>(ClosingSide&, ClosingSide&) const;
template double Closing::Close<Sought::kPositions>(ClosingSide&, ClosingSide&) const;

}  // namespace loopbench::odca::arms
