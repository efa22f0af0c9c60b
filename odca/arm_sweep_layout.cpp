// Layout of an ArmSweep: slots of bodies in its lists, their constants, and gather and scatter of
// numbers.
#include <algorithm>
#include <cmath>
#include <utility>

#include "mechanism/loops/loop_solver.h"
#include "odca/arm_sweep.h"
#include "odca/sines.h"

namespace loopbench::odca::arms {

namespace {

/// Shorter pieces are no faster than one body after another.
constexpr int kShortestPiece = 2;

/// Places that a thread takes at once.
constexpr int kPart = 1024;
static_assert(kPart % kLanes == 0);

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

/// Sets the acceleration of a side on Ground relative to gravity: rows of forces.
void SetRise(const Pose<Spatial, double>& side, const Linear<Spatial, double>& gravity,
             double* zeta23) {
  const Linear<Spatial, double> rise = -(side.R.transpose() * gravity);
  for (int i = 0; i < 3; ++i) zeta23[2 + i] = rise[i];
}

}  // namespace

std::unique_ptr<ArmSweep> ArmSweep::Make(const Mechanism<Spatial, double>& mechanism, int threads,
                                         int bodies_of_group) {
  const Arms arms = FindArms(mechanism);
  if (arms.arms.empty()) return nullptr;
  std::unique_ptr<ArmSweep> sweep(new ArmSweep);
  sweep->num_u_ = mechanism.num_u();
  sweep->SetSize(mechanism);
  sweep->Lay(arms, bodies_of_group);
  const int useful = static_cast<int>(sweep->groups_.size());
  sweep->pool_ = std::make_unique<WorkerPool>(std::clamp(useful, 1, std::max(1, threads)));
  return sweep->IsUsableSomewhere() ? std::move(sweep) : nullptr;
}

bool ArmSweep::IsUsableSomewhere() {
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

void ArmSweep::Lay(const Arms& arms, int bodies_of_group) {
  const Pieces pieces = ChoosePieces(arms.arms, std::max(1, num_u_ / bodies_of_group));
  length_ = pieces.length;
  num_pieces_ = pieces.groups * kLanes;
  packed_ = num_pieces_ * length_;
  sign_.setZero((num_u_ + kLanes - 1) / kLanes * kLanes);
  angle_ = speed_ = sine_ = cosine_ = rate_ = sign_;
  index_.assign(static_cast<std::size_t>(sign_.size()), 0);
  in_range_.resize((index_.size() + kPart - 1) / kPart);
  std::vector<Link<Lanes>> packs(packed_ / kLanes);
  int piece = 0;
  for (const Arm& arm : arms.arms) {
    ArmPlaces& places = arms_.emplace_back();
    SetRise(arm.ground, arms.gravity, places.ground);
    LayInner(arm, piece, packs, places);
  }
  for (std::size_t i = 0; i < arms_.size(); ++i) {
    const Arm& arm = arms.arms[i];
    if (arm.closing < 0) continue;
    arms_[i].tip = static_cast<int>(tips_.size());
    TipState& tip = tips_.emplace_back();
    tip.link = arm.bodies.back().link;
    tip.constants = arm.tip;
    tip.ground = arm.ground;
    SetPlace(place_of_tip(arms_[i].tip), arm.bodies.back());
  }
  for (const Link<Lanes>& pack : packs) links_.Add(pack);
  groups_.resize(pieces.groups);
  for (std::size_t g = 0; g < groups_.size(); ++g) groups_[g].pack = static_cast<int>(g) * length_;
  cuts_.resize(packs.size());
  about1_.resize(packs.size());
  about2_.resize(packs.size());
  free_.resize(singles_.size());
  end_cuts_.resize(num_pieces_ + singles_.size());
  end_about2_.resize(end_cuts_.size());
  LayClosings(arms);
}

/// Bodies into pieces as long as there are any left to fill, and those left over behind all pieces.
void ArmSweep::LayInner(const Arm& arm, int& piece, std::vector<Link<Lanes>>& packs,
                        ArmPlaces& places) {
  places.first_piece = piece;
  places.first_single = static_cast<int>(singles_.size());
  const ArmBody* body = arm.bodies.data();
  const ArmBody* end = body + Inner(arm);
  for (; piece < num_pieces_ && end - body >= length_; ++piece) {
    for (int i = 0; i < length_; ++i, ++body) {
      const int place = place_of_piece(piece) + i * kLanes;
      SetPlace(place, *body);
      SetLane(packs[place / kLanes], piece % kLanes, body->link);
    }
  }
  for (; body != end; ++body) {
    SetPlace(packed_ + static_cast<int>(singles_.size()), *body);
    singles_.push_back(body->link);
  }
  places.pieces = piece - places.first_piece;
  places.singles = static_cast<int>(singles_.size()) - places.first_single;
}

void ArmSweep::SetPlace(int place, const ArmBody& body) {
  index_[place] = body.u;
  sign_[place] = body.sign;
}

void ArmSweep::LayClosings(const Arms& arms) {
  for (TipState& tip : tips_) tip.side.alone = &tip.constants.response.zeta22;
  for (const ArmClosing& joint : arms.closings) {
    int bodies = num_u_;
    const auto tip_of = [&](int arm) {
      if (arm < 0) return -1;
      bodies = std::min(bodies, static_cast<int>(arms.arms[arm].bodies.size()));
      return arms_[arm].tip;
    };
    const int P = tip_of(joint.arm_P), Q = tip_of(joint.arm_Q);
    const double limit = LoopSolver<double>::kSuspicious * ShareOfLimit(bodies);
    PlacedClosing& at = closings_.emplace_back(Closing(joint, limit), P, Q);
    at.ground.pose = joint.ground;
    SetRise(joint.ground, arms.gravity, at.ground.assembly.zeta23);
  }
}

bool ArmSweep::TakeIn(std::span<const double> q, std::span<const double> u) {
  pool_->ForEach(static_cast<int>(in_range_.size()), [&](int part) {
    const int first = part * kPart, last = std::min(static_cast<int>(index_.size()), first + kPart);
    for (int place = first; place < last; ++place) {
      angle_[place] = sign_[place] * q[index_[place]];
      speed_[place] = sign_[place] * u[index_[place]];
    }
    in_range_[part] = SinesAndCosines(&angle_[first], last - first, &sine_[first], &cosine_[first]);
  });
  return std::ranges::find(in_range_, 0) == in_range_.end();
}

void ArmSweep::PutOut(const VectorX<double>& of_places, std::span<const double> base,
                      std::span<double> to) {
  pool_->ForEach(static_cast<int>(in_range_.size()), [&](int part) {
    const int last = std::min(num_u_, (part + 1) * kPart);
    for (int place = part * kPart; place < last; ++place) {
      const int i = index_[place];
      const double own = sign_[place] * of_places[place];
      to[i] = base.empty() ? own : base[i] + own;
    }
  });
}

}  // namespace loopbench::odca::arms
