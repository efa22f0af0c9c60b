// Dense linear algebra of the oracle in long double, in plain loops: small to compile, easy to
// read.
#pragma once

#include <Eigen/Core>

#include "tests/contract/jet.h"

namespace loopbench::testing {

using RealVector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using RealMatrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

/// x with A x = b by elimination with full pivoting. Pivots below `zero` times the largest entry
/// end the elimination: unknowns not reached are zero, and consistent equations left over are
/// satisfied.
RealVector SolveFullPivot(RealMatrix A, RealVector b, Real zero);

/// Lower L with A = L L^T, A symmetric positive definite.
RealMatrix CholeskyFactor(const RealMatrix& A);

/// L^-1 B.
RealMatrix SolveLower(const RealMatrix& L, RealMatrix B);

/// Eigenvalues of a symmetric matrix, ascending.
RealVector SymmetricEigenvalues(const RealMatrix& A);

}  // namespace loopbench::testing
