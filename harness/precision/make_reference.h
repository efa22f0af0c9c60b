// Certified references: one motion integrated three times in a wide scalar. Where the three agree,
// the digits are the motion's.
//
//   multipliers at a tolerance near the scalar's round-off, which is the reference,
//   multipliers at a tolerance 30 times as large: truncation shows,
//   O-DCA at one in between: another formulation, another way of rounding.
//
// The certified error is twice the largest distance of the other two from the first. It
// grows as errors of the motion do: of a chaotic one, or one that branches, until nothing is left.
// All three begin at one start, which is the assembled one of every run, closed in the wide scalar.
#pragma once

#include <string>

#include "harness/reference/reference.h"

namespace loopbench::harness {

/// "" or why there can be no reference of this mechanism in that scalar, as a sentence's end.
std::string WhyNoReference(const MechanismDescription& user, const ReferenceOptions& options);

/// The cheapest way is tried first; another one, which gets further, where that one is not
/// certified to the end.
enum class WaysTried { kAll, kCheapest, kFurthest };

/// The reference of a user's mechanism from 0 to `horizon` [s]. `length` [m] is what
/// kCertifiedShare is a share of.
Reference MakeReference(const MechanismDescription& user, double horizon, double length,
                        const ReferenceOptions& options, WaysTried tried = WaysTried::kAll);

}  // namespace loopbench::harness
