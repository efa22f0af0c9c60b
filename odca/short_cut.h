// Fast paths of some mechanisms' right-hand sides and projections instead of the general sweep:
// planar paths of pins (path_sweep.cpp), planar assemblies of pins (assembly_sweep.cpp), spatial
// arms of revolute joints (arm_sweep.cpp).
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "mechanism/algebra/lanes.h"
#include "mechanism/algebra/worker_pool.h"
#include "mechanism/formulation/constraint_solver.h"
#include "mechanism/formulation/side_by_side.h"
#include "odca/plan.h"

namespace loopbench::odca {

/// Unknowns of a sweep, and how it finds them.
enum class Unknowns {
  kAccelerations,  ///< from speeds as they are
  kCompleted,      ///< accelerations after kSpeeds: no cut joint has a relative velocity
  kSpeeds,         ///< the smallest change of speeds, in the metric of M, that closes the loops
  kPositions,      ///< position corrections, as speeds in unit time
};

/// Computes sines and cosines of `count` angles [rad], a multiple of kLanes. Returns false if an
/// angle is beyond kLargestAngle or NaN.
LOOPBENCH_INLINE bool SinesAndCosines(const double* angles, int count, double* sines,
                                      double* cosines) {
  Lanes room = Lanes{} + kLargestAngle;
  for (int i = 0; i < count; i += kLanes) {
    const Lanes angle = Load<Lanes>(angles + i);
    room = Min(room, kLargestAngle - Magnitude(angle));
    Lanes s, c;
    SinCos(angle, s, c);
    Store(s, sines + i);
    Store(c, cosines + i);
  }
  return Smallest(room) >= 0.0;
}

/// Fast path of one mechanism (T = double), or of several in lanes (T = Lanes).
template <class Space, class T = double>
class ShortCut {
 public:
  virtual ~ShortCut() = default;
  /// Evaluates like ConstraintSolver::RightHandSide(), for each lane; `kinematics` may be null if
  /// only gravity acts. Returns false near a degenerate position, for angles beyond kLargestAngle,
  /// and if accelerations are not finite. Allocates nothing.
  TruthOf<T> Evaluate(SpeedsUsed speeds, Kinematics<Space, double>* kinematics,
                      std::span<const T> q, std::span<const T> u, std::span<T> qdot,
                      std::span<T> udot) {
    const bool completes = speeds == SpeedsUsed::kCompleted && completes_speeds_;
    operations_ = 0;
    TruthOf<T> good = Place(completes ? Unknowns::kSpeeds : Unknowns::kAccelerations, q, u);
    if (!Any(good)) return good;
    if (completes) {
      good &= Find(Unknowns::kSpeeds);
      if (!Any(good)) return good;
      good &= AddChange(u, qdot);
      AddToSpeeds();
    } else {
      ForParts<4096>(u.size(), [&](std::size_t first, std::size_t last) {
        std::copy(u.begin() + first, u.begin() + last, qdot.begin() + first);
      });
    }
    if (!Any(good)) return good;
    if (kinematics != nullptr) TakeForces(*kinematics, q, qdot);
    good &= Find(completes ? Unknowns::kCompleted : Unknowns::kAccelerations);
    if (!Any(good)) return good;
    return good & AddChange({}, udot);
  }
  /// Projects like ConstraintSolver::Project() if loops are closed; nothing if Evaluate() is false.
  /// level.cpp does it by parts.
  std::optional<Correction<double>> Project(std::span<double> q, std::span<double> u, double goal) {
    const auto size = [&](const Correction<double>& gap) {
      return std::max(gap.rotation * length_, gap.shift);
    };
    operations_ = 0;
    std::ranges::copy(q, moved_.begin());
    std::ranges::copy(u, speeds_.begin());
    if (!Place(Unknowns::kPositions, moved_, speeds_)) return std::nullopt;
    Correction<double> now = LargestGap(), correction = now;
    for (int i = 0; i < kMaxProjections && size(now) > goal; ++i) {
      if (!Find(Unknowns::kPositions)) return std::nullopt;
      const double before = size(now);
      back_ = moved_;
      if (!AddChange(back_, moved_)) return std::nullopt;
      if (!Place(Unknowns::kPositions, moved_, speeds_)) return std::nullopt;
      now = LargestGap();
      ++correction.iterations;
      if (size(now) < before) continue;
      moved_ = back_;  // round-off: as it was
      break;
    }
    if (!Place(Unknowns::kSpeeds, moved_, speeds_)) return std::nullopt;
    if (!Find(Unknowns::kSpeeds) || !AddChange(speeds_, speeds_)) return std::nullopt;
    std::ranges::copy(moved_, q.begin());
    std::ranges::copy(speeds_, u.begin());
    return correction;
  }
  /// Returns true if Evaluate() should be tried in a run that starts at these positions. It would
  /// fail each time if constraints are redundant everywhere.
  virtual bool IsUsable(const Kinematics<Space, double>& /*kinematics*/) { return true; }
  /// Returns the multiply-adds of the last evaluation, or of its completed part.
  long operations() const { return operations_; }
  std::size_t num_u() const { return moved_.size(); }
  int threads() const { return pool_->threads(); }

 protected:
  void SetSize(std::size_t num_u, double length, int threads) {
    moved_.assign(num_u, T{});
    back_ = speeds_ = moved_;
    length_ = length;
    pool_ = std::make_unique<WorkerPool>(threads);
  }
  /// Calls part(first, last) for parts of `size` numbers; threads share these.
  template <int kPart>
  void ForParts(std::size_t size, const auto& part) {
    pool_->ForEach(static_cast<int>((size + kPart - 1) / kPart), [&](int i) {
      const auto first = static_cast<std::size_t>(i) * kPart;
      part(first, std::min(first + kPart, size));
    });
  }
  /// Computes poses of bodies and violations of cut joints, of positions for Unknowns::kPositions.
  /// Returns false for angles beyond kLargestAngle.
  virtual TruthOf<T> Place(Unknowns unknowns, std::span<const T> q, std::span<const T> u) = 0;
  /// Returns the largest violations after Place() for positions.
  virtual Correction<double> LargestGap() const = 0;
  /// Finds accelerations or a change. Returns false near a degenerate position.
  virtual TruthOf<T> Find(Unknowns unknowns) = 0;
  /// sum := base (zero if empty) + what was found. Returns false if that is not finite.
  virtual TruthOf<T> AddChange(std::span<const T> base, std::span<T> sum) = 0;
  /// Adds the change to the speeds of bodies.
  virtual void AddToSpeeds() = 0;
  /// Computes forces other than gravity.
  virtual void TakeForces(Kinematics<Space, double>&, std::span<const T> /*q*/,
                          std::span<const T> /*u*/) {}

  bool completes_speeds_ = true;  ///< false if no loops are closed
  long operations_ = 0;
  std::unique_ptr<WorkerPool> pool_;

 private:
  std::vector<T> moved_, back_, speeds_;  ///< of Project(): positions, those before, speeds
  double length_ = 1.0;                   ///< Mechanism::length(), for rotations
};

namespace pins {

/// Enough work for a thread to wait for the others after it.
inline constexpr int kBodiesOfGroup = 2048;

/// Returns null if bodies are no paths of pins under gravity, or MeasurePath() fails for a path.
/// The mechanism need not outlive the sweep. Up to `threads` threads work on it, one for every
/// `bodies_of_group` bodies.
std::unique_ptr<ShortCut<Planar>> MakePathSweep(const Mechanism<Planar, double>& mechanism,
                                                int threads = 1,
                                                int bodies_of_group = kBodiesOfGroup);

/// Returns lanes for mechanisms like that of `one`, a sweep along paths, whose constants are in
/// every lane; null if its own pieces fill the lanes.
std::unique_ptr<ShortCut<Planar, Lanes>> MakePathLanes(const ShortCut<Planar>& one);
/// Copies the constants of `one` into a lane. Returns false, without change, if its shape differs.
bool SetMechanism(ShortCut<Planar, Lanes>& lanes, int lane, const ShortCut<Planar>& one);

/// Fast path of batched runs: their pending right-hand sides are evaluated at once, a lane each.
/// The bits of a run do not depend on the other runs.
class PathLane {
 public:
  /// Reserves a lane for the mechanism of `own`, a sweep along paths, until destruction; `beside`
  /// must outlive it. Returns null if `own` fills the lanes alone.
  static std::unique_ptr<PathLane> Take(SideBySide& beside, const ShortCut<Planar>& own);
  ~PathLane();
  PathLane(const PathLane&) = delete;
  PathLane& operator=(const PathLane&) = delete;

  /// Evaluates like ShortCut::Evaluate(), once all runs have met.
  bool Evaluate(SpeedsUsed speeds, std::span<const double> q, std::span<const double> u,
                std::span<double> qdot, std::span<double> udot);

 private:
  struct Run;
  class All;
  PathLane(SideBySide& beside, Run& run) : beside_(beside), run_(run) {}

  SideBySide& beside_;
  Run& run_;
};

/// Returns a sweep along `plan`; neither plan nor mechanism need outlive it. Null for other
/// mechanisms than pins, and if the general sweep has fewer multiplications, as with many pins on
/// one body. Up to `threads` threads share the pieces of the plan.
std::unique_ptr<ShortCut<Planar>> MakeAssemblySweep(const Mechanism<Planar, double>& mechanism,
                                                    const Plan& plan, int threads = 1);

}  // namespace pins

namespace arms {

/// Enough work for a thread to wait for the others after it.
inline constexpr int kBodiesOfGroup = 1024;

/// Returns null if FindArms() finds none, or loops lose rank in every position. The mechanism need
/// not outlive the sweep. Up to `threads` threads work on it, one for every `bodies_of_group`
/// bodies.
std::unique_ptr<ShortCut<Spatial>> MakeArmSweep(const Mechanism<Spatial, double>& mechanism,
                                                int threads = 1,
                                                int bodies_of_group = kBodiesOfGroup);

}  // namespace arms

}  // namespace loopbench::odca
