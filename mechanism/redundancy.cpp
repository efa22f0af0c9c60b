#include "mechanism/redundancy.h"

#include <Eigen/QR>
#include <algorithm>
#include <bit>
#include <limits>

#include "mechanism/assembly.h"
#include "mechanism/excursion.h"
#include "mechanism/row_choice.h"

namespace loopbench {

namespace {

/// Positions looked at besides the start, and how far apart [rad or mechanism lengths]: a whole
/// turn, or where the matrices are large, some way.
constexpr double kApart = 0.15;
int Positions(int speeds) { return speeds <= 40 ? 48 : 6; }

/// Largest mismatch of a released direction per unit of the imposed ones (both scaled as rows), the
/// loops being as they are at one position: the released rows in terms of the imposed ones.
double Amplification(const DirectionRows& at, const std::vector<bool>& imposed) {
  const Eigen::Index kept = std::ranges::count(imposed, true);
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

/// Every way to impose `rank` of few rows; none where there are many ways.
std::vector<std::vector<bool>> AllChoices(int rows, int rank) {
  constexpr int kMostRows = 8;
  std::vector<std::vector<bool>> all;
  if (rows > kMostRows) return all;
  for (unsigned bits = 0; bits < (1u << rows); ++bits) {
    if (std::popcount(bits) != rank) continue;
    std::vector<bool> imposed;
    for (int r = 0; r < rows; ++r) imposed.push_back((bits >> r & 1u) != 0);
    all.push_back(imposed);
  }
  return all;
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
  Excursion<Space> last = excursion;
  for (int k = 1; k <= Positions(mechanism.num_u()) && result.rank < result.rows; ++k) {
    if (excursion.Step(kApart, k) != StepKind::kMoved) continue;
    if (excursion.rank() < result.rank) continue;
    if (excursion.rank() > result.rank) positions.clear();
    result.rank = excursion.rank();
    positions.push_back(excursion.rows());
    last = excursion;
  }
  if (!IsRegular(last)) result.rank = std::min(result.rows, mechanism.num_u());
  if (result.rank == result.rows || result.rank == mechanism.num_u()) return result;

  // axes of directions are other ones where a coordinate is prescribed: such a joint keeps all
  const std::vector<int>& constraints = mechanism.constraints();
  std::vector<bool> must(static_cast<std::size_t>(result.rows), false);
  const DirectionRows& first = positions.front();
  for (std::size_t c = 0; c < constraints.size(); ++c) {
    const bool keeps = !description.joints[constraints[c]].motions.empty();
    for (int i = 0; keeps && i < first.count[c]; ++i) must[first.first[c] + i] = true;
  }
  // candidates are all choices, or the best one of each position
  std::vector<std::vector<bool>> candidates = AllChoices(result.rows, result.rank);
  if (candidates.empty()) {
    for (const DirectionRows& at : positions) candidates.push_back(BestRows(at, must, result.rank));
  }
  double least = std::numeric_limits<double>::infinity();
  std::vector<bool> chosen(must.size(), true);
  for (const std::vector<bool>& candidate : candidates) {
    bool allowed = true;
    for (std::size_t r = 0; r < must.size(); ++r) allowed = allowed && (candidate[r] || !must[r]);
    if (!allowed) continue;
    double worst = 0.0;
    for (const DirectionRows& at : positions) {
      worst = std::max(worst, Amplification(at, candidate));
      if (!(worst < least)) break;
    }
    if (!(worst < least)) continue;
    least = worst;
    chosen = candidate;
  }
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

Redundancy FindRedundancy(const MechanismDescription& description) {
  return description.space == SpaceKind::kPlanar ? Find<Planar>(description)
                                                 : Find<Spatial>(description);
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
