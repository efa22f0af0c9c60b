// O-DCA for planar mechanisms of revolute joints (pins) with branches: trees, several loops on one
// body, grids, and for all with forces other than gravity. Computes rates directly from joint
// coordinates and speeds, like path_sweep.h for paths, along an assembly tree (plan.h).
//
//   angles and speeds of bodies   along the spanning tree (tree_angles.h)
//   violations of cut joints      along the same tree
//   up, matrices                  zeta of each body, then X, W and zeta of each join
//   up and down, vectors          zeta_i3, then forces: once, or twice where speeds are completed
//
// A handle is a joint side that is still open, with the two rows of a pin's D (two_handle.h). A
// body has as many handles as pins, and Y (67) is a row of blocks of zeta. A tree pin on Ground is
// a property of its body, not a joint of an assembly, as in two_handle.h.
//
// A join factors X = L D L^T, two rows of one pin at a time. It keeps L and W = D^-1 L^-1 Y. The
// rank of a pin that closes a loop is uncertain under the condition for paths. Evaluate() then
// stops, and the general pass decides.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "mechanism/model/mechanism.h"
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
  bool IsUsable(const Kinematics<Planar, double>& kinematics) override;

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
    int place = -1;   ///< among its handles; -1: Ground
    int handle = -1;  ///< in handles_
  };
  struct Pin {
    Side P, Q;
    int cut = -1;        ///< in cuts_
    double limit = 0.0;  ///< least response; 0 if it closes no loop
  };
  /// A join. Children's zeta are blocks by columns.
  struct Node {
    int blocks[2] = {0, 0}, handles[2] = {0, 0};  ///< first block and number of handles of each
    int first_pin = 0, pins = 0;
    int first_kept = 0, kept = 0;  ///< in kept_
    int first_block = 0;           ///< of its own zeta
    int matrix = 0;                ///< first number of W_
  };

  AssemblySweep() = default;
  struct Layout;

  /// Bodies at moved angles. False for angles beyond kLargestAngle.
  template <GapKind kGap>
  bool Turn();
  template <GapKind kGap>
  void Close();
  /// Matrices of all assemblies. False near a degenerate position.
  bool Assemble();
  Symmetric2<double> Across(const Node& node, const Pin& pin) const;
  Matrix ResponseAt(const Node& node, const Pin& pin, const Side& at) const;
  template <class Rows>
  bool Join(const Node& node, Rows rows);
  template <class Rows>
  void Eliminate(const Node& node, Rows rows);
  /// applied_ at the positions and speeds of `kinematics`.
  void SetApplied(const Kinematics<Planar, double>& kinematics);
  /// Computes alpha_, or corrections of speeds.
  template <Pass kPass>
  void Solve();
  template <Pass kPass, class Rows>
  void Up(const Node& node, Rows rows);
  template <class Rows>
  void Down(const Node& node, Rows rows);
  bool Place(GapKind kind, std::span<const double> q, std::span<const double> u) override;
  Correction<double> LargestGap() const override;
  bool FindChange(GapKind kind) override;
  bool AddChange(std::span<const double> base, std::span<double> sum) override;

  std::vector<Body> bodies_;
  std::vector<Vector> handles_;  ///< arms by radius in axes of the body, body after body
  std::vector<Step> steps_;
  std::vector<CutJoint> cuts_;
  std::vector<Node> nodes_;
  std::vector<Pin> pins_;
  std::vector<Side> kept_;

  std::vector<double> angle_, speed_, alpha_;  ///< by body, Ground's last, then padding of lanes
  std::vector<double> sine_, cosine_;          ///< as in the line above
  std::vector<Vector> arm_;                    ///< of handles, in ground axes, over radius
  std::vector<Applied> applied_;               ///< by body; empty if only gravity acts
  std::vector<Wrench<Planar, double>> wrenches_;
  std::vector<Point<double>> reference_;  ///< of bodies
  std::vector<Matrix> zeta_;
  /// Two columns for each handle that stays, then of L^T for each pin if there are several. A
  /// column has two numbers for each pin. U_ = L^-1 Y of one join has the same columns.
  std::vector<double> W_, U_;
  std::vector<Factored2<double>> factors_;  ///< D, by pin
  std::vector<Vector> b_, F_;               ///< by handle: a join changes those that stay
  std::vector<double> s_;                   ///< two for each pin; in the downward pass phi
  TreeAngles<double> tree_;
  std::unique_ptr<WorkerPool> pool_ = std::make_unique<WorkerPool>(1);
  long of_matrices_ = 0, of_vectors_ = 0;
};

}  // namespace loopbench::odca::pins
