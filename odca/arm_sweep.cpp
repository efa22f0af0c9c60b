// O-DCA for spatial mechanisms whose bodies form arms of revolute joints under gravity: computes
// rates directly from joint coordinates and speeds, in the kernels of revolutes.h.
//
// An arm is a sequence of bodies that hangs from Ground by joints of the spanning tree. Its last
// body is free, or a cut joint connects it to another arm's last body or to Ground: an open path is
// one arm, a closed one is two, or one with both ends on Ground.
//
//   passages   along the pieces of arms: transforms of axes, speeds and points
//   starts     along each arm: where its pieces begin, and the single bodies
//   up, down   chain_sweep.h, with the pieces of all arms in groups
//   closings   two arms by their cut joint, in between
#include <algorithm>
#include <cmath>
#include <utility>

#include "mechanism/loops/loop_solver.h"
#include "odca/arm_links.h"
#include "odca/chain_sweep.h"

namespace loopbench::odca::arms {

namespace {

using V3 = Linear<Spatial, double>;

/// Shorter pieces are no faster than one body after another.
constexpr int kShortestPiece = 2;

/// Places that a thread takes at once.
constexpr int kPart = 1024;
static_assert(kPart % kLanes == 0);

/// X += C zeta C^T, rows of C being forces on the handle.
template <int n>
void AddResponse(const Symmetric<double, kAll>& zeta, const double (&C)[n][kAll],
                 Symmetric<double, n>& X) {
  for (int a = 0; a < n; ++a) {
    double response[kAll] = {};
    LOOPBENCH_UNROLL
    for (int i = 0; i < kAll; ++i) {
      LOOPBENCH_UNROLL
      for (int j = 0; j < kAll; ++j) response[i] += (j <= i ? zeta(i, j) : zeta(j, i)) * C[a][j];
    }
    for (int b = a; b < n; ++b) {
      double sum = X(b, a);
      LOOPBENCH_UNROLL
      for (int i = 0; i < kAll; ++i) sum += C[b][i] * response[i];
      X(b, a) = sum;
    }
  }
}

/// The end of an arm at its handle 2, in axes there. Ground has no response.
struct ClosingSide {
  Pose<Spatial, double> pose;  ///< of its axes in Ground
  Velocity<Spatial, double> V = Velocity<Spatial, double>::Zero();
  OneHandle<double, kAll> assembly = {};
  const Symmetric<double, kAll>* alone = nullptr;  ///< zeta22 of the last body; null for Ground
  double F2[kAll] = {};                            ///< is set: the force on it
};

/// A cut joint between the ends of two arms, or of one and Ground. It is imposed at one point, the
/// origin Mo of the frame on its body Q, along axes of the frame on its body P (joint.h). Its sides
/// may have drifted apart, so both ends have all six components. Quantities equal those of
/// mechanism/model/kinematics.cpp and sweep.cpp, in axes of P.
class Closing {
 public:
  /// Rejects a response across the joint with an eigenvalue below `limit` relative to the response
  /// of its two bodies alone.
  Closing(const ArmClosing& joint, double limit) : joint_(joint), limit_(limit) {}

  /// Sets the poses of the sides; `largest` becomes this joint's violation if that is larger.
  void Place(const ClosingSide& P, const ClosingSide& Q, Correction<double>* largest) {
    const Pose<Spatial, double> X_FM = Compose(Inverse(P.pose), Q.pose);
    from_P_ = {Rotation<Spatial, double>::Identity(), X_FM.p};
    from_Q_ = {X_FM.R, V3::Zero()};
    V_P_ = ShiftMotion<Spatial, double>(P.V, X_FM.p);
    V_rel_ = Rotate<Spatial, double>(X_FM.R, Q.V) - V_P_;
    if (largest == nullptr) return;
    mismatch_ = Mismatch(joint_.kind, X_FM);
    auto constrained = Direction<Spatial, double>::Zero();
    for (int i = 0; i < joint_.rows(); ++i) {
      constrained += joint_.D(i) * joint_.D(i).dot(mismatch_);
    }
    largest->rotation = std::max(largest->rotation, constrained.angular.norm());
    largest->shift = std::max(largest->shift, constrained.linear.norm());
  }

  /// Computes forces on both sides. Negative if the joint may be degenerate.
  template <Unknowns kUnknowns>
  double Close(ClosingSide& P, ClosingSide& Q) const {
    return WithSize<double, 1, 2, 3, 4, 5, 6>(joint_.rows(), [&](auto rows) {
      return CloseRows<kUnknowns, std::max(1, kKnownSize<decltype(rows)>)>(P, Q);
    });
  }

 private:
  /// Transform from axes and origin of a side to axes of P and Mo.
  struct Way {
    Rotation<Spatial, double> R;
    V3 e;  ///< Mo from the side's origin, in axes of P

    template <class Kind>
    SpatialVector<Spatial, double, Kind> Of(const double* rows) const {
      const SpatialVector<Spatial, double, Kind> motion(V3(rows[0], rows[1], rows[5]),
                                                        V3(rows[2], rows[3], rows[4]));
      return ShiftMotion<Spatial, double>(Rotate<Spatial, double>(R, motion), e);
    }
    /// A force at Mo as one on the side, in its rows.
    void Back(const Wrench<Spatial, double>& F, double* rows) const {
      const auto on_side =
          Rotate<Spatial, double>(R.transpose(), ShiftForce<Spatial, double>(F, e));
      constexpr int kComponent[kAll] = {0, 1, 3, 4, 5, 2};
      for (int i = 0; i < kAll; ++i) rows[i] = on_side[kComponent[i]];
    }
  };

  /// Returns A_Q - A_P besides H udot, less its value without a force in the joint.
  template <Unknowns kUnknowns>
  Acceleration<Spatial, double> Missing(const ClosingSide& P, const ClosingSide& Q) const {
    if constexpr (kUnknowns == Unknowns::kAccelerations) {
      const V3& w = V_P_.angular;
      const Acceleration<Spatial, double> g(w.cross(V_rel_.angular), 2.0 * w.cross(V_rel_.linear));
      auto A_P = from_P_.Of<AccelerationKind>(P.assembly.zeta23);
      A_P.linear += w.cross(w.cross(from_P_.e));
      return g + A_P - from_Q_.Of<AccelerationKind>(Q.assembly.zeta23);  // (7)
    } else {
      const auto& V = kUnknowns == Unknowns::kSpeeds ? V_rel_ : mismatch_;
      return {-V.angular, -V.linear};
    }
  }

  /// X = D^T (S zeta S^T of both) D as (16), or one of them at Ground (33, 34). The least
  /// eigenvalue of X over X_alone is at least 1 / tr(X^-1 X_alone).
  template <Unknowns kUnknowns, int n>
  double CloseRows(ClosingSide& P, ClosingSide& Q) const {
    Factors<double, n> X = {};
    Symmetric<double, n> X_alone = {};
    for (const auto& [side, way] : {std::pair(&P, &from_P_), std::pair(&Q, &from_Q_)}) {
      if (side->alone == nullptr) continue;
      double C[n][kAll];
      for (int a = 0; a < n; ++a) way->Back(joint_.D(a), C[a]);
      AddResponse(side->assembly.zeta22, C, X.L);
      AddResponse(*side->alone, C, X_alone);
    }
    double slack = 1.0, phi[n], trace = 0.0;
    Factor(X, slack);
    const Acceleration<Spatial, double> missing = Missing<kUnknowns>(P, Q);
    for (int a = 0; a < n; ++a) phi[a] = joint_.D(a).dot(missing);
    X.Solve(phi);
    auto force = Direction<Spatial, double>::Zero();
    for (int a = 0; a < n; ++a) force += joint_.D(a) * phi[a];  // (13)
    from_Q_.Back(force, Q.F2);
    from_P_.Back(-force, P.F2);
    for (int a = 0; a < n; ++a) {
      double column[n];
      for (int b = 0; b < n; ++b) column[b] = b < a ? X_alone(a, b) : X_alone(b, a);
      X.Solve(column);
      trace += column[a];
    }
    return Min(slack, 1.0 - limit_ * trace);
  }

  ArmClosing joint_;
  double limit_;
  Way from_P_, from_Q_;
  Velocity<Spatial, double> V_P_, V_rel_, mismatch_;  ///< at Mo
};

/// Bodies of an arm that may be in pieces: the tip of a closed one is asked for more.
int Inner(const Arm& arm) {
  return static_cast<int>(arm.bodies.size()) - (arm.closing >= 0 ? 1 : 0);
}

struct Pieces {
  int length = 0, groups = 0;
};
/// The longest pieces that, in full groups, hold most of the bodies; else those that hold as many
/// as can be. No fewer groups than are asked for, if there are any.
Pieces ChoosePieces(const std::vector<Arm>& arms, int groups) {
  int bodies = 0, most = 0;
  for (const Arm& arm : arms) bodies += Inner(arm);
  Pieces best;
  for (int length = bodies / (groups * kLanes); length >= kShortestPiece; --length) {
    int pieces = 0;
    for (const Arm& arm : arms) pieces += Inner(arm) / length;
    const int held = pieces / kLanes * kLanes * length;
    if (held <= most) continue;
    most = held;
    best = {length, pieces / kLanes};
    if (8 * held >= 7 * bodies) break;
  }
  return best;
}

/// Sets the rows of forces of an acceleration.
void SetRise(const GroundSide& ground, double* zeta23) {
  for (int i = 0; i < 3; ++i) zeta23[2 + i] = ground.rise[i];
}

struct ArmKind {
  static constexpr int kRows = arms::kRows;
  static constexpr bool kBeginsFree = false;
  template <class T>
  using Link = arms::Link<T>;

  template <class T>
  struct OfChain : ChainNodes {
    int tip = -1;          ///< in tips_, -1 for an open arm
    T ground[kRows] = {};  ///< zeta23 of Ground at its first joint
  };
  struct OfGroup {
    Passage<Lanes> passage;
    Vector3<Lanes> w;  ///< in the body before the first ones, in its axes
    Lanes about2;      ///< of their last bodies
  };
};

class ArmSweep final : public ChainSweep<ArmSweep, ArmKind, Spatial, double> {
  friend ChainSweep;

 public:
  static std::unique_ptr<ArmSweep> Make(const Mechanism<Spatial, double>& mechanism, int threads,
                                        int bodies_of_group) {
    const Arms arms = FindArms(mechanism);
    if (arms.arms.empty()) return nullptr;
    std::unique_ptr<ArmSweep> sweep(new ArmSweep);
    sweep->num_u_ = mechanism.num_u();
    sweep->Lay(arms, bodies_of_group);
    const int useful = static_cast<int>(sweep->groups_.size());
    sweep->SetSize(sweep->num_u_, mechanism.length(), std::clamp(useful, 1, std::max(1, threads)));
    return sweep->IsUsableSomewhere() ? std::move(sweep) : nullptr;
  }

 private:
  /// A body at the end of a closed arm.
  struct TipState {
    Link<double> link;
    ArmTip constants;
    GroundSide ground;  ///< as of Arm
    Free<double> free;
    EndCut<double, kRows, kAll> cut;
    ClosingSide side;
  };
  struct PlacedClosing {
    Closing closing;
    int tip_P = -1, tip_Q = -1;  ///< in tips_, -1: Ground
    ClosingSide ground;
  };

  void Lay(const Arms& arms, int bodies_of_group) {
    const Pieces pieces = ChoosePieces(arms.arms, std::max(1, num_u_ / bodies_of_group));
    std::vector<Link<Lanes>> packs;
    for (const Arm& arm : arms.arms) {
      std::vector<Link<double>> links;
      for (int k = 0; k < Inner(arm); ++k) links.push_back(arm.bodies[k].link);
      const int left = pieces.groups * kLanes - num_pieces_;
      const int own = left > 0 ? std::min(left, Inner(arm) / pieces.length) : 0;
      Chain& chain = AddChain(links, own, pieces.length, packs);
      SetRise(arm.ground, chain.ground);
      if (arm.closing < 0) continue;
      chain.tip = static_cast<int>(tips_.size());
      TipState& tip = tips_.emplace_back();
      tip.link = arm.bodies.back().link;
      tip.constants = arm.tip;
      tip.ground = arm.ground;
    }
    EndChains();
    sign_.setZero((num_u_ + kLanes - 1) / kLanes * kLanes);
    angle_ = speed_ = sine_ = cosine_ = rate_ = sign_;
    index_.assign(static_cast<std::size_t>(sign_.size()), 0);
    in_range_.resize((index_.size() + kPart - 1) / kPart);
    for (std::size_t i = 0; i < chains_.size(); ++i) {
      for (int k = 0; k < static_cast<int>(arms.arms[i].bodies.size()); ++k) {
        const bool is_tip = k == Inner(arms.arms[i]);
        const int at = is_tip ? place_of_tip(chains_[i].tip) : place(chains_[i], k);
        index_[at] = arms.arms[i].bodies[k].u;
        sign_[at] = arms.arms[i].bodies[k].sign;
      }
    }
    about1_.resize(packs_.size());
    about2_.resize(packs_.size());
    free_.resize(singles_.size());
    end_about2_.resize(singles_.size());
    LayClosings(arms);
  }

  void LayClosings(const Arms& arms) {
    for (TipState& tip : tips_) tip.side.alone = &tip.constants.response.zeta22;
    for (const ArmClosing& joint : arms.closings) {
      int bodies = num_u_;
      const auto tip_of = [&](int arm) {
        if (arm < 0) return -1;
        bodies = std::min(bodies, static_cast<int>(arms.arms[arm].bodies.size()));
        return chains_[arm].tip;
      };
      const int P = tip_of(joint.arm_P), Q = tip_of(joint.arm_Q);
      const double limit = LoopSolver<double>::kSuspicious * ShareOfLimit(bodies);
      PlacedClosing& at = closings_.emplace_back(Closing(joint, limit), P, Q);
      at.ground.pose = joint.ground.pose;
      SetRise(joint.ground, at.ground.assembly.zeta23);
    }
    completes_speeds_ = !closings_.empty();
  }

  /// Returns true if Evaluate() accepts some position, even one far from closed. It accepts none if
  /// axes of loops are parallel or meet in a point, which reduces rank everywhere.
  bool IsUsableSomewhere() {
    constexpr int kTrials = 3;
    constexpr double kGoldenAngle = 2.399963229728653;
    if (closings_.empty()) return true;
    std::vector<double> q(num_u()), u(num_u()), qdot(num_u()), udot(num_u());
    for (int trial = 1; trial <= kTrials; ++trial) {
      for (int i = 0; i < num_u_; ++i) q[i] = std::remainder(kGoldenAngle * trial * (i + 1), 6.0);
      if (Evaluate(SpeedsUsed::kGiven, nullptr, q, u, qdot, udot)) return true;
    }
    return false;
  }

  bool Place(Unknowns unknowns, std::span<const double> q, std::span<const double> u) override {
    ForParts<kPart>(index_.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t place = first; place < last; ++place) {
        angle_[place] = sign_[place] * q[index_[place]];
        speed_[place] = sign_[place] * u[index_[place]];
      }
      in_range_[first / kPart] = SinesOfJoints(&angle_[first], static_cast<int>(last - first),
                                               &sine_[first], &cosine_[first]);
    });
    if (std::ranges::find(in_range_, 0) != in_range_.end()) return false;
    unknowns == Unknowns::kPositions ? Move<Unknowns::kPositions>()
    : unknowns == Unknowns::kSpeeds  ? Move<Unknowns::kSpeeds>()
                                     : Move<Unknowns::kAccelerations>();
    return true;
  }
  Correction<double> LargestGap() const override { return largest_; }
  bool Find(Unknowns unknowns) override {
    const bool good = unknowns == Unknowns::kPositions ? Solve<Unknowns::kPositions>()
                      : unknowns == Unknowns::kSpeeds  ? Solve<Unknowns::kSpeeds>()
                                                       : Solve<Unknowns::kAccelerations>();
    if (!good) return false;
    for (const Chain& arm : chains_) Finish(arm);
    operations_ += OperationsOfSweep();
    return true;
  }
  bool AddChange(std::span<const double> base, std::span<double> sum) override {
    ForParts<kPart>(static_cast<std::size_t>(num_u_), [&](std::size_t first, std::size_t last) {
      for (std::size_t place = first; place < last; ++place) {
        const int i = index_[place];
        const double own = sign_[place] * rate_[place];
        sum[i] = base.empty() ? own : base[i] + own;
      }
    });
    return (rate_.array() * 0.0 == 0.0).all();
  }
  void AddToSpeeds() override {
    speed_ += rate_;
    Move<Unknowns::kAccelerations>();
  }

  /// Computes poses of bodies and violations of cut joints, of positions if these are unknowns.
  template <Unknowns kUnknowns>
  void Move() {
    if (closings_.empty()) return MoveFollowing<kUnknowns, Follow::kSpeeds>();
    MoveFollowing<kUnknowns, Follow::kPoints>();
    Correction<double>* largest = kUnknowns == Unknowns::kPositions ? &(largest_ = {}) : nullptr;
    for (PlacedClosing& at : closings_) {
      at.closing.Place(Side(at, at.tip_P), Side(at, at.tip_Q), largest);
    }
  }
  template <Unknowns kUnknowns, Follow kFollow>
  void MoveFollowing() {
    constexpr Follow kInGroups = kFollow == Follow::kSpeeds ? Follow::kAxes : kFollow;
    pool_->ForEach(static_cast<int>(groups_.size()), [&](int g) { Travel<kInGroups>(groups_[g]); });
    for (const Chain& arm : chains_) MoveEnds<kUnknowns, kFollow>(arm);
  }

  /// Passages of the group's pieces.
  template <Follow kFollow>
  void Travel(Group& group) const {
    Passage<Lanes> along = NoPassage<Lanes>();
    for (int pack = group.pack; pack < group.pack + group.length; ++pack) {
      Pass<kFollow>(packs_[pack].shape, turns(pack * kLanes), Load<Lanes>(&speed_[pack * kLanes]),
                    along);
    }
    group.passage = along;
  }

  /// Computes the starts of pieces, free motions of single bodies, and the tip's pose and speed.
  template <Unknowns kUnknowns, Follow kFollow>
  void MoveEnds(const Chain& arm) {
    Passage<double> along = NoPassage<double>();
    for (int piece = arm.first_piece; piece < arm.first_piece + arm.pieces; ++piece) {
      Group& group = group_of(piece);
      for (int i = 0; i < 3; ++i) group.w[i][lane_of(piece)] = along.w[i];
      Pass<kFollow>(LaneOf(group.passage, lane_of(piece)), along);
    }
    for (int single = arm.first_single; single < arm.first_single + arm.singles; ++single) {
      const int place = packed_ + single;
      const Link<double>& link = singles_[single];
      const auto w = Pass<kFollow>(link.shape, turn(place), speed_[place], along);
      FreeMotion<kUnknowns>(link.shape, w, speed_[place], free_[single]);
    }
    if (arm.tip < 0) return;
    TipState& tip = tips_[arm.tip];
    const int place = place_of_tip(arm.tip);
    const auto w = Pass<Follow::kPoints>(tip.link.shape, turn(place), speed_[place], along);
    FreeMotion<kUnknowns>(tip.link.shape, w, speed_[place], tip.free);
    tip.side.pose = Compose(tip.ground.pose, {along.R.transpose(), along.p});
    tip.side.V = {along.w, along.v};
  }

  // steps of ChainSweep
  Passage<Lanes> MotionBefore(const Group& group) const {
    Passage<Lanes> along;  // of which only w is followed
    along.w = group.w;
    return along;
  }
  template <Unknowns kUnknowns>
  LOOPBENCH_INLINE Free<Lanes> FreeOfPack(int pack, Passage<Lanes>& along) {
    const Shape<Lanes>& shape = packs_[pack].shape;
    const Lanes speed = Load<Lanes>(&speed_[pack * kLanes]);
    const auto w = Pass<Follow::kSpeeds>(shape, turns(pack * kLanes), speed, along);
    Free<Lanes> free;
    FreeMotion<kUnknowns>(shape, w, speed, free);
    about1_[pack] = free.zeta13[kRows];
    about2_[pack] = free.zeta23[kRows];
    return free;
  }
  template <Unknowns kUnknowns>
  const Free<double>& FreeOfSingle(int single) const {
    return free_[single];
  }
  const auto& ResponseOfPack(int pack) const { return packs_[pack].response; }
  const auto& ResponseOfSingle(int single) const { return singles_[single].response; }
  void TurnToNext(int place, OneHandle<double, kRows>& all) const { TurnHandle(turn(place), all); }
  LOOPBENCH_INLINE void TurnToNext(int place, TwoHandle<Lanes, kRows>& all) const {
    TurnHandle(turns(place), all);
  }
  template <Unknowns kUnknowns>
  OneHandle<double, kRows> Start(const Chain& arm) const {
    OneHandle<double, kRows> ground = {};
    if (kUnknowns == Unknowns::kAccelerations) std::ranges::copy(arm.ground, ground.zeta23);
    return ground;
  }
  template <Unknowns kUnknowns>
  double End(const Chain& arm, OneHandle<double, kRows>& all, double slack) {
    if (arm.tip < 0) return slack;
    TipState& tip = tips_[arm.tip];
    TurnToNext(place_of_tip(arm.tip), all);
    tip.side.assembly = JoinSeries(all, tip.constants.response, tip.free.zeta13, tip.free.zeta23,
                                   0.0, tip.cut, slack);
    return slack;
  }
  template <Unknowns kUnknowns>
  double Close(double slack) {
    for (PlacedClosing& at : closings_) {
      slack = Min(slack, at.closing.Close<kUnknowns>(Side(at, at.tip_P), Side(at, at.tip_Q)));
    }
    return slack;
  }
  template <Unknowns kUnknowns>
  Force<double> EndForce(const Chain& arm) {
    if (arm.tip < 0) return {};
    const TipState& tip = tips_[arm.tip];
    const int place = place_of_tip(arm.tip);
    Force<double> F1;
    ForceIn(tip.cut, tip.side.F2, F1.at);
    rate_[place] =
        About(tip.free.zeta13[kRows], tip.link.about11, tip.constants.about12, F1.at, tip.side.F2);
    return Opposite(place, F1);
  }
  template <Unknowns kUnknowns>
  void RespondSingle(int single, const Force<double>& F1, const Force<double>& F2) {
    const Link<double>& link = singles_[single];
    const Free<double>& free = free_[single];
    rate_[packed_ + single] = About(free.zeta13[kRows], link.about11, link.about12, F1.at, F2.at);
    end_about2_[single] = About(free.zeta23[kRows], link.about21, link.about22, F1.at, F2.at);
  }
  template <Unknowns kUnknowns>
  void Respond(Group& group, int pack, const Force<Lanes>& F1, const Force<Lanes>& F2) {
    const Link<Lanes>& link = packs_[pack];
    const Lanes about2 = About(about2_[pack], link.about21, link.about22, F1.at, F2.at);
    double* rates = &rate_[pack * kLanes];
    if (pack + 1 == group.pack + group.length) {
      group.about2 = about2;
    } else {
      Store(Load<Lanes>(rates + kLanes) - about2, rates + kLanes);
    }
    Store(About(about1_[pack], link.about11, link.about12, F1.at, F2.at), rates);
  }
  template <class U>
  Force<U> Opposite(int place, const Force<U>& F1) const {
    Force<U> F2;
    if constexpr (std::is_same_v<U, double>) {
      OppositeBefore(turn(place), F1.at, F2.at);
    } else {
      OppositeBefore(turns(place), F1.at, F2.at);
    }
    return F2;
  }

  /// Subtracts at the first joint of each node the motion of the body before it.
  void Finish(const Chain& arm) {
    double before = 0.0;  // Ground
    for (int piece = arm.first_piece; piece < arm.first_piece + arm.pieces; ++piece) {
      rate_[place_of_piece(piece)] -= before;
      before = group_of(piece).about2[lane_of(piece)];
    }
    for (int single = arm.first_single; single < arm.first_single + arm.singles; ++single) {
      rate_[packed_ + single] -= before;
      before = end_about2_[single];
    }
    if (arm.tip >= 0) rate_[place_of_tip(arm.tip)] -= before;
  }

  /// As in the general sweep, without kinematics and zeta_i3.
  long OperationsOfSweep() const {
    using Work = Operations<kRows>;
    constexpr int kBoth = 2 * AboutWork(kRows) + kOppositeWork;
    constexpr int kInner = kTurnTwoWork + Work::kJoin + Work::kForceIn + kBoth;
    constexpr int kNode = kTurnOneWork + Work::EndJoin(kRows) + Work::ForceInEnd(kRows) + kBoth;
    constexpr int kTip = kTurnOneWork + Work::EndJoin(kAll) + Work::ForceInEnd(kAll) +
                         AboutWork(kAll) + kOppositeWork;
    const long singles = static_cast<long>(singles_.size()), tips = static_cast<long>(tips_.size());
    return (packed_ - num_pieces_) * static_cast<long>(kInner) + (num_pieces_ + singles) * kNode +
           tips * kTip;
  }

  int place_of_tip(int tip) const { return packed_ + static_cast<int>(singles_.size()) + tip; }
  ClosingSide& Side(PlacedClosing& at, int tip) { return tip < 0 ? at.ground : tips_[tip].side; }
  Turn<double> turn(int place) const { return {cosine_[place], sine_[place]}; }
  Turn<Lanes> turns(int place) const {
    return {Load<Lanes>(&cosine_[place]), Load<Lanes>(&sine_[place])};
  }

  int num_u_ = 0;
  std::vector<Lanes> about1_, about2_;  ///< of packs, without forces
  std::vector<Free<double>> free_;      ///< of singles
  std::vector<double> end_about2_;      ///< about axis 2 of singles
  std::vector<TipState> tips_;
  std::vector<PlacedClosing> closings_;
  std::vector<int> index_;  ///< of a place's joint in u; these lists end with padding of lanes
  VectorX<double> sign_, angle_, speed_, sine_, cosine_, rate_;  ///< by place
  std::vector<char> in_range_;                                   ///< by part of the places
  Correction<double> largest_;
};

}  // namespace

std::unique_ptr<ShortCut<Spatial>> MakeArmSweep(const Mechanism<Spatial, double>& mechanism,
                                                int threads, int bodies_of_group) {
  return ArmSweep::Make(mechanism, threads, bodies_of_group);
}

}  // namespace loopbench::odca::arms
