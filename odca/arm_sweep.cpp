#include "odca/arm_sweep.h"

#include <algorithm>

namespace loopbench::odca::arms {

template <Follow kFollow>
void ArmSweep::Travel(Group& group) const {
  Passage<Lanes> along = NoPassage<Lanes>();
  for (int pack = group.pack; pack < group.pack + length_; ++pack) {
    const int place = pack * kLanes;
    const Turn<Lanes> turn = {Load<Lanes>(&cosine_[place]), Load<Lanes>(&sine_[place])};
    Pass<kFollow>(links_[pack].shape, turn, Load<Lanes>(&speed_[place]), along);
  }
  group.passage = along;
}

template <Sought kSought, Follow kFollow>
void ArmSweep::Start(const ArmPlaces& arm) {
  Passage<double> along = NoPassage<double>();
  for (int piece = arm.first_piece; piece < arm.first_piece + arm.pieces; ++piece) {
    Group& group = groups_[piece / kLanes];
    for (int i = 0; i < 3; ++i) group.w[i][piece % kLanes] = along.w[i];
    Pass<kFollow>(LaneOf(group.passage, piece % kLanes), along);
  }
  for (int single = arm.first_single; single < arm.first_single + arm.singles; ++single) {
    const int place = packed_ + single;
    const Link<double>& link = singles_[single];
    const auto w = Pass<kFollow>(link.shape, turn(place), speed_[place], along);
    FreeMotion<kSought>(link.shape, w, speed_[place], free_[single]);
  }
  if (arm.tip < 0) return;
  TipState& tip = tips_[arm.tip];
  const int place = place_of_tip(arm.tip);
  const auto w = Pass<Follow::kPoints>(tip.link.shape, turn(place), speed_[place], along);
  Free<double> free;
  FreeMotion<kSought>(tip.link.shape, w, speed_[place], free);
  std::ranges::copy(free.zeta13, tip.zeta13);
  std::ranges::copy(free.zeta23, tip.zeta23);
  tip.zeta23[kRows] = free.about2;
  tip.about1 = free.about1;
  tip.side.pose = Compose(tip.ground, {along.R.transpose(), along.p});
  tip.side.V = {along.w, along.v};
}

template <Sought kSought>
void ArmSweep::Up(Group& group) {
  Lanes slack = {};
  Passage<Lanes> along;  // of which only w is followed
  along.w = group.w;
  Free<Lanes> free;
  for (int pack = group.pack; pack < group.pack + length_; ++pack) {
    const int place = pack * kLanes;
    const Link<Lanes>& link = links_[pack];
    const Turn<Lanes> turn = {Load<Lanes>(&cosine_[place]), Load<Lanes>(&sine_[place])};
    const Lanes speed = Load<Lanes>(&speed_[place]);
    const auto w = Pass<Follow::kSpeeds>(link.shape, turn, speed, along);
    FreeMotion<kSought>(link.shape, w, speed, free);
    about1_[pack] = free.about1;
    about2_[pack] = free.about2;
    if (pack == group.pack) {
      group.assemblies.response = link.response;
      std::ranges::copy(free.zeta13, group.assemblies.zeta13);
      std::ranges::copy(free.zeta23, group.assemblies.zeta23);
    } else {
      Join(group.assemblies, turn, link.response, free, cuts_[pack], slack);
    }
  }
  group.slack = Smallest(slack);
}

double ArmSweep::Up(const ArmPlaces& arm, bool has_weight) {
  OneHandle<double> all = {};
  if (has_weight) std::ranges::copy(arm.ground, all.zeta23);
  double slack = 0.0;
  for (int piece = arm.first_piece; piece < arm.first_piece + arm.pieces; ++piece) {
    const Group& group = groups_[piece / kLanes];
    slack = Min(slack, group.slack);
    const Piece<double> next = LaneOf(group.assemblies, piece % kLanes);
    all = Join(all, turn(place_of_piece(piece)), next.response, next.zeta13, next.zeta23,
               end_cuts_[piece], slack);
  }
  for (int single = arm.first_single; single < arm.first_single + arm.singles; ++single) {
    const Free<double>& free = free_[single];
    all = Join(all, turn(packed_ + single), singles_[single].response, free.zeta13, free.zeta23,
               end_cuts_[num_pieces_ + single], slack);
  }
  if (arm.tip >= 0) {
    TipState& tip = tips_[arm.tip];
    tip.side.assembly = Join(all, turn(place_of_tip(arm.tip)), tip.constants.response, tip.zeta13,
                             tip.zeta23, tip.cut, slack);
  }
  return slack;
}

void ArmSweep::Down(const ArmPlaces& arm) {
  double F1[kRows], F2[kRows] = {};
  if (arm.tip >= 0) {
    const TipState& tip = tips_[arm.tip];
    const int place = place_of_tip(arm.tip);
    ForceIn(tip.cut, tip.side.F2, F1);
    rate_[place] = About(tip.about1, tip.link.about11, tip.constants.about12, F1, tip.side.F2);
    OppositeBefore(turn(place), F1, F2);
  }
  for (int single = arm.first_single + arm.singles - 1; single >= arm.first_single; --single) {
    const int node = num_pieces_ + single, place = packed_ + single;
    const Link<double>& link = singles_[single];
    const Free<double>& free = free_[single];
    ForceIn(end_cuts_[node], F2, F1);
    rate_[place] = About(free.about1, link.about11, link.about12, F1, F2);
    end_about2_[node] = About(free.about2, link.about21, link.about22, F1, F2);
    OppositeBefore(turn(place), F1, F2);
  }
  for (int piece = arm.first_piece + arm.pieces - 1; piece >= arm.first_piece; --piece) {
    Group& group = groups_[piece / kLanes];
    ForceIn(end_cuts_[piece], F2, F1);
    for (int i = 0; i < kRows; ++i) {
      group.F1[i][piece % kLanes] = F1[i];
      group.F2[i][piece % kLanes] = F2[i];
    }
    OppositeBefore(turn(place_of_piece(piece)), F1, F2);
  }
}

void ArmSweep::Down(Group& group) {
  Lanes F1[kRows], F2[kRows], after = {};
  std::ranges::copy(group.F2, F2);
  for (int pack = group.pack + length_ - 1; pack >= group.pack; --pack) {
    const int place = pack * kLanes;
    const Link<Lanes>& link = links_[pack];
    if (pack == group.pack) {
      std::ranges::copy(group.F1, F1);
    } else {
      ForceIn(cuts_[pack], link.response.zeta12, group.F1, F2, F1);
    }
    const Lanes about2 = About(about2_[pack], link.about21, link.about22, F1, F2);
    if (pack == group.pack + length_ - 1) {
      group.about2 = about2;
    } else {
      Store(after - about2, &rate_[place + kLanes]);
    }
    after = About(about1_[pack], link.about11, link.about12, F1, F2);
    OppositeBefore(Turn<Lanes>{Load<Lanes>(&cosine_[place]), Load<Lanes>(&sine_[place])}, F1, F2);
  }
  Store(after, &rate_[group.pack * kLanes]);
}

void ArmSweep::Finish(const ArmPlaces& arm) {
  double before = 0.0;  // Ground
  for (int piece = arm.first_piece; piece < arm.first_piece + arm.pieces; ++piece) {
    rate_[place_of_piece(piece)] -= before;
    before = groups_[piece / kLanes].about2[piece % kLanes];
  }
  for (int single = arm.first_single; single < arm.first_single + arm.singles; ++single) {
    rate_[packed_ + single] -= before;
    before = end_about2_[num_pieces_ + single];
  }
  if (arm.tip >= 0) rate_[place_of_tip(arm.tip)] -= before;
}

template <Sought kSought, Follow kFollow>
void ArmSweep::MoveFollowing() {
  constexpr Follow kInGroups = kFollow == Follow::kSpeeds ? Follow::kAxes : kFollow;
  pool_->ForEach(static_cast<int>(groups_.size()), [&](int g) { Travel<kInGroups>(groups_[g]); });
  for (const ArmPlaces& arm : arms_) Start<kSought, kFollow>(arm);
}

template <Sought kSought>
void ArmSweep::Move() {
  if (closings_.empty()) return MoveFollowing<kSought, Follow::kSpeeds>();
  MoveFollowing<kSought, Follow::kPoints>();
  Correction<double>* largest = kSought == Sought::kPositions ? &(largest_ = {}) : nullptr;
  for (PlacedClosing& at : closings_) {
    at.closing.Place(Side(at, at.tip_P), Side(at, at.tip_Q), largest);
  }
}

/// As in the general sweep, without kinematics and zeta_i3.
long ArmSweep::OperationsOfSweep() const {
  constexpr int kBoth = 2 * Operations::About(kRows) + Operations::kOpposite;
  constexpr int kInner = Operations::kJoin + Operations::kForceIn + kBoth;
  constexpr int kNode = Operations::EndJoin(kRows) + Operations::ForceInEnd(kRows);
  constexpr int kTip = Operations::EndJoin(kAll) + Operations::ForceInEnd(kAll) +
                       Operations::About(kAll) + Operations::kOpposite;
  const long singles = static_cast<long>(singles_.size()), tips = static_cast<long>(tips_.size());
  return (packed_ - num_pieces_) * static_cast<long>(kInner) +
         num_pieces_ * static_cast<long>(kNode + kBoth) + singles * (kNode + kBoth) + tips * kTip;
}

template <Sought kSought>
bool ArmSweep::Solve() {
  const int groups = static_cast<int>(groups_.size());
  pool_->ForEach(groups, [&](int g) { Up<kSought>(groups_[g]); });
  double slack = 0.0;
  for (const ArmPlaces& arm : arms_) {
    slack = Min(slack, Up(arm, kSought == Sought::kAccelerations));
  }
  for (PlacedClosing& at : closings_) {
    slack = Min(slack, at.closing.Close<kSought>(Side(at, at.tip_P), Side(at, at.tip_Q)));
  }
  if (!(slack >= 0.0)) return false;
  for (const ArmPlaces& arm : arms_) Down(arm);
  pool_->ForEach(groups, [&](int g) { Down(groups_[g]); });
  for (const ArmPlaces& arm : arms_) Finish(arm);
  operations_ += OperationsOfSweep();
  return true;
}

bool ArmSweep::Evaluate(SpeedsUsed speeds, Kinematics<Spatial, double>*, std::span<const double> q,
                        std::span<const double> u, std::span<double> qdot, std::span<double> udot) {
  operations_ = 0;
  if (!TakeIn(q, u)) return false;
  if (speeds == SpeedsUsed::kCompleted && !closings_.empty()) {
    Move<Sought::kSpeeds>();
    if (!Solve<Sought::kSpeeds>()) return false;
    speed_ += rate_;
    PutOut(speed_, {}, qdot);
  } else {
    std::ranges::copy(u, qdot.begin());
  }
  Move<Sought::kAccelerations>();
  if (!Solve<Sought::kAccelerations>()) return false;
  PutOut(rate_, {}, udot);
  return IsFinite();
}

bool ArmSweep::Place(GapKind kind, std::span<const double> q, std::span<const double> u) {
  if (!TakeIn(q, u)) return false;
  kind == GapKind::kSpeeds ? Move<Sought::kSpeeds>() : Move<Sought::kPositions>();
  return true;
}

bool ArmSweep::FindChange(GapKind kind) {
  return kind == GapKind::kSpeeds ? Solve<Sought::kSpeeds>() : Solve<Sought::kPositions>();
}

bool ArmSweep::AddChange(std::span<const double> base, std::span<double> sum) {
  PutOut(rate_, base, sum);
  return IsFinite();
}

}  // namespace loopbench::odca::arms
