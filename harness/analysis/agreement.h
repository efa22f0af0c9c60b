// Whether runs of one scene end alike. Neither drift nor energy sees a run that took a wrong
// branch; the runs beside it do.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// Final poses are alike that differ by at most so many tolerances: over links and in rad.
inline constexpr double kMostTolerances = 1000.0;

struct Agreement {
  /// Runs of the same scene, horizon and tolerance with the same number ended alike, the largest
  /// such set being 1; 0 for runs that have nobody to be compared with.
  std::int64_t cluster = 0;
  bool doubted = false;
  /// Ended as one that testifies and whose level puts the branch back at every step.
  bool is_backed = false;
};

/// One for each record, in their order. Compared are accuracy runs that finished, of one scene
/// (`scene_id`: its whole content) and horizon; but not those with a fixed step, which say of no
/// difference that it is small.
///
/// Where the runs at one tolerance do not all end alike, all of them are doubted. The majority need
/// not be right, because formulations at the same level make the same mistakes. A finer tolerance
/// decides, if all runs there end alike and are of more than one level or coordinate set: then only
/// those coarser runs are doubted that ended elsewhere. Integrators make different errors at one
/// tolerance: where all runs of one end alike, and no other one's all end alike elsewhere, they
/// decide for the rest of their tolerance too. Peers whose closures give way
/// (FormulationRow::is_soft) are held to the others' end and cast no doubt on it.
///
/// Only runs that testify decide, one flag for each record: who has reason to doubt itself is held
/// to the others' end. Where nobody testifies, all do.
std::vector<Agreement> CompareFinalPoses(std::span<const Record> records,
                                         const std::vector<bool>& testifies);
/// All testify.
std::vector<Agreement> CompareFinalPoses(std::span<const Record> records);

/// Whether another program made the run.
bool IsPeer(const Record& record);

/// The largest difference of final poses, and the body that has it: lengths over the link length,
/// angles in rad, axes as they are. Infinite where a number is missing or not finite.
struct PoseDifference {
  double largest = 0.0;
  std::string body;
};
/// Largest differences of the poses of bodies that occur in both records.
PoseDifference DifferenceOf(const Record& a, const Record& b);
/// The largest between any two of `runs` of one scene, in any order.
PoseDifference LargestDifference(std::span<const Record> runs);

}  // namespace loopbench::harness
