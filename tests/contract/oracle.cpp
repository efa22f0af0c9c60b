#include "tests/contract/oracle.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>

#include "tests/contract/oracle_parts.h"

namespace loopbench::testing {

Real33 Oracle::InertiaInGround(int body, const JetPose& pose) const {
  Real33 I = description_.bodies[body].inertia.cast<Real>();
  if (!layout_.spatial) {
    // moments out of the plane are the plane's own business
    I = Real33(Real3(1, 1, I(2, 2)).asDiagonal());
  }
  const Real33 R = ValueOf(pose.R, &Jet::f);
  return R * I * R.transpose();
}

Jet Oracle::Coordinate(int index, const std::vector<JetPose>& poses) const {
  const JetPose X_FM = JointPose(index, poses);
  if (description_.joints[index].type == JointType::kPrismatic) return X_FM.p[0];
  return Angle(X_FM.R(0, 0), X_FM.R(1, 0));
}

Equations Oracle::Form(const RealVector& q, const RealVector& u) {
  const int bodies = static_cast<int>(description_.bodies.size());
  poses_ = PosesAlong(Curve(q, u, true));
  const std::vector<Jet> along = Closures(poses_, true);
  const int rows = static_cast<int>(along.size());
  Equations e;
  e.gamma.resize(rows);
  for (int r = 0; r < rows; ++r) e.gamma[r] = -along[r].dd;
  e.J.resize(rows, layout_.num_u);
  G_.resize(6 * bodies, layout_.num_u);
  for (int i = 0; i < layout_.num_u; ++i) {
    const std::vector<JetPose> moved =
        PosesAlong(Curve(q, RealVector::Unit(layout_.num_u, i), false));
    for (int b = 0; b < bodies; ++b) G_.col(i).segment<6>(6 * b) = MotionOf(moved[b], &Jet::d);
    const std::vector<Jet> c = Closures(moved, false);
    for (int r = 0; r < rows; ++r) e.J(r, i) = c[r].d;
  }
  const std::vector<Real6> applied = Applied(poses_);
  bias_.assign(bodies, Real6::Zero());
  needed_.assign(bodies, Real6::Zero());
  e.M.setZero(layout_.num_u, layout_.num_u);
  e.h.setZero(layout_.num_u);
  for (int b = 1; b < bodies; ++b) {
    const Real33 I = InertiaInGround(b, poses_[b]);
    const Real m = description_.bodies[b].mass;
    const Real3 w = MotionOf(poses_[b], &Jet::d).head<3>();
    bias_[b] = MotionOf(poses_[b], &Jet::dd);
    needed_[b] << I * bias_[b].head<3>() + w.cross(I * w), m * bias_[b].tail<3>();
    needed_[b] -= applied[b];
    const auto G = G_.middleRows<6>(6 * b);
    RealMatrix IG(6, layout_.num_u);
    IG << I * G.topRows<3>(), m * G.bottomRows<3>();
    e.M.noalias() += G.transpose() * IG;
    e.h.noalias() += G.transpose() * needed_[b];
  }
  return e;
}

Answer Oracle::Solve(const RealVector& q, const RealVector& u) {
  const Equations e = Form(q, u);
  const int n = layout_.num_u, m = static_cast<int>(e.J.rows());
  Answer answer;
  // rows in units of what their joint's own bodies answer; redundant ones may be zero
  const RealMatrix row_scale = JointScales();
  const RealMatrix J = row_scale * e.J;
  Rank(e.M, J, answer);
  const RealVector scale = e.M.diagonal().cwiseSqrt().cwiseInverse();
  RealMatrix A = RealMatrix::Zero(n + m, n + m);
  A.topLeftCorner(n, n) = scale.asDiagonal() * e.M * scale.asDiagonal();
  A.bottomLeftCorner(m, n) = J * scale.asDiagonal();
  A.topRightCorner(n, m) = A.bottomLeftCorner(m, n).transpose();
  RealVector rhs(n + m);
  rhs << -(scale.cwiseProduct(e.h)), row_scale * e.gamma;
  // The state is rounded to double: entries that are zero on paper are 1e-16 here.
  const RealVector x = SolveFullPivot(A, rhs, answer.full_rank() ? Real(0) : Real(1e-12));
  answer.udot = scale.cwiseProduct(x.head(n));
  for (std::size_t b = 0; b < poses_.size(); ++b) {
    answer.accelerations.push_back(bias_[b] + G_.middleRows<6>(6 * b) * answer.udot);
  }
  JointForces(-row_scale.transpose() * x.tail(m), answer);
  return answer;
}

RealMatrix Oracle::ScaledConstraints(const RealVector& q) {
  const Equations e = Form(q, RealVector::Zero(layout_.num_u));
  const RealMatrix J = JointScales() * e.J;
  return SolveLower(CholeskyFactor(e.M), J.transpose()).transpose();
}

/// K^-1 of every constraint along the diagonal, K K^T the response across it of its two bodies
/// alone.
RealMatrix Oracle::JointScales() const {
  const std::vector<Row> rows = Rows(poses_);
  const int num_rows = static_cast<int>(rows.size());
  RealMatrix K_inverse = RealMatrix::Zero(num_rows, num_rows);
  for (int first = 0, last = 0; first < num_rows; first = last) {
    while (last < num_rows && rows[last].joint == rows[first].joint) ++last;
    const JointDescription& joint = description_.joints[rows[first].joint];
    const JetPose X_WM = poses_[joint.to.body] * frames_[rows[first].joint].X_QM;
    const int size = last - first;
    RealMatrix X = RealMatrix::Zero(size, size);
    for (int body : {joint.from.body, joint.to.body}) {
      if (body == kGround) continue;
      RealMatrix F(6, size), A(6, size);
      const Real3 r = ValueOf(X_WM.p, &Jet::f) - ValueOf(poses_[body].p, &Jet::f);
      for (int i = 0; i < size; ++i) F.col(i) = AtCom(rows[first + i].wrench, r);
      A << InertiaInGround(body, poses_[body]).inverse() * F.topRows<3>(),
          F.bottomRows<3>() / Real(description_.bodies[body].mass);
      X += F.transpose() * A;
    }
    K_inverse.block(first, first, size, size) =
        SolveLower(CholeskyFactor(X), RealMatrix::Identity(size, size));
  }
  return K_inverse;
}

void Oracle::Rank(const RealMatrix& M, const RealMatrix& J, Answer& answer) const {
  answer.rows = answer.rank = static_cast<int>(J.rows());
  if (answer.rows == 0) return;
  const RealMatrix W = SolveLower(CholeskyFactor(M), J.transpose());
  const RealVector lambda = SymmetricEigenvalues(W.transpose() * W);
  // squares of lengths: rounding the state to double leaves 1e-32, forming the product 1e-19. The
  // rows are scaled, so that bodies free to answer give one: where none is, all is round-off.
  const Real zero = Real(1e-14) * std::max(Real(1), lambda[answer.rows - 1]);
  int first = 0;
  while (first < answer.rows && lambda[first] < zero) ++first;
  answer.rank = answer.rows - first;
  if (answer.rank == 0) return;
  answer.rcond = static_cast<double>(lambda[first] / lambda[answer.rows - 1]);
}

/// Forces of the cut joints are the multipliers; a tree joint carries what its branch needs beyond.
void Oracle::JointForces(const RealVector& lambda, Answer& answer) const {
  answer.forces.assign(description_.joints.size(), Real6::Zero());
  std::vector<Real6> needed(poses_.size(), Real6::Zero());
  for (std::size_t b = 1; b < poses_.size(); ++b) {
    const Real6 A = answer.accelerations[b] - bias_[b];
    needed[b] = needed_[b];
    needed[b].head<3>() += InertiaInGround(static_cast<int>(b), poses_[b]) * A.head<3>();
    needed[b].tail<3>() += Real(description_.bodies[b].mass) * A.tail<3>();
  }
  const auto give = [&](int index, const Real6& force, Real sign) {
    const JointDescription& joint = description_.joints[index];
    const JetPose X_WM = poses_[joint.to.body] * frames_[index].X_QM;
    const int body = sign > 0 ? joint.to.body : joint.from.body;
    const Real3 r = ValueOf(X_WM.p, &Jet::f) - ValueOf(poses_[body].p, &Jet::f);
    needed[body] -= sign * AtCom(force, r);
  };
  const std::vector<Row> rows = Rows(poses_);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    answer.forces[rows[r].joint] += rows[r].wrench * lambda[r];
  }
  for (int index : layout_.constraints) {
    give(index, answer.forces[index], 1);
    give(index, answer.forces[index], -1);
  }
  for (auto step = layout_.steps.rbegin(); step != layout_.steps.rend(); ++step) {
    if (step->joint < 0) continue;
    const JointDescription& joint = description_.joints[step->joint];
    const bool forward = joint.to.body == step->child;
    const JetPose X_WM = poses_[joint.to.body] * frames_[step->joint].X_QM;
    const Real3 r = ValueOf(poses_[step->child].p, &Jet::f) - ValueOf(X_WM.p, &Jet::f);
    answer.forces[step->joint] = (forward ? 1 : -1) * AtCom(needed[step->child], r);
    give(step->joint, answer.forces[step->joint], forward ? -1 : 1);
  }
}

RealMatrix Oracle::Jacobian(const RealVector& q) const {
  RealMatrix J;
  for (int i = 0; i < layout_.num_u; ++i) {
    const std::vector<Jet> c =
        Closures(PosesAlong(Curve(q, RealVector::Unit(layout_.num_u, i), false)), false);
    if (i == 0) J.resize(static_cast<int>(c.size()), layout_.num_u);
    for (std::size_t r = 0; r < c.size(); ++r) J(r, i) = c[r].d;
  }
  return J;
}

RealVector Oracle::ClosureMismatches(const RealVector& q) const {
  const std::vector<Jet> c = Closures(Poses(q), true);
  RealVector values(c.size());
  for (std::size_t r = 0; r < c.size(); ++r) values[r] = c[r].f;
  return values;
}

RealVector Oracle::ClosureRates(const RealVector& q, const RealVector& u) const {
  const std::vector<Jet> c = Closures(PosesAlong(Curve(q, u, true)), true);
  RealVector rates(c.size());
  for (std::size_t r = 0; r < c.size(); ++r) rates[r] = c[r].d;
  return rates;
}

RealVector Oracle::Consistent(const RealVector& q, const RealVector& u) const {
  const RealMatrix J = Jacobian(q);
  if (J.rows() == 0) return u;
  const int n = layout_.num_u, m = static_cast<int>(J.rows());
  RealMatrix A = RealMatrix::Identity(n + m, n + m);
  A.bottomRightCorner(m, m).setZero();
  A.bottomLeftCorner(m, n) = J;
  A.topRightCorner(n, m) = A.bottomLeftCorner(m, n).transpose();
  RealVector rhs = RealVector::Zero(n + m);
  rhs.head(n) = u;
  rhs.tail(m) = -ClosureRates(q, RealVector::Zero(n));
  return SolveFullPivot(A, rhs, Real(1e-12)).head(n);
}

}  // namespace loopbench::testing
