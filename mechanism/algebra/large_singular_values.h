// Eigen's singular value decompositions of double matrices, compiled once for all who need one of
// matrices with hundreds of rows, for which Jacobi's of singular_values.h takes too long.
#pragma once

#include <Eigen/SVD>

extern template class Eigen::JacobiSVD<Eigen::MatrixXd>;
extern template class Eigen::BDCSVD<Eigen::MatrixXd>;
