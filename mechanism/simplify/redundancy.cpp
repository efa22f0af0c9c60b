#include "mechanism/simplify/redundancy.h"

#include <Eigen/QR>
#include <algorithm>
#include <bit>
#include <limits>

#include "mechanism/description/parts.h"
#include "mechanism/loops/excursion.h"
#include "mechanism/loops/row_choice.h"
#include "mechanism/start/assembly.h"

namespace loopbench {

namespace {

/// Positions looked at besides the start, and how far apart [rad or mechanism lengths]: a whole
/// turn, or where the matrices are large, some way.
constexpr double kApart = 0.15;
int Positions(int speeds) { return speeds <= 40 ? 48 : 6; }

/// What a choice costs that imposes some moments of a joint in space and not all. Rates of rotation
/// are no derivatives of angles: with both moments of a pin imposed its axis stays as far off as it
/// is, with one of them the mismatch of the other turns into its own, and grows exponentially. As
/// much as the largest coefficients that a choice of forces was seen to have over a turn.
constexpr double kSomeMoments = 200.0;

/// Largest mismatch of a released direction per unit of the imposed ones (both scaled as rows), the
/// loops being as they are at one position: the released rows in terms of the imposed ones.
double Amplification(const DirectionRows& at, const std::vector<bool>& imposed) {
  const Eigen::Index kept = std::ranges::count(imposed, true);
  if (kept == 0) return 0.0;
  Eigen::MatrixXd K(kept, at.rows.cols()), out(at.rows.rows() - kept, at.rows.cols());
  Eigen::Index k = 0, o = 0;
  for (Eigen::Index r = 0; r < at.rows.rows(); ++r) {
    if (imposed[static_cast<std::size_t>(r)]) {
      K.row(k++) = at.rows.row(r);
    } else {
      out.row(o++) = at.rows.row(r);
    }
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(K.transpose());
  if (qr.rank() < kept) return std::numeric_limits<double>::infinity();
  return qr.solve(out.transpose()).colwise().norm().maxCoeff();
}

/// The rows of one position that differ most from each other, those that `must` be among them
/// first.
std::vector<bool> BestRows(const DirectionRows& at, const std::vector<bool>& must, int rank) {
  const Quota all{0, static_cast<int>(at.rows.rows()), 0, static_cast<int>(at.rows.rows())};
  RowChoice choice(at.rows, {all});
  for (std::size_t r = 0; r < must.size(); ++r) {
    if (must[r]) choice.Take(0, static_cast<int>(r));
  }
  choice.TakeBest(rank, [](int) { return true; });
  return choice.taken();
}

/// Every way to impose as many rows of first .. first + count - 1 as `imposed` does, the others as
/// they are.
std::vector<std::vector<bool>> OtherChoices(const std::vector<bool>& imposed, int first,
                                            int count) {
  const auto begin = imposed.begin() + first;
  const auto kept = std::count(begin, begin + count, true);
  std::vector<std::vector<bool>> all;
  for (unsigned bits = 0; bits < (1u << count); ++bits) {
    if (std::popcount(bits) != kept) continue;
    std::vector<bool> other = imposed;
    for (int i = 0; i < count; ++i) other[static_cast<std::size_t>(first + i)] = (bits >> i & 1u);
    all.push_back(std::move(other));
  }
  return all;
}

/// `moments_of` has the joint of each row that is one of several moments, else -1.
bool ImposesSomeMoments(const std::vector<bool>& imposed, const std::vector<int>& moments_of) {
  for (std::size_t r = 0; r < imposed.size(); ++r) {
    for (std::size_t other = 0; other < r && moments_of[r] >= 0; ++other) {
      if (moments_of[other] == moments_of[r] && imposed[other] != imposed[r]) return true;
    }
  }
  return false;
}

/// The choice that serves best where it serves worst: of the best ones of each position, then
/// changed, joint by joint and row for row, for as long as that helps. Joints that keep all their
/// rows (`must`) have no choice.
std::vector<bool> BestChoice(const std::vector<DirectionRows>& positions,
                             const std::vector<bool>& must, const std::vector<int>& moments_of,
                             int rank) {
  double least = std::numeric_limits<double>::infinity();
  std::size_t hardest = 0;
  std::vector<bool> chosen(must.size(), true);
  const auto consider = [&](const std::vector<bool>& candidate) {
    for (std::size_t r = 0; r < must.size(); ++r) {
      if (must[r] && !candidate[r]) return false;
    }
    const double cost = ImposesSomeMoments(candidate, moments_of) ? kSomeMoments : 1.0;
    // where the last candidate failed this one will fail, too
    double worst = cost * Amplification(positions[hardest], candidate);
    for (std::size_t p = 0; p < positions.size() && worst < least; ++p) {
      const double here = cost * Amplification(positions[p], candidate);
      if (!(here < least)) hardest = p;
      worst = std::max(worst, here);
    }
    if (!(worst < least)) return false;
    least = worst;
    chosen = candidate;
    return true;
  };
  for (const DirectionRows& at : positions) consider(BestRows(at, must, rank));
  // joints of many rows together would take minutes, and gain little
  constexpr std::size_t kMostRows = 40;
  if (must.size() > kMostRows) return chosen;
  const DirectionRows& first = positions.front();
  for (bool better = true; better;) {
    better = false;
    for (std::size_t c = 0; c < first.first.size(); ++c) {
      for (const auto& other : OtherChoices(chosen, first.first[c], first.count[c])) {
        better = consider(other) || better;
      }
    }
    for (std::size_t in = 0; in < must.size(); ++in) {
      for (std::size_t out = 0; out < must.size(); ++out) {
        if (chosen[in] || !chosen[out] || must[out]) continue;
        std::vector<bool> other = chosen;
        other[in] = true;
        other[out] = false;
        better = consider(other) || better;
      }
    }
  }
  return chosen;
}

/// Whether all speeds that the constraints leave free lead to motions, as they do where constraints
/// that depend on each other do so all around. Where they do not, more constraints hold close by: a
/// ladder of windows in line has a branch for each way that each window may open, and a walk finds
/// few of them open.
template <class Space>
bool IsRegular(const Excursion<Space>& position) {
  constexpr int kProbes = 3;
  constexpr double kProbe = 0.01, kMostBend = 0.2;  // [rad or lengths], and twenty times that
  for (int k = 1; k <= kProbes; ++k) {
    Excursion<Space> probe = position;
    probe.TurnAnywhere();
    if (probe.Step(kProbe, 100 + k) != StepKind::kMoved) return false;
    if (probe.bend() > kMostBend || probe.rank() != position.rank()) return false;
  }
  return true;
}

/// Of one part: bodies that joints connect.
template <class Space>
Redundancy Find(const MechanismDescription& description) {
  Redundancy result;
  const Mechanism<Space, double> driven(description, Coordinates::kJoint);
  result.cut = driven.constraints();
  if (driven.num_rows() == 0 || driven.num_u() > kMostAnalysedSpeeds) return result;
  const Start<double> start = Assemble<Space>(description, driven);
  if (start.outcome == Outcome::kInconsistentStart) return result;

  MechanismDescription free = description;
  for (JointDescription& joint : free.joints) joint.motions.clear();
  for (int index : result.cut) free.joints[index].cut = true;  // the same forest
  const Mechanism<Space, double> mechanism(free, Coordinates::kJoint);
  Kinematics<Space, double> at_start(driven);
  at_start.UpdatePosition(start.q);
  Excursion<Space> excursion(mechanism, at_start.CoordinatesIn(mechanism));
  result.rows = mechanism.num_rows();
  result.rank = result.rank_at_start = excursion.rank();
  if (result.rank == result.rows) return result;

  // positions of the largest rank met
  std::vector<DirectionRows> positions = {excursion.rows()};
  Excursion<Space> best = excursion;
  for (int k = 1; k <= Positions(mechanism.num_u()) && result.rank < result.rows; ++k) {
    if (excursion.Step(kApart, k) != StepKind::kMoved) continue;
    if (excursion.rank() < result.rank) continue;
    const bool more = excursion.rank() > result.rank;
    if (more) positions.clear();
    result.rank = excursion.rank();
    positions.push_back(excursion.rows());
    if (more || excursion.conditioning() > best.conditioning()) best = excursion;
  }
  // what moves has a speed left
  const bool moves = positions.size() > 1;
  if (!IsRegular(best)) {
    result.rank = std::min(result.rows, mechanism.num_u() - (moves ? 1 : 0));
    return result;
  }
  if (result.rank == result.rows || result.rank == mechanism.num_u()) return result;

  // axes of directions are other ones where a coordinate is prescribed: such a joint keeps all
  const std::vector<int>& constraints = mechanism.constraints();
  std::vector<bool> must(static_cast<std::size_t>(result.rows), false);
  const DirectionRows& first = positions.front();
  for (std::size_t c = 0; c < constraints.size(); ++c) {
    const bool keeps = !description.joints[constraints[c]].motions.empty();
    for (int i = 0; keeps && i < first.count[c]; ++i) must[first.first[c] + i] = true;
  }
  std::vector<int> moments_of(must.size(), -1);
  for (std::size_t c = 0; c < constraints.size() && Space::kRot == 3; ++c) {
    const auto& kind = *mechanism.joints()[constraints[c]].kind;
    for (int i = 0; i < kind.num_constraints(); ++i) {
      const bool moment = kind.axes[kind.num_u + i] < Space::kRot;
      if (moment) moments_of[first.first[c] + i] = static_cast<int>(c);
    }
  }
  const std::vector<bool> chosen = BestChoice(positions, must, moments_of, result.rank);
  for (std::size_t c = 0; c < constraints.size(); ++c) {
    Released out{constraints[c], {}};
    for (int i = 0; i < first.count[c]; ++i) {
      if (!chosen[first.first[c] + i]) out.directions.push_back(i);
    }
    if (!out.directions.empty()) result.released.push_back(std::move(out));
  }
  return result;
}

}  // namespace

/// Each part by itself: neither its size nor whether it can move at all concerns another's.
Redundancy FindRedundancy(const MechanismDescription& description) {
  Redundancy whole;
  for (const Part& part : SplitByJoints(description)) {
    const Redundancy found = description.space == SpaceKind::kPlanar
                                 ? Find<Planar>(part.description)
                                 : Find<Spatial>(part.description);
    whole.rows += found.rows;
    whole.rank += found.rank;
    whole.rank_at_start += found.rank_at_start;
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

std::string NameOfDirection(const MechanismDescription& description, int joint, int direction) {
  const JointDescription& one = description.joints[joint];
  const auto name = [&](const auto& kind, int rotations) -> std::string {
    const int component = kind.axes[kind.num_u + direction];
    const bool moment = component < rotations;
    if (one.type == JointType::kRod) return "the force along the rod";
    if (one.type == JointType::kUniversal && moment) {
      return "the moment about the normal of its two axes";
    }
    const char axis =
        moment ? (rotations == 1 ? 'z' : "xyz"[component]) : "xyz"[component - rotations];
    return std::string(moment ? "the moment about " : "the force along ") + axis + " of " +
           "its frame on " + description.bodies[one.from.body].name;
  };
  return description.space == SpaceKind::kPlanar
             ? name(KindOf<Planar, double>(one.type), Planar::kRot)
             : name(KindOf<Spatial, double>(one.type), Spatial::kRot);
}

MechanismDescription Release(const MechanismDescription& description,
                             const Redundancy& redundancy) {
  MechanismDescription result = description;
  for (int joint : redundancy.cut) result.joints[joint].cut = true;
  for (const Released& out : redundancy.released) {
    result.joints[out.joint].released = out.directions;
  }
  return result;
}

}  // namespace loopbench
