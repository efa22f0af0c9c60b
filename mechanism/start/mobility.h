// Mobility from a position: infinitesimal and finite.
#pragma once

#include <string>

#include "mechanism/model/mechanism.h"

namespace loopbench {

/// Returns the reason why a mechanism in joint coordinates, compiled from `description`, is locked
/// at the position q, or "" if it is not locked or motions are prescribed. Not analysed above
/// kMaxAnalysedSpeeds unless all constraints are independent (joint_response.h). Locked means that
/// nothing can move, or that a part is in a singular configuration that it cannot leave and would
/// start along infinitesimal motions. A rigid part without such speeds locks nothing: it stays in
/// place regardless of others.
///
/// Constraints may remove every speed. Or they leave infinitesimal motions at a singular
/// configuration: a stretched four-bar's hinges in line could each start to buckle and none may.
/// Then a dozen mixtures of those speeds are followed a small distance. If none reaches another
/// position, and all return or a self-stress forbids motion to second order, nothing moves.
template <class Space>
std::string WhyLocked(const MechanismDescription& description,
                      const Mechanism<Space, double>& mechanism, const VectorX<double>& q);

}  // namespace loopbench
