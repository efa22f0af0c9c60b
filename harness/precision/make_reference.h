// Certified references: one motion integrated three times in a wide scalar. Digits on which the
// three agree belong to the motion.
//
//   multipliers at a tolerance near the scalar's round-off, which is the reference,
//   multipliers at a tolerance 30 times as large: shows truncation,
//   O-DCA at an intermediate tolerance: another formulation with other rounding.
//
// The certified error is twice the largest distance of the other two from the first. It grows with
// the errors of the motion, without bound for chaotic or branching motions. All three begin at the
// assembled start of every run, closed in the wide scalar.
#pragma once

#include <string>

#include "harness/observers/reference.h"

namespace loopbench::harness {

/// "" or why there can be no reference of this mechanism in that scalar, as a sentence's end.
std::string WhyNoReference(const MechanismDescription& user, const ReferenceOptions& options);

/// Methods tried: the cheapest, then one that gets further if the first ends early.
enum class WaysTried { kAll, kCheapest, kFurthest };

/// Returns the reference from 0 to `horizon` [s]. kCertifiedShare is relative to `length` [m].
Reference MakeReference(const MechanismDescription& user, double horizon, double length,
                        const ReferenceOptions& options, WaysTried tried = WaysTried::kAll);

}  // namespace loopbench::harness
