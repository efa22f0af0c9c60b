#include "mechanism/start/closure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace loopbench {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kMaxIterations = 200;
/// Positions whose guesses are all missed by less [rad or lengths] are taken for the nearest.
constexpr double kNear = 0.1;
/// If the drawn position closes within the accuracy of the input, with a gap e, exact closures
/// within this times sqrt(2 e) [rad or lengths] are taken instead. A loop that opens by x^2 / 2
/// after a small motion x closes again within sqrt(2 e); the factor is a margin for several loops.
/// Some rounded redundant constraints close exactly far away only, or nowhere.
constexpr double kDrawn = 7.0;
/// Least damping where rounded loops close within the accuracy only. Along a free motion a gap
/// changes by its own size, 1e-5 at most: a step moves by 1e-5^2 / kStayDamping^2 = 1e-6. Steps
/// that reduce the residual by less than kSlow end the iteration.
constexpr double kStayDamping = 1e-2, kSlow = 0.1;

/// The search ends when so many starts in a row have found nothing nearer: a branch that every
/// fourth start leads to is missed by one search in 1e6. Positions count as nearer beyond round-off
/// of their distance, which the end of the iteration leaves.
constexpr int kStarts = 48;
constexpr double kNearer = 1e-6;
/// Work after which no further start is tried, about a second, and after which the last one is
/// given up; of a step, of an entry of J, and of a product in J J^T.
constexpr double kMaxWork = 1e6, kLastWork = 1e8;
constexpr double kWorkOfStep = 10.0, kWorkOfEntry = 1.0, kWorkOfProduct = 0.02;
/// Values of mu, and iterations at each; iterations of a closure from the last.
constexpr double kPulls[] = {1.0, 0.3, 0.1, 0.03, 0.01};
constexpr int kPullIterations = 8, kTrialIterations = 40;
/// Longest step of the search [rad or lengths]: linearised loops mean nothing further away.
constexpr double kLongestStep = 0.5;
/// Weight of changes of a coordinate without a guess; of a guessed one it is 1.
constexpr double kFree = 0.03;
/// The last steps along the closed positions to the nearest one: their mu, their number, and the
/// least step [rad or lengths] and decrease of the squared distance that are worth it. Where no
/// motion is free, nothing is nearer and the position stays as it is.
constexpr double kLastPull = 1e-3, kLeastStep = 1e-4, kLeastDecrease = 1e-6;
constexpr int kLastSteps = 30;

template <class Space>
class Closure {
  using Vector = VectorX<double>;

 public:
  Closure(const MechanismDescription& description, Kinematics<Space, double>& kinematics,
          const AssemblyUnits<Space>& units, const Vector& guess)
      : description_(description),
        mechanism_(kinematics.mechanism()),
        kinematics_(kinematics),
        units_(units),
        guesses_(description, mechanism_, units),
        guess_(guess),
        sizes_(FindSizes()),
        pull_units_(units) {
    // round-off of a closure that passes through every body
    const double eps = std::numeric_limits<double>::epsilon(), extent = Extent(mechanism_, units);
    goal_ = 16 * eps * extent;
    // A thousand times the goal is far below any drift worth measuring. Along many joints angles up
    // to pi add up with eps pi / 2 each, which turns all that is outward: no closure is known
    // better.
    closed_ = std::max(1e3 * goal_, kPi * eps * Depth() * extent);
    for (int i = 0; i < mechanism_.num_u(); ++i) {
      pull_units_.columns[i] /= guesses_.guessed()[i] ? guesses_.weights()[i] : kFree;
    }
  }

  void Run(Start<double>* start) {
    Vector q = guess_, e = Residual(q);
    if (e.size() > 0 || HasTargets()) {
      const bool is_drawn =
          IsRounded(e) && !HasTargets() && guesses_.Farthest(kinematics_) <= kNear;
      const double near_drawn = kDrawn * std::sqrt(2.0 * e.template lpNorm<Eigen::Infinity>());
      bool closed = Close(kMaxIterations, &q, &e);
      const bool has_left =
          is_drawn && guesses_.Apart(q).template lpNorm<Eigen::Infinity>() > near_drawn;
      Place(q);
      if (has_left || (!closed && IsRounded(e))) {
        q = guess_;
        e = Residual(q);
        closed = Close(kMaxIterations, &q, &e, /*stays=*/true);
        Place(q);
      }
      const bool is_rounded = !closed && IsRounded(e);
      Vector nearest = q;
      if (closed) Unwind(&nearest);
      Place(nearest);
      const bool near = (closed || is_rounded) &&
                        guesses_.Farthest(kinematics_) <= (HasTargets() ? closed_ : kNear);
      const bool free = std::ranges::find(guesses_.fixed(), false) != guesses_.fixed().end();
      if (!near && free && Search(closed, &nearest)) closed = true;
      if ((closed || is_rounded) && free) Approach(!closed, &nearest);
      e = Residual(closed || is_rounded ? q = nearest : q);
      const Vector row_units = units_.With(kinematics_, guesses_.held());
      if (e.size() > 0) start->position_residual = InSi(e, row_units);
      closed = closed || IsRounded(e);
      if (!closed) {
        start->outcome = Outcome::kInconsistentStart;
        start->message = mechanism_.name() + ": " +
                         DescribeConflict(description_, kinematics_,
                                          {e, row_units, false, guesses_.held(), AccuracyOf(e)});
      }
    }
    start->q = q;
  }

 private:
  /// Returns true if guesses of joints without constraints attract the start (poses.h).
  bool HasTargets() const {
    return std::ranges::any_of(guesses_.loose(), [&](const OfCutJoint& coordinate) {
      return mechanism_.joints()[coordinate.joint].num_directions() == 0;
    });
  }

  bool IsRounded(const Vector& e) const { return AccuracyOf(e) <= description_.accuracy; }

  /// Returns the accuracy of the input within which a residual is closed: in rad, or relative to
  /// the sizes of the bodies that close the loops.
  double AccuracyOf(const Vector& e) const {
    Vector most = Vector::Zero(e.size());
    for (int index : mechanism_.constraints()) {
      const Joint<Space, double>& joint = mechanism_.joints()[index];
      const JointState<Space, double>& state = kinematics_.joints()[index];
      const double size = std::max(
          {sizes_[joint.from], sizes_[joint.to], joint.kind->parameter});  // length of a rod
      for (int i = 0; i < joint.num_constraints(); ++i) {
        const bool turns = state.D(i).angular.squaredNorm() > 0.0;
        most[joint.row + i] = (turns ? 1.0 : std::min(mechanism_.length(), size) / units_.length);
      }
    }
    most.segment(mechanism_.num_rows(), mechanism_.couplings().size()).setOnes();
    return e.size() == 0 ? 0.0 : ((e.cwiseAbs().array() - closed_) / most.array()).maxCoeff();
  }

  /// Sizes of bodies: twice the largest distance of a joint from the middle of the body's joints.
  std::vector<double> FindSizes() const {
    using Point = Linear<Space, double>;
    const auto bodies = static_cast<std::size_t>(mechanism_.num_bodies());
    std::vector<Point> middles(bodies, Point::Zero());
    std::vector<double> counts(bodies, 0.0), sizes(bodies, 0.0);
    for (const Joint<Space, double>& joint : mechanism_.joints()) {
      for (const auto& [body, point] :
           {std::pair{joint.from, joint.X_PF.p}, std::pair{joint.to, joint.X_QM.p}}) {
        middles[body] += (point - middles[body]) / ++counts[body];
      }
    }
    for (const Joint<Space, double>& joint : mechanism_.joints()) {
      for (const auto& [body, point] :
           {std::pair{joint.from, joint.X_PF.p}, std::pair{joint.to, joint.X_QM.p}}) {
        sizes[body] = std::max(sizes[body], 2.0 * (point - middles[body]).norm());
      }
    }
    return sizes;
  }

  void Place(const Vector& q) {
    if (kinematics_.q() != q) kinematics_.UpdatePosition(q);
  }

  /// Returns e in units, with a row per fixed coordinate of a cut joint.
  Vector Residual(const Vector& q) {
    Place(q);
    const int rows_of_all = mechanism_.num_equations();
    Vector e(rows_of_all + static_cast<Eigen::Index>(guesses_.held().size()));
    for (int index : mechanism_.constraints()) {
      const Joint<Space, double>& joint = mechanism_.joints()[index];
      const int rows = joint.num_constraints();
      const Velocity<Space, double> mismatch = kinematics_.ConstraintMismatch(index);
      e.segment(joint.row, rows) = kinematics_.joints()[index].Along(mismatch, rows).head(rows);
    }
    for (int c = 0; c < static_cast<int>(mechanism_.couplings().size()); ++c) {
      e[mechanism_.num_rows() + c] = CouplingMismatch(c);
    }
    e.head(rows_of_all) = e.head(rows_of_all).cwiseQuotient(units_.rows);
    e.tail(guesses_.held().size()) = guesses_.HeldApart(kinematics_);
    return e;
  }

  /// Without whole turns of angles of cut joints, which System::Start() counts.
  double CouplingMismatch(int index) const {
    return mechanism_.couplings()[index].WithoutTurns(kinematics_.CouplingMismatch(index));
  }

  /// q moved by the speeds d, in units, for unit time (quaternions renormalised).
  Vector Move(const Vector& q, Vector d) const {
    ClearFixed(guesses_.fixed(), &d);
    return mechanism_.Moved(q, d.cwiseProduct(units_.columns));
  }

  /// Levenberg-Marquardt from q, with the residual e, to a closed position: whether it gets there.
  /// `stays`: or to one that closes within the accuracy, without moving along free motions.
  bool Close(int iterations, Vector* q, Vector* e, bool stays = false) {
    double damping = 1e-3;
    const VectorX<double> row_units = units_.With(kinematics_, guesses_.held());
    // where every coordinate is prescribed there is nothing to move
    if (mechanism_.num_u() == 0) iterations = 0;
    for (int i = 0; i < iterations && e->template lpNorm<Eigen::Infinity>() > goal_; ++i) {
      if (searching_ && work_ > kLastWork) break;
      Place(*q);
      LeastSquares steps =
          Solver(LoopRows(kinematics_, units_, row_units, guesses_.held(), guesses_.fixed()));
      bool improved = false, is_slow = false;
      for (; damping < 1e8 && !improved; damping *= 10) {
        const Vector trial = Move(*q, -steps.Damped(*e, damping));
        const Vector e_trial = Residual(trial);
        if (!(e_trial.norm() < e->norm())) continue;
        is_slow = stays && e_trial.norm() > (1.0 - kSlow) * e->norm() && IsRounded(e_trial);
        improved = true;
        *q = trial;
        *e = e_trial;
        damping *= 1e-3;  // the loop's own step multiplies by ten
      }
      if (!improved || is_slow) break;
      damping = std::max(damping, stays ? kStayDamping : 1e-16);
    }
    return e->template lpNorm<Eigen::Infinity>() <= closed_;
  }

  LeastSquares Solver(SparseRows J) {
    Vector in_column = Vector::Zero(J.cols());
    for (Eigen::Index i = 0; i < J.nonZeros(); ++i) in_column[J.innerIndexPtr()[i]] += 1.0;
    work_ +=
        kWorkOfStep + kWorkOfEntry * in_column.sum() + kWorkOfProduct * in_column.squaredNorm();
    return LeastSquares(std::move(J), mechanism_.name(),
                        searching_ ? LeastSquares::Care::kRough : LeastSquares::Care::kFull);
  }

  /// |e|^2 + mu^2 |w (q - guess)|^2
  double Pulled(const Vector& q, double mu) {
    const double open = Residual(q).squaredNorm();
    return open + mu * mu *
                      (guesses_.GuessedApart(q).cwiseProduct(guesses_.weights()).squaredNorm() +
                       WeightedLoose().squaredNorm());
  }
  Vector WeightedLoose() const {
    return guesses_.LooseApart(kinematics_).cwiseProduct(guesses_.loose_weights());
  }

  /// The step d to the minimum of Pulled(), with e linearised. In z = (d + g) / s, where g is
  /// q - guess, 0 without a guess, and s is 1 / w or 1 / kFree, it is a damped least-squares
  /// problem:
  ///
  ///   min |J s z - (J g - e)|^2 + mu^2 |z|^2     guesses of cut joints are rows of J, times mu w
  ///
  /// `J` below is J s.
  Vector PullStep(const Vector& q, double mu) {
    const Vector e = Residual(q), g = guesses_.GuessedApart(q);
    std::vector<OfCutJoint> cut = guesses_.held();
    cut.insert(cut.end(), guesses_.loose().begin(), guesses_.loose().end());
    Vector row_units = units_.With(kinematics_, cut), r(row_units.size());
    row_units.tail(guesses_.loose().size()).array() /= mu * guesses_.loose_weights().array();
    SparseRows J = LoopRows(kinematics_, pull_units_, row_units, cut, guesses_.fixed());
    r << -e, -mu * WeightedLoose();
    r += J * g.cwiseProduct(units_.columns).cwiseQuotient(pull_units_.columns);
    const Vector z = Solver(std::move(J)).Damped(r, mu);
    const Vector d = z.cwiseProduct(pull_units_.columns).cwiseQuotient(units_.columns) - g;
    return d * std::min(1.0, kLongestStep / d.template lpNorm<Eigen::Infinity>());
  }

  void Pull(std::size_t first, Vector* q) {
    for (std::size_t k = first; k < std::size(kPulls); ++k) {
      const double mu = kPulls[k];
      double value = Pulled(*q, mu);
      for (int i = 0; i < kPullIterations && work_ < kLastWork; ++i) {
        const double before = value;
        const Vector d = PullStep(*q, mu);
        for (double part = 1.0; part > 1e-2 && value >= before; part *= 0.5) {
          const Vector trial = Move(*q, part * d);
          const double next = Pulled(trial, mu);
          if (!(next < before)) continue;
          *q = trial;
          value = next;
        }
        if (value > 0.99 * before) break;
      }
    }
  }

  /// Moves a closed position along the closed positions to the nearest one. `stays`: of those that
  /// close within the accuracy.
  void Approach(bool stays, Vector* q) {
    searching_ = true;
    work_ = 0.0;
    double distance = Distance(*q);
    if (!(distance > kLeastStep * kLeastStep)) return;
    for (int i = 0; i < kLastSteps && work_ < kMaxWork; ++i) {
      const Vector d = PullStep(*q, kLastPull);
      if (i == 0 && work_ > 0.1 * kMaxWork) return;  // closing again takes ten times the work
      if (!(d.template lpNorm<Eigen::Infinity>() > kLeastStep)) return;
      bool is_nearer = false;
      for (double part = 1.0; part > 1e-2 && !is_nearer && work_ < kMaxWork; part *= 0.5) {
        Vector trial = Move(*q, part * d), e = Residual(trial);
        if (!Close(kTrialIterations, &trial, &e, stays) && !(stays && IsRounded(e))) continue;
        const double next = Distance(trial);
        is_nearer = next < (1.0 - kLeastDecrease) * distance;
        if (!is_nearer) continue;
        *q = trial;
        distance = next;
      }
      if (!is_nearer) return;
    }
  }

  /// Takes whole turns off angles, unless the position is further from the guesses then.
  void Unwind(Vector* q) {
    Vector turned = guesses_.Unwound(*q);
    if (turned == *q) return;
    Vector e = Residual(turned);
    if (Close(kTrialIterations, &turned, &e) && Distance(turned) < Distance(*q)) *q = turned;
  }

  double Distance(const Vector& q) {
    Place(q);
    return guesses_.SquaredDistance(kinematics_);
  }

  /// Speeds of all joints of a loop.
  std::vector<int> ColumnsOfLoop(int cut_joint) const {
    std::vector<int> columns;
    ForEachSpeedOfLoop(kinematics_, cut_joint, [&](int column, const Velocity<Space, double>&) {
      columns.push_back(column);
    });
    return columns;
  }

  /// Closes the loops from the guesses, from random positions about them, and with the joints of
  /// one loop moved from the best position so far. Returns false if no start closes.
  bool Search(bool closed, Vector* best) {
    std::mt19937_64 generator;
    double least = closed ? Distance(*best) : std::numeric_limits<double>::infinity();
    const std::vector<int>& loops = mechanism_.constraints();
    work_ = 0.0;
    searching_ = true;
    for (int start = 0, in_vain = 0; in_vain < kStarts && work_ < kMaxWork; ++start, ++in_vain) {
      Vector d = Vector::Zero(mechanism_.num_u()), q = guess_;
      const double most = kPi * UnitNumber(generator);
      const auto draw = [&](int column) {
        d[column] = (guesses_.guessed()[column] ? most : kPi) * (2.0 * UnitNumber(generator) - 1.0);
      };
      const bool has_best = least < std::numeric_limits<double>::infinity();
      if (start > 0 && start % 2 == 0 && has_best && !loops.empty()) {
        q = *best;
        for (int column : ColumnsOfLoop(loops[generator() % loops.size()])) draw(column);
      } else if (start > 0) {
        for (int column = 0; column < d.size(); ++column) draw(column);
      }
      q = Move(q, d);
      Pull(start == 0 ? 0 : static_cast<std::size_t>(start) % std::size(kPulls), &q);
      Vector e = Residual(q);
      if (!Close(kTrialIterations, &q, &e)) continue;
      Unwind(&q);
      const double distance = Distance(q);
      if (distance >= (1.0 - kNearer) * least) continue;
      least = distance;
      *best = q;
      in_vain = 0;
    }
    return least < std::numeric_limits<double>::infinity();
  }

  /// Joints of the longest way through the tree.
  double Depth() const {
    int deepest = 0;
    std::vector<int> depth(static_cast<std::size_t>(mechanism_.num_bodies()), 0);
    for (const TreeStep& step : mechanism_.tree()) {
      depth[step.child] = depth[step.parent] + 1;
      deepest = std::max(deepest, depth[step.child]);
    }
    return deepest;
  }

  const MechanismDescription& description_;
  const Mechanism<Space, double>& mechanism_;
  Kinematics<Space, double>& kinematics_;
  const AssemblyUnits<Space>& units_;
  const Guesses<Space> guesses_;
  const Vector guess_;
  const std::vector<double> sizes_;  ///< of bodies [m]
  AssemblyUnits<Space> pull_units_;  ///< of speeds: longer without a guess
  double goal_, closed_;             ///< of residuals: to reach, and good enough
  double work_ = 0.0;
  bool searching_ = false;
};

}  // namespace

template <class Space>
void ClosePositions(const MechanismDescription& description, Kinematics<Space, double>& kinematics,
                    const AssemblyUnits<Space>& units, Start<double>* start) {
  Closure<Space>(description, kinematics, units, start->q).Run(start);
}

template <class Space>
double Extent(const Mechanism<Space, double>& mechanism, const AssemblyUnits<Space>& units) {
  const auto longer = [&](int index) {
    const Joint<Space, double>& joint = mechanism.joints()[index];
    return std::max({mechanism.length(), joint.X_PF.p.norm(), joint.X_QM.p.norm()});
  };
  double farthest = mechanism.length(), last = 0.0;
  std::vector<double> reach(static_cast<std::size_t>(mechanism.num_bodies()), 0.0);
  for (const TreeStep& step : mechanism.tree()) {
    reach[step.child] = reach[step.parent] + longer(step.joint);
    farthest = std::max(farthest, reach[step.child]);
  }
  for (int index : mechanism.constraints()) last = std::max(last, longer(index));
  return (farthest + last) / units.length;
}

#define LOOPBENCH_INSTANTIATE(Space)                                                    \
  template void ClosePositions(const MechanismDescription&, Kinematics<Space, double>&, \
                               const AssemblyUnits<Space>&, Start<double>*);            \
  template double Extent(const Mechanism<Space, double>&, const AssemblyUnits<Space>&);
LOOPBENCH_INSTANTIATE(Planar)
LOOPBENCH_INSTANTIATE(Spatial)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
