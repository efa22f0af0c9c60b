#include "mechanism/formulation/release_review.h"

#include <algorithm>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/loops/direction_rows.h"
#include "mechanism/loops/row_choice.h"

namespace loopbench {

namespace {

/// Looks again after every so much of a turn [rad], or of a mechanism length, of the fastest body:
/// a tenth of what may turn a good choice into a bad one.
constexpr double kTravel = 0.1;
/// A choice gives way when its least pivot is below this part of the best one's. The mismatch of a
/// released direction is that of the imposed ones times about one over the pivot, and a change of
/// choice makes it the imposed one: changes that come back with every turn would add up to
/// exponential growth. So they are for choices that are all but lost.
constexpr double kReplaceBelow = 0.05;

}  // namespace

template <class Space, class S>
const std::vector<Released>* ReleaseReview<Space, S>::Review(const Kinematics<Space, S>& kinematics,
                                                             S h) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  double fastest = 0.0;
  for (const Velocity<Space, S>& V : kinematics.motions()) {
    const double turn = static_cast<double>(V.angular.norm());
    const double shift = static_cast<double>(V.linear.norm());
    fastest = std::max({fastest, turn, shift / static_cast<double>(mechanism.length())});
  }
  travel_ += fastest * static_cast<double>(h);
  if (!(travel_ >= kTravel)) return nullptr;
  travel_ = 0.0;

  const DirectionRows scaled = RowsOfDirections(kinematics);
  std::vector<Quota> quotas;
  int total = 0;
  std::vector<bool> imposed(scaled.rows.rows(), false);
  for (std::size_t c = 0; c < scaled.first.size(); ++c) {
    const Joint<Space, S>& joint = mechanism.joints()[mechanism.constraints()[c]];
    const int keep = joint.num_constraints();
    quotas.push_back({scaled.first[c], scaled.count[c], joint.num_drives, keep});
    for (int i = 0; i < keep; ++i) imposed[scaled.first[c] + i] = true;
    total += keep;
  }
  RowChoice best(scaled.rows, quotas);
  best.TakeFixed();
  // moments in space stay as they are: some of a joint's without the others serve badly in time
  std::vector<bool> is_moment(scaled.rows.rows(), false);
  for (std::size_t c = 0; c < scaled.first.size() && Space::kRot == 3; ++c) {
    const int index = mechanism.constraints()[c];
    const Joint<Space, S>& joint = mechanism.joints()[index];
    for (int i = joint.num_drives; i < scaled.count[c]; ++i) {
      const int direction = joint.kind->num_u + kinematics.DirectionOf(index, i);
      const int row = scaled.first[c] + i;
      is_moment[row] = joint.kind->axes[direction] < Space::kRot;
      const bool has_choice = quotas[c].keep < quotas[c].count;
      if (is_moment[row] && imposed[row] && has_choice) best.Take(c, row);
    }
  }
  RowChoice current = best;
  const double best_pivot = best.TakeBest(total, [&](int row) { return !is_moment[row]; });
  const double pivot = current.TakeBest(total, [&](int row) { return imposed[row]; });
  // at a singular position no choice is any good
  constexpr double kSingular = 1e-3;
  if (best_pivot < kSingular || pivot >= kReplaceBelow * best_pivot) return nullptr;
  better_ = best.NotTaken(mechanism.constraints());
  // rows count imposed directions first
  for (Released& out : better_) {
    const int drives = mechanism.joints()[out.joint].num_drives;
    for (int& direction : out.directions) {
      direction = kinematics.DirectionOf(out.joint, drives + direction);
    }
    std::ranges::sort(out.directions);
    const auto now = std::ranges::find(kinematics.released(), out.joint, &Released::joint);
    out.force_axes = now->force_axes;
  }
  return &better_;
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class ReleaseReview<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
