// Positions at which all loops are closed, as near as possible to the guesses of a description.
//
// With e(q) the violation at the cut joints, the coordinates that are not fixed first go from the
// guesses to e = 0 by Levenberg-Marquardt: damping vanishes near a solution, and convergence is
// quadratic. If these steps reach a position near the guesses, it is the result. Otherwise another
// branch may be nearer, or angles may have wound. A search then starts from the guesses and from
// random positions about them and minimises
//
//   |e(q)|^2 + mu^2 |w (q - guess)|^2    over the guessed coordinates, for mu falling to 1e-2
//
// so that guesses are kept first, coordinates without a guess adapt to them, and guesses change
// last. From the position that is found, further steps of this kind with closed loops lead to the
// nearest one: the start is the closed position nearest to the guesses. Angles lie within half a
// turn of their guesses, since whole turns change no pose.
#pragma once

#include "mechanism/start/assembly.h"
#include "mechanism/start/assembly_units.h"

namespace loopbench {

/// Sets positions and their residual from the guesses in `start->q`, or outcome and message if the
/// loops do not close. `units` belong to `kinematics`.
template <class Space>
void ClosePositions(const MechanismDescription& description, Kinematics<Space, double>& kinematics,
                    const AssemblyUnits<Space>& units, Start<double>* start);

/// A length that no position exceeds much, in units: the arms of the longest way through the tree,
/// each at least as long as the mechanism, and the arms of cut joints.
template <class Space>
double Extent(const Mechanism<Space, double>& mechanism, const AssemblyUnits<Space>& units);

}  // namespace loopbench
