// What joints bear: the forces and moments that hold the user's bodies together.
//
// With the accelerations of all bodies known, each body needs the wrench w = M A + c - f_applied,
// and its joints must give it. With D lambda the wrench of a joint on its second body, at its point
// Mo, and its opposite on the first,
//
//   sum over joints of S(r) D lambda = w        body by body                                (*)
//
// That asks for no formulation's multipliers: those of O-DCA, of the Lagrange equations and of
// reduction solve the same equations in fewer unknowns, and agree as far as their accelerations do.
// It holds for every joint of the user's, those between bodies that the compile step has merged,
// and out of the plane that a run was simplified to.
//
// Bodies with one joint left are solved one after the other from the leaves inwards; what stays are
// loops, part by part: sparse QR where there are many unknowns, dense with pivoting where there are
// few or where the sparse one finds them dependent. Redundant constraints share a load as their
// stiffness says, which rigid bodies do not have. So a component of a reaction is known where no
// solution of (*) with w = 0 changes it, and NaN where one does. Positions that miss each other by
// a share e of a length leave directions open that (*) holds by less than 10 e.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "harness/trajectory/user_mechanism.h"

namespace loopbench::harness {

template <class Space>
class Reactions {
 public:
  /// `user` must outlive it.
  explicit Reactions(const UserMechanism<Space>& user);
  ~Reactions();

  /// At the present state of the mechanism. `A` are accelerations of the centres of mass by body,
  /// `applied` all other forces there.
  void Solve(std::span<const Acceleration<Space, double>> A,
             std::span<const Wrench<Space, double>> applied);

  /// Components of the wrench on the joint's second body at the joint's point: [moment; force]
  /// along the columns of `axes`, in ground axes. Without what drives give; NaN where not unique.
  Wrench<Space, double> Of(int joint, const Rotation<Space, double>& axes) const;

  /// What a prescribed motion takes along its coordinate, so that its power is this times the speed
  /// [N m or N]; NaN where not unique.
  double DriveOf(int joint, int coordinate) const;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace loopbench::harness
