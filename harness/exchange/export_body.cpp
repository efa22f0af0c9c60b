#include "harness/exchange/export_body.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <limits>

#include "mechanism/algebra/symmetric_eigen.h"

namespace loopbench::exchange {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Largest moment less the sum of the others.
double Excess(const Vector3d& moments) { return 2.0 * moments.maxCoeff() - moments.sum(); }

/// An eigenvalue has an error of some eps times the largest; three of them are compared.
double RoundOff(const Vector3d& moments) {
  return 16.0 * std::numeric_limits<double>::epsilon() * moments.maxCoeff();
}

}  // namespace

PrincipalInertia PrincipalInertiaOf(const Body& body, bool planar) {
  const Matrix3d I =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(body.inertia.data());
  PrincipalInertia made;
  if (planar) {
    made.moments.setConstant(I(2, 2));
    return made;
  }
  made.moments = I.diagonal();
  if (!I.isDiagonal(0.0)) {
    MatrixX<double> A = I, U(3, 3);
    VectorX<double> lambda(3);
    SymmetricEigen<double>(A, U, lambda);
    made.moments = lambda;
    made.axes = U;
    if (made.axes.determinant() < 0.0) made.axes.col(0) *= -1.0;
  }
  const double excess = Excess(made.moments);
  if (excess > 0.0 && excess <= RoundOff(made.moments)) {
    Eigen::Index largest = 0;
    made.moments.maxCoeff(&largest);
    made.moments[(largest + 1) % 3] += 2.0 * excess;
  }
  return made;
}

std::string FaultOfInertia(const Body& body, bool planar) {
  const Vector3d moments = PrincipalInertiaOf(body, planar).moments;
  if (Excess(moments) <= RoundOff(moments)) return "";
  return fmt::format(
      "body \"{}\": principal moments of inertia {:.6g}, {:.6g} and {:.6g} kg m^2, "
      "which no body has: the largest is above the sum of the others",
      body.name, moments[0], moments[1], moments[2]);
}

}  // namespace loopbench::exchange
