// Whether anything can move from a position: to first order, and at all.
#pragma once

#include <string>

#include "mechanism/model/mechanism.h"

namespace loopbench {

/// Why nothing can move from the position q of a mechanism in joint coordinates, as the end of a
/// sentence; "" where something can, where motions are prescribed, and above kMostAnalysedSpeeds
/// (redundancy.h), where nobody looks.
///
/// Constraints may take every speed. Or they leave speeds at a singular position that lead nowhere:
/// a stretched four-bar, whose hinges in line could each start to buckle and none may. There,
/// a dozen mixtures of those speeds are followed a little way. Where none leads to another
/// position, and all fall back or a self-stress forbids motion to second order, nothing moves.
template <class Space>
std::string WhyLocked(const Mechanism<Space, double>& mechanism, const VectorX<double>& q);

}  // namespace loopbench
