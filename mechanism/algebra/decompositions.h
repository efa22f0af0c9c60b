// Eigen's decompositions of double matrices for rank, null space or minimum-norm solution, compiled
// once for all users: matrices and right sides are MatrixXd and VectorXd themselves. Use these
// singular values for matrices with hundreds of rows, for which the Jacobi method of
// singular_values.h takes too long.
#pragma once

#include <Eigen/QR>
#include <Eigen/SVD>

extern template class Eigen::JacobiSVD<Eigen::MatrixXd>;
extern template class Eigen::internal::UpperBidiagonalization<Eigen::MatrixXd>;  // of BDCSVD
extern template class Eigen::BDCSVD<Eigen::MatrixXd>;
extern template class Eigen::HouseholderQR<Eigen::MatrixXd>;
extern template void Eigen::HouseholderQR<Eigen::MatrixXd>::_solve_impl(const Eigen::VectorXd&,
                                                                        Eigen::VectorXd&) const;
extern template class Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>;
extern template void Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>::_solve_impl(
    const Eigen::VectorXd&, Eigen::VectorXd&) const;

namespace loopbench {

/// Returns the columns of Q that span the range of the factored matrix: orthonormal, at most as
/// many as its independent columns.
Eigen::MatrixXd ThinQ(const Eigen::HouseholderQR<Eigen::MatrixXd>& qr);

}  // namespace loopbench
