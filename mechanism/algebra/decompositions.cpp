#include "mechanism/algebra/decompositions.h"

using Eigen::MatrixXd;
using Eigen::VectorXd;

template class Eigen::JacobiSVD<MatrixXd>;
template class Eigen::HouseholderQR<MatrixXd>;
template void Eigen::HouseholderQR<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
template class Eigen::CompleteOrthogonalDecomposition<MatrixXd>;
template void Eigen::CompleteOrthogonalDecomposition<MatrixXd>::_solve_impl(const VectorXd&,
                                                                            VectorXd&) const;

namespace loopbench {

MatrixXd ThinQ(const Eigen::HouseholderQR<MatrixXd>& qr) {
  return qr.householderQ() * MatrixXd::Identity(qr.rows(), qr.hCoeffs().size());
}

}  // namespace loopbench
