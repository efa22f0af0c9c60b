// O-DCA for planar mechanisms of revolute joints (pins) with branches: trees, several loops on one
// body, grids, and for all with forces other than gravity. Computes rates directly from joint
// coordinates and speeds, like path_sweep.h for paths, along an assembly tree (plan.h).
//
//   angles and speeds of bodies   along the spanning tree (tree_angles.h)
//   violations of cut joints      along the same tree
//   up, matrices                  zeta of each body, then X, W or V and zeta of each join
//   up and down, vectors          zeta_i3, then forces: once, or twice where speeds are completed
//
// A handle is a joint side that is still open, with the two rows of a pin's D (two_handle.h). A
// body has as many handles as pins, and Y (67) is a row of blocks of zeta. A tree pin on Ground is
// a property of its body, not a joint of an assembly, as in two_handle.h.
//
// A join of one pin keeps W = X^-1 Y; its rank is uncertain under the condition for paths.
// loop_solver.h solves joins of several pins; their rank is uncertain if the general pass (joins.h)
// finds it so. Evaluate() then stops, and the general pass decides.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "mechanism/loops/loop_solver.h"
#include "mechanism/model/mechanism.h"
#include "odca/pin_projection.h"
#include "odca/plan.h"
#include "odca/short_cut.h"
#include "odca/tree_angles.h"
#include "odca/two_handle.h"

namespace loopbench::odca::pins {

class AssemblySweep final : public ShortCut<Planar> {
 public:
  /// Returns a sweep along `plan`; neither plan nor mechanism need outlive it. Null for other
  /// mechanisms, and if the general pass has fewer multiplications, as with many pins on one body.
  static std::unique_ptr<AssemblySweep> Make(const Mechanism<Planar, double>& mechanism,
                                             const Plan& plan);

  bool Evaluate(SpeedsUsed speeds, Kinematics<Planar, double>* kinematics,
                std::span<const double> q, std::span<const double> u, std::span<double> qdot,
                std::span<double> udot) override;
  std::optional<Correction<double>> Project(std::span<double> q, std::span<double> u,
                                            double goal) override;
  bool IsUsable(const Kinematics<Planar, double>& kinematics) override;
  long operations() const override { return operations_; }

 private:
  using Vector = Vector2<double>;
  using Matrix = Matrix2<double>;

  struct Body {
    Link<double> link;  ///< arms belong to handles
    int first_handle = 0, handles = 0;
    int first_block = 0;  ///< of zeta
    Vector stand = {};    ///< position of a fixed point of reference, if any
    Vector centre = {};   ///< of mass, from the point of reference, in axes of the body
  };
  /// Effect of forces other than gravity on a body alone.
  struct Applied {
    Vector a = {};       ///< acceleration of the point of reference
    double alpha = 0.0;  ///< sqrt(I) times angular acceleration
  };
  /// A joint of the tree between two bodies: position of the child.
  struct Step {
    int parent = 0, child = 0;                ///< bodies
    int parent_handle = 0, child_handle = 0;  ///< handles at their common joint
  };
  /// A joint that is cut. On Ground there is no handle.
  struct CutJoint {
    int P = -1, Q = -1;            ///< handles
    int body_P = -1, body_Q = -1;  ///< -1: Ground
    Vector ground = {};            ///< the point there
    Vector v = {};                 ///< relative velocity (two_handle.h), Q against P, or the gap
    double w_P = 0.0;
  };
  /// One of a node's joints on one of its children.
  struct Side {
    int child = 0;
    int place = -1;  ///< among its handles; -1: Ground
    int slot = -1;   ///< of b_ and F_
  };
  struct Pin {
    Side P, Q;
    int cut = -1;  ///< in cuts_
  };
  /// A body of a pin alone, for X_free (loop_solver.h) of joins of several; -1: Ground.
  struct FreeBody {
    int body = -1;
    Vector arm = {};  ///< from the centre of mass, in axes of the body
    double mobility = 0.0, inverse_inertia = 0.0;
  };
  /// A join. Children's zeta are blocks by columns.
  struct Node {
    int blocks[2] = {0, 0}, handles[2] = {0, 0};  ///< first block and number of handles of each
    int first_pin = 0, pins = 0;
    int first_kept = 0, kept = 0;  ///< in kept_
    int first_slot = 0;            ///< of its own handles
    int first_block = 0;           ///< of its own zeta
    int first_row = 0;             ///< of s_, two for each pin
    int matrix = 0;                ///< of one pin: first of W_; else first number of V_
    int factors = 0;               ///< of one pin: in factors_; else in loops_
    int first_free = 0;            ///< of several: in free_, two for each pin
    double limit = 0.0;            ///< least response of one pin, or pivot; 0 if no loop closes
  };

  /// Type of the violation in CutJoint::v, as in path_sweep.h.
  enum class GapKind { kSpeeds, kPositions };

  AssemblySweep() = default;
  struct Layout;

  /// Bodies at moved angles. False for angles beyond kLargestAngle.
  template <GapKind kGap>
  bool Turn();
  template <GapKind kGap>
  void Close();
  /// Matrices of all assemblies. False near a degenerate position.
  bool Assemble();
  bool JoinOne(const Node& node);
  bool JoinSeveral(const Node& node);
  template <class Product>
  void Eliminate(const Node& node, const Product& product);
  JointMatrix<double> FreeResponse(const FreeBody* bodies) const;
  /// applied_ at the positions and speeds of `kinematics`.
  void SetApplied(const Kinematics<Planar, double>& kinematics);
  /// Computes alpha_, or corrections of speeds.
  template <Pass kPass>
  void Solve();
  template <Pass kPass>
  void Up(const Node& node);
  void Down(const Node& node);
  friend PinProjection;
  bool FindChange();
  double LargestGap() const;

  std::vector<Body> bodies_;
  std::vector<Vector> handles_;  ///< arms by radius in axes of the body, body after body
  std::vector<Step> steps_;
  std::vector<CutJoint> cuts_;
  std::vector<Node> nodes_;
  std::vector<Pin> pins_;
  std::vector<FreeBody> free_;
  std::vector<Side> kept_;

  std::vector<double> angle_, speed_, alpha_;  ///< by body, Ground's last, then padding of lanes
  std::vector<double> sine_, cosine_;          ///< as in the line above
  std::vector<Vector> arm_;                    ///< of handles, in ground axes, over radius
  std::vector<Applied> applied_;               ///< by body; empty if only gravity acts
  std::vector<Wrench<Planar, double>> wrenches_;
  std::vector<Point<double>> reference_;  ///< of bodies
  std::vector<Matrix> zeta_, W_, Y_;
  std::vector<double> V_;
  std::vector<Factored2<double>> factors_;
  std::vector<LoopSolver<double>> loops_;
  MatrixX<double> X_;
  std::vector<Vector> b_, F_;  ///< by slot: handles of bodies first, then of nodes
  std::vector<double> s_, phi_;
  std::vector<double> moved_, back_, speeds_;  ///< as in path_sweep.h
  TreeAngles<double> tree_;
  std::unique_ptr<WorkerPool> pool_ = std::make_unique<WorkerPool>(1);
  long of_matrices_ = 0, of_vectors_ = 0, operations_ = 0;
};

}  // namespace loopbench::odca::pins
