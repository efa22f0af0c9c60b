#include "mechanism/formulation/constraint_solver.h"

#include <stdexcept>

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

template <class Space, class S>
bool ConstraintSolver<Space, S>::Accelerate(const Kinematics<Space, S>&, const VectorX<S>&,
                                            VectorX<S>&, VectorX<S>*) {
  return false;
}

template <class Space, class S>
void ConstraintSolver<Space, S>::SolveWrenches(const VectorX<S>&, VectorX<S>&, VectorX<S>*) {
  throw std::logic_error("a solver that takes wrenches does not solve for them");
}

template <class Space, class S>
bool ConstraintSolver<Space, S>::RightHandSide(SpeedsUsed, Kinematics<Space, S>&,
                                               std::span<const S>, std::span<const S>, std::span<S>,
                                               std::span<S>) {
  return false;
}

template <class Space, class S>
std::optional<Correction<S>> ConstraintSolver<Space, S>::Project(std::span<S>, std::span<S>, S) {
  return std::nullopt;
}

template <class Space, class S>
void ConstraintSolver<Space, S>::Correct(const VectorX<S>& target, VectorX<S>& x) {
  Solve(VectorX<S>(), target, x, nullptr);
}

template <class Space, class S>
bool ConstraintSolver<Space, S>::CompleteSpeeds(Kinematics<Space, S>&, VectorX<S>&) {
  return false;
}

template <class Space, class S>
void ConstraintSolver<Space, S>::Start(const Kinematics<Space, S>&) {}

template <class Space, class S>
bool ConstraintSolver<Space, S>::Review(const Kinematics<Space, S>&) {
  return false;
}

template <class Space, class S>
int LoopRank(const Mechanism<Space, S>& mechanism, int dependent_rows) {
  int user_tree_rows = 0;
  if (mechanism.coordinates() == Coordinates::kAbsolute) {
    // every user joint is a constraint here; those of a spanning forest are always independent and
    // convert the speeds of free bodies into joint speeds
    user_tree_rows = mechanism.num_u() - mechanism.num_joint_speeds();
  }
  return mechanism.num_rows() - user_tree_rows - dependent_rows;
}

template <class Space, class S>
std::string TooLargeToDecide(const Mechanism<Space, S>& mechanism, const Conditioning& found) {
  const int joint = found.worst_joint;
  return "rank is uncertain" +
         (joint < 0 ? std::string() : " at joint \"" + mechanism.joint_names()[joint] + '"') +
         ", and the dense equations that would decide it are too large: " +
         std::to_string(mechanism.num_rows()) + " constraints and " +
         std::to_string(mechanism.num_u()) + " speeds";
}

#define LOOPBENCH_INSTANTIATE(Space, S)                   \
  template class ConstraintSolver<Space, S>;              \
  template int LoopRank(const Mechanism<Space, S>&, int); \
  template std::string TooLargeToDecide(const Mechanism<Space, S>&, const Conditioning&);
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
