#include <algorithm>
#include <utility>

#include "odca/arm_links.h"

namespace loopbench::odca::arms {

namespace {

using V3 = Linear<Spatial, double>;

/// X += C zeta C^T, rows of C being forces on the handle.
template <int n>
void AddResponse(const Symmetric<double, kAll>& zeta, const double (&C)[n][kAll],
                 Symmetric<double, n>& X) {
  for (int a = 0; a < n; ++a) {
    double response[kAll] = {};
    LOOPBENCH_UNROLL
    for (int i = 0; i < kAll; ++i) {
      LOOPBENCH_UNROLL
      for (int j = 0; j < kAll; ++j) response[i] += (j <= i ? zeta(i, j) : zeta(j, i)) * C[a][j];
    }
    for (int b = a; b < n; ++b) {
      double sum = X(b, a);
      LOOPBENCH_UNROLL
      for (int i = 0; i < kAll; ++i) sum += C[b][i] * response[i];
      X(b, a) = sum;
    }
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

/// Returns A_Q - A_P besides H udot, less its value without a force in the joint.
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
template <Sought kSought, int n>
double Closing::CloseRows(ClosingSide& P, ClosingSide& Q) const {
  Factors<double, n> X = {};
  Symmetric<double, n> X_alone = {};
  for (const auto& [side, way] : {std::pair(&P, &from_P_), std::pair(&Q, &from_Q_)}) {
    if (side->alone == nullptr) continue;
    double C[n][kAll];
    for (int a = 0; a < n; ++a) way->Back(joint_.D(a), C[a]);
    AddResponse(side->assembly.zeta22, C, X.L);
    AddResponse(*side->alone, C, X_alone);
  }
  double slack = 1.0, phi[n], trace = 0.0;
  Factor(X, slack);
  const Acceleration<Spatial, double> missing = Missing<kSought>(P, Q);
  for (int a = 0; a < n; ++a) phi[a] = joint_.D(a).dot(missing);
  X.Forward(phi);
  X.Backward(phi);
  auto force = Direction<Spatial, double>::Zero();
  for (int a = 0; a < n; ++a) force += joint_.D(a) * phi[a];  // (13)
  from_Q_.Back(force, Q.F2);
  from_P_.Back(-force, P.F2);
  for (int a = 0; a < n; ++a) {
    double column[n];
    for (int b = 0; b < n; ++b) column[b] = b < a ? X_alone(a, b) : X_alone(b, a);
    X.Forward(column);
    X.Backward(column);
    trace += column[a];
  }
  return Min(slack, 1.0 - limit_ * trace);
}

template <Sought kSought>
double Closing::Close(ClosingSide& P, ClosingSide& Q) const {
  switch (joint_.rows()) {
    case 1:
      return CloseRows<kSought, 1>(P, Q);
    case 2:
      return CloseRows<kSought, 2>(P, Q);
    case 3:
      return CloseRows<kSought, 3>(P, Q);
    case 4:
      return CloseRows<kSought, 4>(P, Q);
    case 5:
      return CloseRows<kSought, 5>(P, Q);
    default:
      return CloseRows<kSought, 6>(P, Q);
  }
}

template double Closing::Close<Sought::kAccelerations>(ClosingSide&, ClosingSide&) const;
template double Closing::Close<Sought::kSpeeds>(ClosingSide&, ClosingSide&) const;
template double Closing::Close<Sought::kPositions>(ClosingSide&, ClosingSide&) const;

}  // namespace loopbench::odca::arms
