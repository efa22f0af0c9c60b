// Eigen's decompositions of double matrices that tell a rank, a null space or the least solution,
// compiled once for all who need one: they serve where matrices and right sides are MatrixXd and
// VectorXd themselves. Singular values by these are for matrices with hundreds of rows, for which
// Jacobi's of singular_values.h takes too long.
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

/// As many orthonormal columns as the factored matrix has independent ones at most: those of Q that
/// span its range.
Eigen::MatrixXd ThinQ(const Eigen::HouseholderQR<Eigen::MatrixXd>& qr);

}  // namespace loopbench
