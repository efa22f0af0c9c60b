#include "mechanism/simplify/redundancy.h"

#include <algorithm>
#include <cstdio>
#include <optional>

#include "mechanism/description/parts.h"
#include "mechanism/loops/excursion.h"
#include "mechanism/loops/joint_response.h"
#include "mechanism/simplify/release_choice.h"
#include "mechanism/start/assembly.h"

namespace loopbench {

namespace {

/// Positions looked at besides the start, and how far apart [rad or mechanism lengths]: a whole
/// turn, or where the matrices are large, some way.
constexpr double kApart = 0.15;
int Positions(int speeds) { return speeds <= 40 ? 48 : 6; }

/// Positions on the way of an excursion.
struct Walk {
  std::vector<DirectionRows> positions;
  std::vector<bool> follows;      ///< whether it is next to the one before
  std::vector<double> potential;  ///< energy [J]
  bool joined = false;

  template <class Space>
  void Add(const Excursion<Space>& here) {
    positions.push_back(here.rows());
    follows.push_back(joined);
    potential.push_back(ComputeEnergy(here.kinematics()).potential);
    joined = true;
  }
  void Interrupt() { joined = false; }

  /// Keeps what a motion of this energy can reach, and a tenth more for starts that are changed.
  void Confine(double energy) {
    Walk kept;
    const double limit = energy + 0.1 * (energy - *std::ranges::min_element(potential));
    for (std::size_t p = 0; p < positions.size(); ++p) {
      const bool within = potential[p] <= limit;
      if (within) {
        kept.positions.push_back(positions[p]);
        kept.follows.push_back(follows[p] && kept.joined);
      }
      kept.joined = within;
    }
    // a start at rest in its lowest position, which is singular, reaches none of them
    if (!kept.positions.empty()) *this = std::move(kept);
  }
};

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

/// Walks through positions of the largest rank met; returns the one farthest from losing it.
template <class Space>
Excursion<Space> Roam(Excursion<Space> excursion, const Mechanism<Space, double>& mechanism,
                      Walk& walk) {
  walk.Add(excursion);
  Excursion<Space> best = excursion;
  int rank = excursion.rank();
  for (int k = 1; k <= Positions(mechanism.num_u()) && rank < mechanism.num_rows(); ++k) {
    if (excursion.Step(kApart, k) != StepKind::kMoved || excursion.rank() < rank) {
      walk.Interrupt();
      continue;
    }
    const bool more = excursion.rank() > rank;
    if (more) walk = Walk();
    rank = excursion.rank();
    walk.Add(excursion);
    if (more || excursion.conditioning() > best.conditioning()) best = excursion;
  }
  return best;
}

/// The directions that may go, so that `rank` of them stay imposed.
template <class Space>
std::vector<Released> Release(const Walk& walk, const Mechanism<Space, double>& mechanism,
                              const MechanismDescription& description, int rank) {
  const std::vector<int>& constraints = mechanism.constraints();
  std::vector<Choosable> joints;
  for (const int joint : constraints) {
    joints.push_back(ChoiceOf(*mechanism.joints()[joint].kind));
    // axes of directions are other ones where a coordinate is prescribed: such a joint keeps all
    joints.back().keeps_all = !description.joints[joint].motions.empty();
  }
  std::vector<Released> released;
  const ReleaseChoice choice = ChooseImposed(walk.positions, walk.follows, joints, rank);
  for (std::size_t c = 0; c < constraints.size(); ++c) {
    Released out{constraints[c], {}, choice.force_axes[c]};
    for (int i = 0; i < joints[c].count; ++i) {
      if (!choice.imposed[c][i]) out.directions.push_back(i);
    }
    if (!out.directions.empty()) released.push_back(std::move(out));
  }
  return released;
}

/// Of one part: bodies that joints connect. `conservative`: gravity is all that acts on it.
template <class Space>
Redundancy Find(const MechanismDescription& description, bool conservative) {
  Redundancy result;
  const Mechanism<Space, double> driven(description, Coordinates::kJoint);
  result.cut = driven.constraints();
  if (driven.num_rows() == 0) return result;
  const Start<double> start = Assemble<Space>(description, driven);
  if (start.outcome == Outcome::kInconsistentStart) return result;

  MechanismDescription free = description;
  for (JointDescription& joint : free.joints) joint.motions.clear();
  for (int index : result.cut) free.joints[index].cut = true;  // the same forest
  const Mechanism<Space, double> mechanism(free, Coordinates::kJoint);
  Kinematics<Space, double> at_start(driven);
  at_start.UpdatePosition(start.q);
  at_start.UpdateVelocity(start.u);
  std::optional<double> energy;  // [J]
  if (conservative && driven.drives().empty()) {
    const Energy<double> at_first = ComputeEnergy(at_start);
    energy = at_first.kinetic + at_first.potential;
  }
  const VectorX<double> q = at_start.CoordinatesIn(mechanism);
  Kinematics<Space, double> undriven(mechanism);
  undriven.UpdatePosition(q);
  const bool independent = AreIndependent(undriven);
  if (!independent && mechanism.num_u() > kMostAnalysedSpeeds) return result;
  result.rows = result.rank = result.rank_at_start = mechanism.num_rows();
  if (independent) return result;
  Excursion<Space> excursion(mechanism, q);
  result.rank = result.rank_at_start = excursion.rank();
  if (result.rank == result.rows) return result;

  Walk walk;
  excursion = Roam(std::move(excursion), mechanism, walk);
  result.rank = excursion.rank();
  // what moves has a speed left
  const bool moves = walk.positions.size() > 1;
  if (!IsRegular(excursion)) {
    result.rank = std::min(result.rows, mechanism.num_u() - (moves ? 1 : 0));
    return result;
  }
  if (result.rank == result.rows || result.rank == mechanism.num_u()) return result;

  if (energy) walk.Confine(*energy);
  result.released = Release(walk, mechanism, description, result.rank);
  return result;
}

}  // namespace

/// Each part by itself: neither its size nor whether it can move at all concerns another's.
Redundancy FindRedundancy(const MechanismDescription& description) {
  Redundancy whole;
  const bool conservative = description.forces.empty();
  for (const Part& part : SplitByJoints(description)) {
    const Redundancy found = description.space == SpaceKind::kPlanar
                                 ? Find<Planar>(part.description, conservative)
                                 : Find<Spatial>(part.description, conservative);
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

std::string NameOfDirection(const MechanismDescription& description, const Released& released,
                            int direction) {
  const JointDescription& one = description.joints[released.joint];
  const auto name = [&](const auto& kind, int rotations) -> std::string {
    const int component = kind.axes[kind.num_u + direction];
    const bool moment = component < rotations;
    const JointTraits& traits = TraitsOf(one.type);
    if (const std::string_view own = moment ? traits.moment : traits.force; !own.empty()) {
      return std::string(own);
    }
    const std::string frame = " of its frame on " + description.bodies[one.from.body].name;
    if (!moment && !released.force_axes.isIdentity(0.0)) {
      const Eigen::Vector3d axis = released.force_axes.col(component - rotations);
      char text[64];
      std::snprintf(text, sizeof text, "(%.3f, %.3f, %.3f)", axis.x(), axis.y(), axis.z());
      return "the force along " + std::string(text) + frame;
    }
    const char axis =
        moment ? (rotations == 1 ? 'z' : "xyz"[component]) : "xyz"[component - rotations];
    return std::string(moment ? "the moment about " : "the force along ") + axis + frame;
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
    result.joints[out.joint].force_axes = out.force_axes;
  }
  return result;
}

}  // namespace loopbench
