// Checks the requirements on every formulation, also for programs that register their own
// (harness/config/formulations.h). It is installed as the library loopbench::contract, and needs no
// test framework.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace loopbench::contract {

/// Holds the registered formulation to its promises, on random coupled loops with joints, forces
/// and prescribed motions of every kind, in plane and space, in both coordinate sets, with both
/// solvers and at all levels that it has:
///
///   starts            a consistent start is taken
///   accelerations     those of an oracle: dense equations in long double, from kinematics written
///                     anew (oracle.h), within 100 eps N / rcond for N unknowns
///   forces            the multipliers are the forces behind these accelerations
///   time              accelerations again, where forces follow the time
///   rank              the number of independent loop constraints
///   energy            its rate is the power of forces and drives
///   purity            the derivative is a function of the state, to the last bit, whatever was
///                     asked before
///   determinism       a second object gives the same bits
///   speeds            handed through as they are; at level velocity they satisfy the loops
///   projection        at level projection an accepted step ends on the constraints
///   endings           a state with NaN or infinity ends as non-finite or singular, and leaves
///                     nothing behind
///
/// Each seed gives other mechanisms; `all_kinds` adds loops in space through joints of all kinds.
/// Returns a sentence for each violation, the first few of each promise; none when all is kept.
/// Some seconds. Throws std::invalid_argument for a name that is not registered.
std::vector<std::string> Check(const std::string& formulation,
                               const std::vector<std::uint64_t>& seeds = {1, 2, 3, 4},
                               bool all_kinds = false);

}  // namespace loopbench::contract
