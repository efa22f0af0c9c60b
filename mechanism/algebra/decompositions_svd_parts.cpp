// Half of Eigen::BDCSVD: both together take the compiler a gigabyte.
#include "mechanism/algebra/decompositions.h"

template class Eigen::internal::UpperBidiagonalization<Eigen::MatrixXd>;
