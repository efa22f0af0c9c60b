// Fast path of some mechanisms' right-hand sides and projections instead of the general pass.
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "mechanism/formulation/constraint_solver.h"

namespace loopbench::odca {

/// Violation of cut joints that a change of speeds removes: in each case J belongs to the current
/// poses.
enum class GapKind { kSpeeds, kPositions };

template <class Space>
class ShortCut {
 public:
  virtual ~ShortCut() = default;
  /// Evaluates like ConstraintSolver::RightHandSide(); `kinematics` may be null if only gravity
  /// acts. Returns false near a degenerate position, for angles beyond kLargestAngle, and if
  /// accelerations are not finite. Allocates nothing.
  virtual bool Evaluate(SpeedsUsed speeds, Kinematics<Space, double>* kinematics,
                        std::span<const double> q, std::span<const double> u,
                        std::span<double> qdot, std::span<double> udot) = 0;
  /// Projects like ConstraintSolver::Project() if loops are closed; nothing if Evaluate() is false.
  /// level.cpp does it by parts.
  std::optional<Correction<double>> Project(std::span<double> q, std::span<double> u, double goal) {
    const auto size = [&](const Correction<double>& gap) {
      return std::max(gap.rotation * length_, gap.shift);
    };
    operations_ = 0;
    std::ranges::copy(q, moved_.begin());
    std::ranges::copy(u, speeds_.begin());
    if (!Place(GapKind::kPositions, moved_, speeds_)) return std::nullopt;
    Correction<double> now = LargestGap(), correction = now;
    for (int i = 0; i < kMaxProjections && size(now) > goal; ++i) {
      if (!FindChange(GapKind::kPositions)) return std::nullopt;
      const double before = size(now);
      back_ = moved_;
      if (!AddChange(back_, moved_)) return std::nullopt;
      if (!Place(GapKind::kPositions, moved_, speeds_)) return std::nullopt;
      now = LargestGap();
      ++correction.iterations;
      if (size(now) < before) continue;
      moved_ = back_;  // round-off: as it was
      break;
    }
    if (!Place(GapKind::kSpeeds, moved_, speeds_)) return std::nullopt;
    if (!FindChange(GapKind::kSpeeds) || !AddChange(speeds_, speeds_)) return std::nullopt;
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

 protected:
  void SetSize(const Mechanism<Space, double>& mechanism) {
    moved_.assign(static_cast<std::size_t>(mechanism.num_u()), 0.0);
    back_ = speeds_ = moved_;
    length_ = mechanism.length();
  }
  /// Computes poses of bodies and violations of cut joints. Returns false for angles beyond
  /// kLargestAngle.
  virtual bool Place(GapKind kind, std::span<const double> q, std::span<const double> u) = 0;
  /// Returns the largest violations after Place() for positions.
  virtual Correction<double> LargestGap() const = 0;
  /// Finds the smallest change of speeds, in the metric of M, that removes the violations. Returns
  /// false near a degenerate position.
  virtual bool FindChange(GapKind kind) = 0;
  /// sum := base + change. Returns false if the change is not finite.
  virtual bool AddChange(std::span<const double> base, std::span<double> sum) = 0;

  long operations_ = 0;

 private:
  std::vector<double> moved_, back_, speeds_;  ///< of Project(): positions, those before, speeds
  double length_ = 1.0;                        ///< Mechanism::length(), for rotations
};

}  // namespace loopbench::odca
