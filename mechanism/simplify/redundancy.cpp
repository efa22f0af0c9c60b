#include "mechanism/simplify/redundancy.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "mechanism/description/topology.h"
#include "mechanism/loops/excursion.h"
#include "mechanism/loops/joint_response.h"
#include "mechanism/loops/row_choice.h"
#include "mechanism/loops/scaled_loops.h"
#include "mechanism/start/assembly.h"

namespace loopbench {

namespace {

/// Positions looked at besides the start, and how far apart [rad or mechanism lengths]: a whole
/// turn, or where the matrices are large, some way.
constexpr double kApart = 0.15;
constexpr int kMaxWithTurns = 40;
int Positions(int speeds) { return speeds <= kMaxWithTurns ? 48 : 6; }
/// A larger rank than before needs a conditioning of so many rank_ratio(). Near singular
/// configurations errors of positions grow, and may make redundant rows independent by a little
/// more than that.
constexpr double kCertain = 10.0;
/// To decide where rows must move, a walk takes one turn per freedom, but no more than these.
constexpr int kMostTurns = 8;

/// Ways that show whether a position is regular [rad or lengths].
constexpr double kProbe = 0.01, kRoundedProbe = 0.05;

/// Returns true if all free speeds lead to finite motions, as for constraints that are redundant at
/// every position. Otherwise more constraints hold nearby: a ladder of windows in line has a branch
/// for each opening direction of each window, and a walk finds few of them open.
template <class Space>
bool IsRegular(const Excursion<Space>& position, double probe) {
  constexpr int kProbes = 3;
  const double most_bend = std::max(0.2, 1.5 * probe);
  for (int k = 1; k <= kProbes; ++k) {
    Excursion<Space> there = position;
    there.TurnAnywhere();
    if (there.Step(probe, 100 + k) != StepKind::kMoved) return false;
    if (there.bend() > most_bend || there.rank() != position.rank()) return false;
  }
  return true;
}

/// Adds the rows of the next position of a walk, and rows in between: imposed rows may lose rank
/// there within a hundredth of a turn.
void AddRows(const Eigen::MatrixXd& next, std::vector<Eigen::MatrixXd>& rows) {
  constexpr int kParts = 8;
  if (!rows.empty()) {
    const Eigen::MatrixXd last = rows.back();
    for (int i = 1; i < kParts; ++i) {
      const double share = static_cast<double>(i) / kParts;
      rows.push_back((1.0 - share) * last + share * next);
    }
  }
  rows.push_back(next);
}

/// Walks through positions of the largest rank met; returns the one farthest from losing it.
/// `moves`: whether the walk left its start. `rows`: at these positions and more of the same rank.
template <class Space>
Excursion<Space> Roam(Excursion<Space> excursion, const Mechanism<Space, double>& mechanism,
                      bool& moves, std::vector<Eigen::MatrixXd>& rows) {
  Excursion<Space> best = excursion;
  rows = {excursion.rows().rows};
  const int enough = Positions(mechanism.num_u());
  const bool is_large = mechanism.num_u() > kMaxWithTurns;
  const int all = enough * (is_large ? 1 : std::clamp(best.freedom(), 1, kMostTurns));
  for (int k = 1; k <= all && best.rank() < mechanism.num_equations(); ++k) {
    const Excursion<Space> before = excursion;
    if (excursion.Step(kApart, k) != StepKind::kMoved || excursion.rank() < best.rank()) continue;
    if (excursion.rank() > best.rank() &&
        excursion.conditioning() < kCertain * excursion.rank_ratio()) {
      excursion = before;
      excursion.TurnAnywhere();
      continue;
    }
    if (k > enough) {
      if (excursion.rank() == best.rank()) AddRows(excursion.rows().rows, rows);
      continue;
    }
    moves = true;
    if (excursion.rank() > best.rank()) rows.clear();
    AddRows(excursion.rows().rows, rows);
    if (excursion.rank() > best.rank() || excursion.conditioning() > best.conditioning()) {
      best = excursion;
    }
  }
  return best;
}

/// Lets rows move between joints (mechanism.h) until the quotas of joints serve at all positions.
void AdaptQuotas(const std::vector<Eigen::MatrixXd>& rows, int rank, std::vector<Quota>& quotas) {
  // Elements of T up to ten are accepted (self_stress.h), and a walk misses the worst position.
  constexpr double kServes = 0.5, kBetter = 0.9;
  std::vector<Quota> none = quotas;
  for (Quota& quota : none) quota.keep = quota.fixed;
  std::vector<double> best;  // without quotas
  for (const Eigen::MatrixXd& at : rows) best.push_back(RowChoice(at, none, rank).least());
  // of all positions: a worst one may be due to several quotas
  const auto lack = [&] {
    double sum = 0.0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double share = RowChoice(rows[i], quotas, rank).least() / best[i];
      sum += std::max(0.0, std::log(kServes / std::max(share, 1e-6)));
    }
    return sum;
  };
  for (double now = lack(); now > 0.0;) {
    double least = kBetter * now;
    Quota* reduced = nullptr;
    for (Quota& quota : quotas) {
      if (quota.keep <= quota.fixed) continue;
      --quota.keep;
      if (const double other = lack(); other < least) {
        least = other;
        reduced = &quota;
      }
      ++quota.keep;
    }
    if (reduced == nullptr) return;
    --reduced->keep;
    now = least;
  }
}

/// The rows of a position that depend most on the others, so that `rank` stay imposed.
template <class Space>
std::vector<Released> Release(const Excursion<Space>& position,
                              const Mechanism<Space, double>& mechanism,
                              const std::vector<Eigen::MatrixXd>& everywhere) {
  const std::vector<int>& constraints = mechanism.constraints();
  const DirectionRows& at = position.rows();
  std::vector<Quota> quotas;
  int row = 0;
  for (std::size_t c = 0; c < constraints.size(); ++c) {
    quotas.push_back({at.first[c], at.count[c], 0, 0});
    row += at.count[c];
  }
  for (; row < at.rows.rows(); ++row) quotas.push_back({row, 1, 1, 1});  // couplings stay
  const RowChoice best(at.rows, quotas, position.rank());
  for (std::size_t c = 0; c < quotas.size(); ++c) quotas[c].keep = best.taken(c);
  if (quotas.size() > 1) AdaptQuotas(everywhere, position.rank(), quotas);
  std::vector<int> joints = constraints;
  joints.resize(quotas.size(), -1);
  return RowChoice(at.rows, quotas, position.rank()).BeyondQuotas(joints);
}

/// Redundancy of a part without prescribed motions, from the positions of `start`, whose loops are
/// open by `residual` [m]. Zero rows if the part is too large.
template <class Space>
Redundancy FindFrom(const Kinematics<Space, double>& start, double residual,
                    const MechanismDescription& free) {
  Redundancy result;
  const Mechanism<Space, double> mechanism(free, Coordinates::kJoint);
  VectorX<double> q = start.CoordinatesIn(mechanism);
  for (const TreeStep& step : mechanism.tree()) {  // couplings count turns
    const Joint<Space, double>& joint = mechanism.joints()[step.joint];
    if (joint.num_q() == 1) q[joint.q_offset] = start.JointCoordinate(step.joint);
  }
  Kinematics<Space, double> here(mechanism);
  here.UpdatePosition(q);
  const bool independent =
      free.couplings.empty() && free.accuracy <= kRankRatio && AreIndependent(here);
  if (!independent && mechanism.num_u() > kMaxAnalysedSpeeds) return result;
  result.rows = result.rank = result.rank_at_start = mechanism.num_equations();
  if (independent) return result;
  // rounded axes leave no motion, or none that closes to round-off
  for (const double accuracy : {0.0, free.accuracy}) {
    result.num_couplings = static_cast<int>(free.couplings.size());
    Excursion<Space> excursion(mechanism, q, accuracy);
    result.rank = result.rank_at_start = excursion.rank();
    if (result.rank == result.rows) return result;
    bool moves = false;  // which leaves a speed
    const double excess = excursion.excess();
    const Excursion<Space> first = excursion;
    std::vector<Eigen::MatrixXd> rows;
    excursion = Roam(std::move(excursion), mechanism, moves, rows);
    result.rank = excursion.rank();
    if (!IsRegular(excursion,
                   accuracy > 0.0 ? std::max(kRoundedProbe, WayBeyond(accuracy)) : kProbe)) {
      result.rank = std::min(result.rows, mechanism.num_u() - (moves ? 1 : 0));
      result.num_couplings = 0;  // their part in this rank is unknown
      continue;
    }
    if (result.rank == result.rows || result.rank == mechanism.num_u()) return result;
    // rounded rows are imposed or not, so that those of the start must serve there
    const bool starts_regular = accuracy > 0.0 && first.rank() == excursion.rank();
    if (mechanism.num_u() > kMaxWithTurns) rows.clear();
    result.released = Release(starts_regular ? first : excursion, mechanism, rows);
    if (accuracy > 0.0) {
      result.rounding = std::max(excess, residual / mechanism.length());
    }
    break;
  }
  return result;
}

/// True if the couplings are independent and relate tree joints only, so that their rows are
/// constant (self_stress.h).
bool HaveConstantRows(const MechanismDescription& description, const MechanismDescription& free) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(std::ssize(free.couplings), std::ssize(free.joints));
  for (Eigen::Index c = 0; c < rows.rows(); ++c) {
    for (const auto& [joint, ratio] : free.couplings[static_cast<std::size_t>(c)].parts) {
      if (free.joints[joint].cut) return false;
      if (description.joints[joint].motions.empty()) rows(c, joint) = ratio;
    }
  }
  return Eigen::FullPivLU<Eigen::MatrixXd>(rows).rank() == rows.rows();
}

/// Redundancy of one part: bodies that joints connect.
template <class Space>
Redundancy Find(const MechanismDescription& description) {
  const Mechanism<Space, double> driven(description, Coordinates::kJoint);
  Redundancy result;
  result.cut = driven.constraints();
  if (driven.num_rows() == 0) return result;
  const Start<double> start = Assemble<Space>(description, driven);
  if (start.outcome == Outcome::kInconsistentStart) return result;
  Kinematics<Space, double> at_start(driven);
  at_start.UpdatePosition(start.q);
  MechanismDescription free = description;
  for (JointDescription& joint : free.joints) joint.motions.clear();
  for (int index : driven.constraints()) free.joints[index].cut = true;  // the same forest
  MechanismDescription uncoupled = free;
  uncoupled.couplings.clear();
  result = FindFrom(at_start, start.position_residual, uncoupled);
  if (result.rows > 0 && !free.couplings.empty() && HaveConstantRows(description, free)) {
    Redundancy coupled = FindFrom(at_start, start.position_residual, free);
    if (coupled.num_couplings > 0 && coupled.rank == result.rank + coupled.num_couplings) {
      result.num_couplings = coupled.num_couplings;
      result.rows += coupled.num_couplings;
      result.rank = coupled.rank;
      result.rank_at_start = coupled.rank_at_start;
    } else if (!coupled.released.empty()) {
      result = std::move(coupled);
      for (const CouplingDescription& one : free.couplings) result.couplings.push_back(one.name);
    }
  }
  result.cut = driven.constraints();
  return result;
}

}  // namespace

/// Each part by itself: neither its size nor whether it can move at all concerns another's.
Redundancy FindRedundancy(const MechanismDescription& description) {
  Redundancy whole;
  for (const Part& part : SplitByJoints(description)) {
    const Redundancy found = ForSpace(
        description.space, [&]<class Space>(Space) { return Find<Space>(part.description); });
    whole.rows += found.rows;
    whole.num_couplings += found.num_couplings;
    std::ranges::copy(found.couplings, std::back_inserter(whole.couplings));
    whole.rank += found.rank;
    whole.rank_at_start += found.rank_at_start;
    whole.rounding = std::max(whole.rounding, found.rounding);
    for (const int joint : found.cut) whole.cut.push_back(part.joints[joint]);
    for (Released out : found.released) {
      out.joint = part.joints[out.joint];
      whole.released.push_back(std::move(out));
    }
  }
  std::ranges::sort(whole.cut);
  std::ranges::sort(whole.released, {}, &Released::joint);
  return whole;
}

std::string NameOfDirection(const MechanismDescription& description, const Released& released,
                            int direction) {
  const JointDescription& joint = description.joints[released.joint];
  const JointTraits& traits = TraitsOf(joint.type);
  return ForSpace(description.space, [&]<class Space>(Space) -> std::string {
    const auto& kind = KindOf<Space, double>(joint.type);
    const int component = kind.axes[kind.num_u + direction];
    const bool moment = component < Space::kRot;
    if (const std::string_view own = moment ? traits.moment : traits.force; !own.empty()) {
      return std::string(own);
    }
    const char axis =
        moment ? (Space::kRot == 1 ? 'z' : "xyz"[component]) : "xyz"[component - Space::kRot];
    return std::string(moment ? "the moment about " : "the force along ") + axis +
           " of its frame on " + description.bodies[joint.from.body].name;
  });
}

MechanismDescription Release(const MechanismDescription& description,
                             const Redundancy& redundancy) {
  MechanismDescription result = description;
  result.rounded = redundancy.rounding > 0.0;
  for (int joint : redundancy.cut) result.joints[joint].cut = true;
  for (CouplingDescription& coupling : result.couplings) {
    coupling.in_loops = std::ranges::count(redundancy.couplings, coupling.name) > 0;
  }
  for (const Released& out : redundancy.released) {
    result.joints[out.joint].released = out.directions;
    result.joints[out.joint].moving = out.moving;
  }
  return result;
}

}  // namespace loopbench
