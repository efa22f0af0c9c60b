#include "mechanism/simplify/release_choice.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <limits>
#include <numbers>

#include "mechanism/algebra/factors.h"
#include "mechanism/loops/row_choice.h"

namespace loopbench {

namespace {

/// What a choice costs that imposes some moments of a joint in space and not all: as much as the
/// largest amplification that a choice of forces along given axes was seen to have over a turn.
constexpr double kSomeMoments = 200.0;

/// And one that is lost somewhere between two of the positions. Where that cannot be helped, as at
/// singular positions of the mechanism itself, all choices cost as much.
constexpr double kLostBetween = 1e4;

/// Joints of many rows together would take minutes, and gain little.
constexpr std::size_t kMostRows = 40;

using Rows = std::vector<bool>;

/// Imposed rows at one position, one below the other.
Eigen::MatrixXd Imposed(const DirectionRows& at, const Rows& imposed) {
  Eigen::MatrixXd K(std::ranges::count(imposed, true), at.rows.cols());
  Eigen::Index k = 0;
  for (std::size_t r = 0; r < imposed.size(); ++r) {
    if (imposed[r]) K.row(k++) = at.rows.row(static_cast<Eigen::Index>(r));
  }
  return K;
}

/// Largest mismatch of a released direction per unit of the imposed ones (both scaled as rows), the
/// loops being as they are at one position: the released rows in terms of the imposed ones.
double Amplification(const DirectionRows& at, const Rows& imposed) {
  const Eigen::Index kept = std::ranges::count(imposed, true);
  if (kept == 0) return 0.0;
  const Eigen::MatrixXd K = Imposed(at, imposed);
  Rows rest = imposed;
  rest.flip();
  const Eigen::MatrixXd out = Imposed(at, rest);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(K.transpose());
  if (qr.rank() < kept) return std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd combined = qr.solve(Eigen::MatrixXd(out.transpose()));
  return combined.colwise().norm().maxCoeff();
}

/// Whether the imposed rows have another orientation in the space of all rows at the next position
/// of a walk: somewhere in between they do not span it.
bool IsLostBetween(const DirectionRows& at, const DirectionRows& next, const Rows& imposed) {
  const Eigen::MatrixXd mixed = Imposed(at, imposed) * Imposed(next, imposed).transpose();
  return mixed.determinant() < 0.0;
}

/// Mixes as many directions of constraint c, from `direction` on, as `axes` has columns: each
/// becomes the one along a column of this orthogonal matrix.
void Turn(DirectionRows& at, std::size_t c, int direction, const Eigen::MatrixXd& axes) {
  const Eigen::Index n = axes.rows(), first = at.first[c], count = at.count[c];
  Eigen::MatrixXd T = Eigen::MatrixXd::Identity(count, count);
  T.block(direction, direction, n, n) = axes.transpose();
  const Eigen::VectorXd before = at.free[c].diagonal().cwiseSqrt();
  const Eigen::MatrixXd turned = T * at.free[c];
  at.free[c].noalias() = turned * T.transpose();
  const Eigen::VectorXd after = at.free[c].diagonal().cwiseSqrt();
  const Eigen::MatrixXd scaled = after.cwiseInverse().asDiagonal() * T * before.asDiagonal();
  const Eigen::MatrixXd rows = at.rows.middleRows(first, count);
  at.rows.middleRows(first, count) = scaled * rows;
  const Eigen::VectorXd mismatch = at.mismatch.segment(first, count);
  at.mismatch.segment(first, count) = scaled * mismatch;
}

/// Every way to impose as many rows of first .. first + count - 1 as `imposed` does, the others as
/// they are.
std::vector<Rows> OtherChoices(const Rows& imposed, int first, int count) {
  const auto begin = imposed.begin() + first;
  const auto kept = std::count(begin, begin + count, true);
  std::vector<Rows> all;
  for (unsigned bits = 0; bits < (1u << count); ++bits) {
    if (std::popcount(bits) != kept) continue;
    Rows other = imposed;
    for (int i = 0; i < count; ++i) other[static_cast<std::size_t>(first + i)] = (bits >> i & 1u);
    all.push_back(std::move(other));
  }
  return all;
}

/// Axes of which the first points along n: the others do not matter, they are imposed or released
/// together.
Eigen::MatrixXd AxesAlong(const Eigen::VectorXd& n) {
  if (n.size() == 2) return Eigen::Rotation2Dd(std::atan2(n.y(), n.x())).toRotationMatrix();
  // the shortest turn that takes x there; Eigen's FromTwoVectors took 16 s to compile
  const Eigen::Vector3d to = n.normalized();
  // where all turns by half a circle are as short, that from the other side
  if (to.x() < -1.0 + 1e-12) return AxesAlong(-n) * Eigen::Vector3d(-1, -1, 1).asDiagonal();
  const double root = std::sqrt(2.0 * (1.0 + to.x())), inverse = 1.0 / root;
  return Eigen::Quaterniond(0.5 * root, 0.0, -to.z() * inverse, to.y() * inverse)
      .toRotationMatrix();
}

/// Directions all around, without their opposites: a spiral on the upper half of the sphere, or
/// the upper half of the circle. Some 7 degrees apart.
std::vector<Eigen::VectorXd> AllAround(int dimension) {
  std::vector<Eigen::VectorXd> all;
  if (dimension == 2) {
    for (int k = 0; k < 24; ++k) {
      const double angle = k * std::numbers::pi / 24;
      all.push_back(Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
    return all;
  }
  constexpr int kCount = 400;
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int k = 0; k < kCount; ++k) {
    const double z = (k + 0.5) / kCount, r = std::sqrt(1.0 - z * z);
    all.push_back(Eigen::Vector3d(r * std::cos(golden * k), r * std::sin(golden * k), z));
  }
  return all;
}

class Search {
 public:
  Search(const std::vector<DirectionRows>& positions, const std::vector<bool>& follows,
         const std::vector<Choosable>& joints, int rank)
      : positions_(positions),
        follows_(follows),
        joints_(joints),
        rank_(rank),
        imposed_(static_cast<std::size_t>(positions_.front().rows.rows()), true),
        force_axes_(joints.size(), Eigen::Matrix3d::Identity()) {}

  ReleaseChoice Run() {
    for (const DirectionRows& at : positions_) Consider(positions_, BestRows(at));
    if (imposed_.size() <= kMostRows) {
      while (ChangeRows() || TurnForces()) continue;
    }
    ReleaseChoice choice{{}, force_axes_};
    for (std::size_t c = 0; c < joints_.size(); ++c) {
      const auto first = imposed_.begin() + positions_.front().first[c];
      choice.imposed.emplace_back(first, first + joints_[c].count);
    }
    return choice;
  }

 private:
  int first(std::size_t c) const { return positions_.front().first[c]; }

  bool Allowed(const Rows& candidate) const {
    for (std::size_t c = 0; c < joints_.size(); ++c) {
      for (int i = 0; joints_[c].keeps_all && i < joints_[c].count; ++i) {
        if (!candidate[static_cast<std::size_t>(first(c) + i)]) return false;
      }
    }
    return true;
  }

  bool ImposesSomeMoments(const Rows& candidate) const {
    for (std::size_t c = 0; c < joints_.size(); ++c) {
      const auto imposed = std::ranges::count_if(joints_[c].moments, [&](int direction) {
        return candidate[static_cast<std::size_t>(first(c) + direction)];
      });
      if (imposed > 0 && imposed < std::ssize(joints_[c].moments)) return true;
    }
    return false;
  }

  /// The rows of one position that differ most from each other, those of joints that keep all
  /// first.
  Rows BestRows(const DirectionRows& at) const {
    const int all = static_cast<int>(at.rows.rows());
    RowChoice choice(at.rows, {Quota{0, all, 0, all}});
    for (std::size_t c = 0; c < joints_.size(); ++c) {
      for (int i = 0; joints_[c].keeps_all && i < joints_[c].count; ++i) {
        choice.Take(0, first(c) + i);
      }
    }
    choice.TakeBest(rank_, [](int) { return true; });
    return choice.taken();
  }

  /// Takes a choice of rows, at positions whose forces may be turned, if it is better than the best
  /// so far by more than rounding, which must not decide between equals.
  bool Consider(const std::vector<DirectionRows>& positions, const Rows& candidate) {
    constexpr double kBetter = 1.0 - 1e-6;
    if (!Allowed(candidate)) return false;
    const double cost = ImposesSomeMoments(candidate) ? kSomeMoments : 1.0;
    const double limit = least_ * kBetter;
    // where the last candidate failed this one will fail, too
    double worst = cost * Amplification(positions[hardest_], candidate);
    for (std::size_t p = 0; p < positions.size() && worst < limit; ++p) {
      const double here = cost * Amplification(positions[p], candidate);
      if (!(here < limit)) hardest_ = p;
      worst = std::max(worst, here);
    }
    for (std::size_t p = 1; p < positions.size() && worst < limit; ++p) {
      if (follows_[p] && IsLostBetween(positions[p - 1], positions[p], candidate)) {
        worst *= kLostBetween;
      }
    }
    if (!(worst < limit)) return false;
    least_ = worst;
    imposed_ = candidate;
    return true;
  }

  /// Joint by joint and row for row, along the axes as they are. True when that helped.
  bool ChangeRows() {
    bool helped = false;
    for (bool better = true; better;) {
      better = false;
      for (std::size_t c = 0; c < joints_.size(); ++c) {
        for (const Rows& other : OtherChoices(imposed_, first(c), joints_[c].count)) {
          better = Consider(positions_, other) || better;
        }
      }
      for (std::size_t in = 0; in < imposed_.size(); ++in) {
        for (std::size_t out = 0; out < imposed_.size(); ++out) {
          if (imposed_[in] || !imposed_[out]) continue;
          Rows other = imposed_;
          other[in] = true;
          other[out] = false;
          better = Consider(positions_, other) || better;
        }
      }
      helped = helped || better;
    }
    return helped;
  }

  /// The forces of each joint along other axes: all around, then closer and closer to the best.
  bool TurnForces() {
    bool helped = false;
    for (std::size_t c = 0; c < joints_.size(); ++c) {
      if (joints_[c].first_force < 0 || joints_[c].keeps_all) continue;
      const int n = joints_[c].num_forces;
      Eigen::VectorXd best = Eigen::VectorXd::Unit(n, 0);
      bool turned = false;
      const auto look = [&](const Eigen::VectorXd& along) {
        if (!Turned(c, AxesAlong(along))) return;
        best = along;
        turned = true;
      };
      for (const Eigen::VectorXd& along : AllAround(n)) look(along);
      for (double step = 0.06; turned && step > 0.005; step *= 0.5) {
        for (int axis = 0; axis < n; ++axis) {
          for (const double sign : {-1.0, 1.0}) {
            look((best + sign * step * Eigen::VectorXd::Unit(n, axis)).normalized());
          }
        }
      }
      if (!turned) continue;
      const Eigen::MatrixXd axes = AxesAlong(best);
      for (DirectionRows& at : positions_) Turn(at, c, joints_[c].first_force, axes);
      force_axes_[c].topLeftCorner(n, n) *= axes;
      helped = true;
    }
    return helped;
  }

  /// Whether forces of joint c along `axes` (in those that it has) serve better, whichever of its
  /// rows are then imposed.
  bool Turned(std::size_t c, const Eigen::MatrixXd& axes) {
    std::vector<DirectionRows> positions = positions_;
    for (DirectionRows& at : positions) Turn(at, c, joints_[c].first_force, axes);
    bool better = false;
    for (const Rows& other : OtherChoices(imposed_, first(c), joints_[c].count)) {
      better = Consider(positions, other) || better;
    }
    return better;
  }

  std::vector<DirectionRows> positions_;
  const std::vector<bool>& follows_;
  const std::vector<Choosable>& joints_;
  int rank_;
  double least_ = std::numeric_limits<double>::infinity();
  std::size_t hardest_ = 0;  ///< where the last candidate that failed did
  Rows imposed_;
  std::vector<Eigen::Matrix3d> force_axes_;
};

}  // namespace

template <class Space>
Choosable ChoiceOf(const JointKind<Space, double>& kind) {
  Choosable joint;
  joint.count = kind.num_constraints();
  int first_force = -1;
  for (int i = 0; i < joint.count; ++i) {
    const bool moment = kind.axes[kind.num_u + i] < Space::kRot;
    if (moment && Space::kRot == 3) joint.moments.push_back(i);
    if (moment) continue;
    if (first_force < 0) first_force = i;
    ++joint.num_forces;
  }
  // directions that are no axes have moments in them that no axes turn
  if (joint.num_forces == Space::kLin && kind.basis == nullptr) joint.first_force = first_force;
  return joint;
}

template Choosable ChoiceOf(const JointKind<Planar, double>&);
template Choosable ChoiceOf(const JointKind<Spatial, double>&);

ReleaseChoice ChooseImposed(const std::vector<DirectionRows>& positions,
                            const std::vector<bool>& follows, const std::vector<Choosable>& joints,
                            int rank) {
  return Search(positions, follows, joints, rank).Run();
}

}  // namespace loopbench
