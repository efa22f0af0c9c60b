// O-DCA for planar mechanisms of pins whose bodies branch, trees, several loops on one body, grids,
// and for those on which forces other than gravity act. From joint coordinates and speeds to their
// rates at once, as path_sweep.h does it for paths, along a plan (plan.h).
//
//   angles and speeds of bodies   along the spanning tree (tree_angles.h)
//   gaps of cut joints            along the same tree
//   up, matrices                  zeta of each body, then X, W or V and zeta of each join
//   up and down, vectors          zeta_i3, then forces: once, or twice where speeds are completed
//
// A handle is a joint side that is still open, with the two rows of a pin's D (two_handle.h), so a
// body has as many handles as it has pins, and Y (67) is a row of blocks of zeta. A pin of the tree
// on Ground is no joint of an assembly but a property of its body, as there.
//
// A join of one pin keeps W = X^-1 Y; its rank is in doubt where that of a path's is. One of
// several is solved by loop_solver.h and is in doubt where the general sweep (joins.h) finds it so.
// In doubt, Evaluate() gives up, and the general sweep decides.
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
  /// Along `plan`, which need not outlive it, no more than the mechanism. Null for other
  /// mechanisms, and where the general sweep has less to multiply, as with many pins on one body.
  static std::unique_ptr<AssemblySweep> Make(const Mechanism<Planar, double>& mechanism,
                                             const Plan& plan);

  bool Evaluate(SpeedsUsed speeds, Kinematics<Planar, double>* kinematics,
                std::span<const double> q, std::span<const double> u, std::span<double> qdot,
                std::span<double> udot) override;
  std::optional<Correction<double>> Project(std::span<double> q, std::span<double> u,
                                            double goal) override;
  bool Serves(const Kinematics<Planar, double>& kinematics) override;
  long operations() const override { return operations_; }

 private:
  using Vector = Vector2<double>;
  using Matrix = Matrix2<double>;

  struct Body {
    Link<double> link;  ///< its arms are those of handles
    int first_handle = 0, handles = 0;
    int first_block = 0;  ///< of zeta
    Vector stand = {};    ///< where the point of reference stands still, if it does
    Vector centre = {};   ///< of mass, from the point of reference, in axes of the body
  };
  /// What forces other than gravity do to a body alone.
  struct Applied {
    Vector a = {};       ///< acceleration of the point of reference
    double alpha = 0.0;  ///< sqrt(I) times angular acceleration
  };
  /// A joint of the tree between two bodies: where the child stands.
  struct Step {
    int parent = 0, child = 0;                ///< bodies
    int parent_handle = 0, child_handle = 0;  ///< where they meet
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
    double limit = 0.0;            ///< least response of one pin, or pivot; 0 where no loop closes
  };

  /// Which mismatch stands in CutJoint::v, as in path_sweep.h.
  enum class Gaps { kSpeeds, kPositions };

  AssemblySweep() = default;
  struct Layout;

  /// Bodies at moved angles. False for angles beyond kLargestAngle.
  template <Gaps kGaps>
  bool Turn();
  template <Gaps kGaps>
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
  /// alpha_, or what is to be added to speeds.
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

  std::vector<double> angle_, speed_, alpha_;  ///< by body, Ground's last, and what fills lanes
  std::vector<double> sine_, cosine_;          ///< likewise
  std::vector<Vector> arm_;                    ///< of handles, in ground axes, by radius
  std::vector<Applied> applied_;               ///< of bodies; none where only gravity acts
  std::vector<Wrench<Planar, double>> wrenches_;
  std::vector<Point<double>> reference_;  ///< of bodies
  std::vector<Matrix> zeta_, W_, Y_;
  std::vector<double> V_;
  std::vector<Factored2<double>> factors_;
  std::vector<LoopSolver<double>> loops_;
  MatrixX<double> X_;
  std::vector<Vector> b_, F_;  ///< by slot: handles of bodies first, then those of nodes
  std::vector<double> s_, phi_;
  std::vector<double> moved_, back_, speeds_;  ///< as in path_sweep.h
  TreeAngles<double> tree_;
  std::unique_ptr<WorkerPool> pool_ = std::make_unique<WorkerPool>(1);
  long of_matrices_ = 0, of_vectors_ = 0, operations_ = 0;
};

}  // namespace loopbench::odca::pins
