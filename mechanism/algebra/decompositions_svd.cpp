#include "mechanism/algebra/decompositions.h"

template class Eigen::BDCSVD<Eigen::MatrixXd>;
