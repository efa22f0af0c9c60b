// Which of a mechanism's redundant constraints are imposed, and along which axes.
//
// A released direction misses by what the imposed ones miss times an *amplification*: its row in
// terms of theirs. Of all choices that one is taken whose largest amplification is least, over the
// positions that the motion can reach as far as one knows (all around, or as high as its energy
// takes it), and which is not lost between two of them. Two things make choices comparable:
//   moments   of a joint in space are imposed all or none. Rates of rotation are no derivatives of
//             angles: with both moments of a pin imposed its axis stays as far off as it is, with
//             one of them the mismatch of the other turns into its own, and grows exponentially.
//   forces    are imposed along axes that are searched for, fixed in the joint's frame F, so that
//             each stays a function of the coordinates. A user's frame of a pin may stand at any
//             angle about the pin, which must not decide how well its loop closes.
#pragma once

#include <vector>

#include "mechanism/loops/direction_rows.h"

namespace loopbench {

/// A cut joint, as the choice sees it: directions of its kind's D.
struct Choosable {
  int count = 0;
  std::vector<int> moments;  ///< directions that are moments in space, all or none
  int first_force = -1;      ///< the first of all of the space's forces, -1 where some are free
  int num_forces = 0;
  bool keeps_all = false;  ///< nothing of it may be released
};

template <class Space>
Choosable ChoiceOf(const JointKind<Space, double>& kind);

struct ReleaseChoice {
  std::vector<std::vector<bool>> imposed;   ///< by joint and direction
  std::vector<Eigen::Matrix3d> force_axes;  ///< by joint, columns in its frame F
};

/// `positions` have their rows in the joints' own axes; those that `follow` the one before are
/// next to it on a walk. `rank` rows are to be imposed.
ReleaseChoice ChooseImposed(const std::vector<DirectionRows>& positions,
                            const std::vector<bool>& follows, const std::vector<Choosable>& joints,
                            int rank);

}  // namespace loopbench
