// O-DCA for spatial mechanisms whose bodies form arms of revolute joints under gravity: computes
// rates directly from joint coordinates and speeds, in the kernels of revolute_handles.h.
//
// An arm is a sequence of bodies that hangs from Ground by joints of the spanning tree. Its last
// body is free, or a cut joint connects it to another arm's last body or to Ground: an open path is
// one arm, a closed one is two, or one with both ends on Ground.
//
//   passages   arms are cut into pieces of equal length, of which kLanes are a group, side by side;
//              their transforms of axes, speeds and points
//   starts     along each arm: where its pieces begin, and the few bodies that are left over
//   up         the bodies of a piece are joined one after another, pieces of a group side by side;
//              then the pieces of an arm and the bodies left over, one after another
//   closings   two arms by their cut joint (arm_closing.cpp)
//   down       the same the other way round
//
// Threads share groups. Results depend on the mechanism alone, never on the number of threads.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "mechanism/algebra/worker_pool.h"
#include "mechanism/formulation/constraint_solver.h"
#include "odca/arm_links.h"
#include "odca/pack_kinds.h"
#include "odca/short_cut.h"

namespace loopbench::odca::arms {

class ArmSweep final : public ShortCut<Spatial> {
 public:
  /// Enough work for a thread to wait for the others after it.
  static constexpr int kBodiesOfGroup = 1024;

  /// Returns null if FindArms() finds none, or loops lose rank in every position. The mechanism
  /// need not outlive the sweep. Up to `threads` threads work on it, one for every
  /// `bodies_of_group` bodies.
  static std::unique_ptr<ArmSweep> Make(const Mechanism<Spatial, double>& mechanism,
                                        int threads = 1, int bodies_of_group = kBodiesOfGroup);

  bool Evaluate(SpeedsUsed speeds, Kinematics<Spatial, double>*, std::span<const double> q,
                std::span<const double> u, std::span<double> qdot, std::span<double> udot) override;
  int threads() const { return pool_->threads(); }

 private:
  /// kLanes pieces side by side.
  struct Group {
    int pack = 0;  ///< first pack; its first body has slot pack * kLanes
    Passage<Lanes> passage;
    Vector3<Lanes> w;  ///< in the body before the first ones, in its axes
    Piece<Lanes> assemblies;
    Lanes F1[kRows], F2[kRows];  ///< on these
    Lanes about2;                ///< of their last bodies
    double slack = 0.0;
  };
  /// An arm's places in the lists. Pieces, then single bodies, then the tip of a closed one are
  /// its nodes.
  struct ArmPlaces {
    int first_piece = 0, pieces = 0;
    int first_single = 0, singles = 0;
    int tip = -1;               ///< in tips_, -1 for an open arm
    double ground[kRows] = {};  ///< zeta23 of Ground at its first joint
  };
  /// A body at the end of a closed arm.
  struct TipState {
    Link<double> link;
    ArmTip constants;
    Pose<Spatial, double> ground;  ///< as of Arm
    double zeta13[kRows], zeta23[kAll], about1 = 0.0;
    EndCut<double, kAll> cut;
    ClosingSide side;
  };
  struct PlacedClosing {
    Closing closing;
    int tip_P = -1, tip_Q = -1;  ///< in tips_, -1: Ground
    ClosingSide ground;
  };
  ArmSweep() = default;
  void Lay(const Arms& arms, int bodies_of_group);
  /// From `piece` on, which becomes the next one.
  void LayInner(const Arm& arm, int& piece, std::vector<Link<Lanes>>& packs, ArmPlaces& places);
  void SetPlace(int place, const ArmBody& body);
  void LayClosings(const Arms& arms);
  /// Returns true if Evaluate() accepts some position, even one far from closed. It accepts none if
  /// axes of loops are parallel or meet in a point, which reduces rank everywhere.
  bool IsUsableSomewhere();

  /// Angles and speeds by place. False for angles beyond kLargestAngle.
  bool TakeIn(std::span<const double> q, std::span<const double> u);
  /// sign times these numbers by place, in the order of u, plus `base` if it is not empty.
  void PutOut(const VectorX<double>& of_places, std::span<const double> base, std::span<double> to);

  /// Computes poses of bodies and violations of cut joints, of positions if these are sought.
  template <Sought kSought>
  void Move();
  template <Sought kSought, Follow kFollow>
  void MoveFollowing();
  /// Computes rate_ afterwards. Returns false near a degenerate position.
  template <Sought kSought>
  bool Solve();
  bool Place(GapKind kind, std::span<const double> q, std::span<const double> u) override;
  Correction<double> LargestGap() const override { return largest_; }
  bool FindChange(GapKind kind) override;
  bool AddChange(std::span<const double> base, std::span<double> sum) override;
  /// Passages of the group's pieces.
  template <Follow kFollow>
  void Travel(Group& group) const;
  /// Computes the starts of pieces, free motions of single bodies, and the tip's pose and speed.
  template <Sought kSought, Follow kFollow>
  void Start(const ArmPlaces& arm);
  template <Sought kSought>
  void Up(Group& group);
  /// Joins the nodes of an arm; returns the least slack of all its joins.
  double Up(const ArmPlaces& arm, bool has_weight);
  void Down(const ArmPlaces& arm);
  void Down(Group& group);
  /// Subtracts at the first joint of each node the motion of the body before it.
  void Finish(const ArmPlaces& arm);

  int place_of_piece(int piece) const { return piece / kLanes * length_ * kLanes + piece % kLanes; }
  int place_of_tip(int tip) const { return packed_ + static_cast<int>(singles_.size()) + tip; }
  ClosingSide& Side(PlacedClosing& at, int tip) { return tip < 0 ? at.ground : tips_[tip].side; }
  long OperationsOfSweep() const;
  bool IsFinite() const { return (rate_.array() * 0.0 == 0.0).all(); }
  Turn<double> turn(int place) const { return {cosine_[place], sine_[place]}; }

  int length_ = 0;  ///< bodies of a piece
  int num_pieces_ = 0;
  int packed_ = 0;  ///< bodies in pieces
  int num_u_ = 0;
  std::vector<ArmPlaces> arms_;
  std::vector<Group> groups_;
  PackKinds<Link> links_;  ///< by pack
  std::vector<Cut<Lanes>> cuts_;
  std::vector<Lanes> about1_, about2_;    ///< of packs, without forces
  std::vector<EndCut<double>> end_cuts_;  ///< of pieces, then of singles
  std::vector<Link<double>> singles_;
  std::vector<Free<double>> free_;  ///< of singles
  std::vector<double> end_about2_;  ///< about axis 2 of the last body, of pieces, then of singles
  std::vector<TipState> tips_;
  std::vector<PlacedClosing> closings_;
  std::vector<int> index_;  ///< of a place's joint in u; these lists end with padding of lanes
  VectorX<double> sign_, angle_, speed_, sine_, cosine_, rate_;  ///< by place
  std::vector<char> in_range_;                                   ///< by part of the places
  Correction<double> largest_;
  std::unique_ptr<WorkerPool> pool_;
};

}  // namespace loopbench::odca::arms
