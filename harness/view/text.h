// A picture as tables of places, for terminals and readers of screens.
#pragma once

#include <string>
#include <vector>

#include "harness/tables/table.h"
#include "harness/view/picture.h"

namespace loopbench::harness {

/// Bodies, joints, forces, loops and motions, each with what `explain` does not say: where they are
/// in ground axes [m, rad].
std::vector<Table> ToTables(const Picture& picture);

}  // namespace loopbench::harness
