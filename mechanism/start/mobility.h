// Whether anything can move from a position: to first order, and at all.
#pragma once

#include <string>

#include "mechanism/model/mechanism.h"

namespace loopbench {

/// Why a mechanism in joint coordinates, compiled from `description`, is locked at the position q;
/// "" where it is not, where motions are prescribed, and above kMostAnalysedSpeeds, where nobody
/// looks unless all constraints are independent (joint_response.h). It is when nothing can move, or
/// when a part stands in a singular position that it cannot leave and would start along speeds that
/// lead nowhere. A rigid part without such speeds locks nothing: it stays where it is, whatever
/// others do.
///
/// Constraints may take every speed. Or they leave speeds at a singular position that lead nowhere:
/// a stretched four-bar, whose hinges in line could each start to buckle and none may. There,
/// a dozen mixtures of those speeds are followed a little way. Where none leads to another
/// position, and all fall back or a self-stress forbids motion to second order, nothing moves.
template <class Space>
std::string WhyLocked(const MechanismDescription& description,
                      const Mechanism<Space, double>& mechanism, const VectorX<double>& q);

}  // namespace loopbench
