// Eigen's singular value decompositions of double matrices, compiled once for all who need one.
#pragma once

#include <Eigen/SVD>

extern template class Eigen::JacobiSVD<Eigen::MatrixXd>;
extern template class Eigen::BDCSVD<Eigen::MatrixXd>;
