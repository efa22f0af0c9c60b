// A mechanism compiled for one space, one scalar and one coordinate set: immutable, shared by all
// formulations. Every frame of a body is re-expressed from the body's centre of mass.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "mechanism/description/topology.h"
#include "mechanism/model/force_elements.h"
#include "mechanism/model/joint.h"

namespace loopbench {

/// Returns call(Planar()) or call(Spatial()).
template <class Call>
auto ForSpace(SpaceKind space, const Call& call) {
  return space == SpaceKind::kPlanar ? call(Planar()) : call(Spatial());
}

/// Mass properties about the centre of mass, in body axes.
template <class Space, class S>
struct Inertia {
  using Matrix = Small<S, Space::kRot, Space::kRot>;
  S mass = S(0);
  Matrix rotational = Matrix::Zero();
  Matrix rotational_inverse = Matrix::Zero();
};

/// Masses of an evaluation: the bodies' own, or unit masses in the middle of each body's joints,
/// for decisions of rank that must depend on geometry alone (docs/decisions/005).
enum class Masses { kPhysical, kGeometric };

/// Small on purpose: a long chain streams all of it through the cache at every evaluation.
template <class Space, class S>
struct Joint {
  const JointKind<Space, S>* kind = nullptr;
  int from = kGround, to = kGround;     ///< bodies P and Q
  int q_offset = -1, u_offset = -1;     ///< place in q and u; -1 for a constraint
  int row = -1;                         ///< first constraint row; -1 for a tree joint
  int description = -1;                 ///< index of the user's joint, -1 for a virtual free joint
  int first_drive = 0, num_drives = 0;  ///< its prescribed coordinates, in Mechanism::drives()
  int num_released = 0;                 ///< directions of D that are not imposed (redundancy.h)
  bool on_loop = false;                 ///< its bodies are also connected otherwise
  bool is_cut = false;                  ///< closes a loop in joint coordinates by description
  Pose<Space, S> X_PF, X_QM;            ///< seen from the centres of mass of P and Q
  double initial = 0.0;                 ///< initial value of its only coordinate, or 0

  bool in_tree() const { return q_offset >= 0; }
  /// The kind's numbers, with each prescribed coordinate counted as a constraint.
  int num_q() const { return kind->num_q - num_drives; }
  int num_u() const { return kind->num_u - num_drives; }
  int num_constraints() const { return num_directions() - num_released; }
  /// Constrained directions, imposed or released.
  int num_directions() const { return kind->num_constraints() + num_drives; }
};

/// A prescribed coordinate of a joint. Directions of such coordinates are the first columns of D.
struct Drive {
  int joint = 0;
  int coordinate = 0;  ///< of the kind
  TimeFunction value;
};

/// sum_i ratio_i q_i = offset over joints of one coordinate. Its force mu acts as ratio_i mu along
/// each coordinate and does no work.
template <class S>
struct Coupling {
  struct Part {
    int joint = 0;
    S ratio = S(1);
  };
  std::string name;
  std::vector<Part> parts;
  S offset = S(0);
  /// Changes of the sum by a turn of each angle of a cut joint, which is measured modulo a turn;
  /// largest first.
  std::vector<S> measured_turns;
  /// Returns a mismatch without whole turns of these angles: at most half of the smallest.
  S WithoutTurns(S open) const {
    for (const S& turn : measured_turns) open = std::remainder(open, turn);
    return open;
  }
  bool is_moving_row = false;  ///< imposes a released direction instead (MovingRow); no parts
  bool in_loops = false;       ///< constraints of joints depend on it (redundancy.h)
};

/// Inertia along the coordinate of a joint, or along a rate given by a drive.
template <class S>
struct Rotor {
  int joint = 0;
  S inertia = S(0);
};

/// Directions that a joint does not impose (redundancy.h), ascending, counted in D behind the
/// directions of prescribed coordinates.
struct Released {
  int joint = 0;
  std::vector<int> directions;
  /// The subset that moving rows impose at present, ascending. In several overconstrained loops
  /// the number of independent rows of one joint changes during a motion; solvers need it constant.
  /// So rows that must move between joints are imposed like couplings.
  std::vector<int> moving = {};

  bool IsMoving(int direction) const { return std::ranges::binary_search(moving, direction); }
  bool Imposes(int direction) const {
    return IsMoving(direction) || !std::ranges::binary_search(directions, direction);
  }
  friend bool operator==(const Released&, const Released&) = default;
};

/// A released direction that is imposed at present: a column of the joint's basis [H D].
struct MovingRow {
  int joint = 0, column = 0;
};

/// A tree joint seen from its root side. `sign` is +1 when the child is the joint's Q, else -1.
struct TreeStep {
  int joint = 0;
  int parent = kGround;
  int child = kGround;
  int sign = 1;
};

template <class Space, class S>
class Mechanism {
 public:
  /// Throws std::invalid_argument with the text of Validate() when the description is unusable, or
  /// when the space cannot hold it.
  Mechanism(const MechanismDescription& description, Coordinates coordinates);

  const std::string& name() const { return name_; }
  Coordinates coordinates() const { return coordinates_; }
  int num_bodies() const { return static_cast<int>(bodies_.size()); }  ///< with Ground
  int num_q() const { return num_q_; }
  int num_u() const { return num_u_; }
  int num_rows() const { return num_rows_; }  ///< scalar constraints of all cut joints
  /// Scalar constraints of joints, then one per coupling. Solvers impose the constraints of joints
  /// only (coupled_solver.h).
  int num_equations() const { return num_rows_ + static_cast<int>(couplings_.size()); }
  /// Independent loops of the user's graph, the same number in both coordinate sets.
  int num_loops() const { return num_loops_; }
  /// Free speeds of the user's spanning forest: num_u() in joint coordinates.
  int num_joint_speeds() const { return num_joint_speeds_; }

  const std::vector<Inertia<Space, S>>& bodies() const { return bodies_; }
  const std::vector<std::string>& body_names() const { return body_names_; }
  const std::vector<Joint<Space, S>>& joints() const { return joints_; }
  /// A virtual free joint carries its body's name.
  const std::vector<std::string>& joint_names() const { return joint_names_; }
  /// Prescribed motions, by joint and coordinate.
  const std::vector<Drive>& drives() const { return drives_; }
  /// Index into drives() of a prescribed coordinate, -1 for a free one.
  int DriveOf(const Joint<Space, S>& joint, int coordinate) const {
    for (int d = joint.first_drive; d < joint.first_drive + joint.num_drives; ++d) {
      if (drives_[d].coordinate == coordinate) return d;
    }
    return -1;
  }
  /// Calls call(i, k) for the free ones of the kind's first `count` coordinates (or speeds) i of a
  /// joint; k counts them.
  template <class Call>
  void ForEachFree(const Joint<Space, S>& joint, int count, const Call& call) const {
    for (int i = 0, k = 0; i < count; ++i) {
      if (DriveOf(joint, i) < 0) call(i, k++);
    }
  }
  const std::vector<TreeStep>& tree() const { return tree_; }
  const std::vector<int>& constraints() const { return constraints_; }  ///< joint indices
  std::vector<int> RowsOfConstraints() const;  ///< of each, scalar constraints
  /// Couplings of coordinates, then a place for each moving row.
  const std::vector<Coupling<S>>& couplings() const { return couplings_; }
  int num_moving_rows() const { return num_moving_rows_; }
  int num_coordinate_couplings() const {
    return static_cast<int>(couplings_.size()) - num_moving_rows_;
  }
  const std::vector<Rotor<S>>& rotors() const { return rotors_; }
  /// Directions that constraints do not impose at first, by joint; usually empty.
  const std::vector<Released>& released() const { return released_; }
  /// Returns true if released directions are constraints that drift (self_stress.h), not rounded.
  bool is_redundant() const { return !released_.empty() && !rounded_; }
  /// Share of a length, or angle [rad], by which released directions may stay open.
  double accuracy() const { return accuracy_; }
  const ForceElements<Space, S>& forces() const { return forces_; }
  const Linear<Space, S>& gravity() const { return gravity_; }
  /// Returns true if power is supplied or dissipated: otherwise total energy is conserved.
  bool has_power() const { return forces_.has_power() || !drives_.empty(); }
  /// Times [s] at which derivatives of a prescribed motion or of a force jump, ascending: an
  /// integrator must not step across them.
  const std::vector<double>& stop_times() const { return stop_times_; }

  /// Tree step that carries a body (index into tree()), -1 for Ground.
  int step_of_body(int body) const { return step_of_body_[body]; }

  /// Root mean square distance of joints from the middle of their body's joints [m], over bodies
  /// with several; without such, of joints from centres of mass; 1 when all are zero.
  S length() const { return length_; }

  /// kGeometric: unit masses whose radius of gyration is length() of their own island (topology.h),
  /// about geometric_centre(): sizes of other parts and far centres of mass have no effect.
  const std::vector<Inertia<Space, S>>& bodies(Masses masses) const {
    return masses == Masses::kPhysical ? bodies_ : geometric_bodies_;
  }
  /// Middle of a body's joints from its centre of mass, in body axes; zero for Ground and for
  /// bodies without joints.
  const Linear<Space, S>& geometric_centre(int body) const { return geometric_centres_[body]; }

  /// Names of the speeds: "<joint>" or "<joint>.<component>"; virtual joints carry the body's name.
  const std::vector<std::string>& speed_names() const { return speed_names_; }
  /// Indices of the user's independent speeds that exist in this coordinate set.
  const std::vector<int>& independent() const { return independent_; }

  /// Quaternions in q to length one.
  void Normalise(VectorX<S>& q) const;

  /// qdot = N(q) u.
  void Rates(const VectorX<S>& q, const VectorX<S>& u, Eigen::Ref<VectorX<S>> qdot) const;
  /// Returns q + N(q) u, normalised. Allocates.
  VectorX<S> Moved(const VectorX<S>& q, const VectorX<S>& u) const {
    VectorX<S> rates(q.size());
    Rates(q, u, rates);
    VectorX<S> moved = q + rates;
    Normalise(moved);
    return moved;
  }

 private:
  void AddBodies(const MechanismDescription& description);
  void AddJoints(const MechanismDescription& description, const Topology& topology);
  Joint<Space, S> MakeJoint(const MechanismDescription& description, int index);
  void AddCouplings(const MechanismDescription& description);
  void AddStopTimes();
  void AddGeometry(const MechanismDescription& description);
  void NameSpeeds(const MechanismDescription& description);

  std::string name_;
  Coordinates coordinates_;
  int num_q_ = 0, num_u_ = 0, num_rows_ = 0, num_loops_ = 0, num_joint_speeds_ = 0,
      num_moving_rows_ = 0;
  std::vector<Inertia<Space, S>> bodies_, geometric_bodies_;
  std::vector<Linear<Space, S>> geometric_centres_;
  std::vector<std::string> body_names_, joint_names_;
  std::vector<Joint<Space, S>> joints_;
  /// Kinds with a parameter of their own; shared by copies of the mechanism.
  std::vector<std::shared_ptr<const JointKind<Space, S>>> own_kinds_;
  std::vector<Drive> drives_;
  std::vector<double> stop_times_;
  std::vector<TreeStep> tree_;
  std::vector<int> constraints_, step_of_body_;
  std::vector<Coupling<S>> couplings_;
  std::vector<Rotor<S>> rotors_;
  std::vector<Released> released_;
  bool rounded_ = false;
  double accuracy_ = 0.0;
  ForceElements<Space, S> forces_;
  Linear<Space, S> gravity_;
  S length_ = S(1);
  std::vector<std::string> speed_names_;
  std::vector<int> independent_;
};

}  // namespace loopbench
