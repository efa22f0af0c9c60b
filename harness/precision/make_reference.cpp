#include "harness/precision/make_reference.h"

#include <algorithm>
#include <cmath>
#include <concepts>
#include <functional>
#include <limits>

#include "harness/precision/exact.h"

namespace loopbench::harness {
namespace {

/// Returns the largest distance of the user's points from the centres of mass of their bodies [m].
double LongestArm(const Measured& measured) {
  double longest = 0.0;
  for (const auto& [body, at] : PointsOf(measured.user)) {
    const BodyImage& image = measured.compiled.bodies[body];
    if (image.part < 0) continue;
    const MechanismDescription& part =
        measured.compiled.parts[static_cast<std::size_t>(image.part)].description;
    const Eigen::Vector3d& centre = part.bodies[static_cast<std::size_t>(image.body)].com;
    longest = std::max(longest, (image.X.p + image.X.R * at - centre).norm());
  }
  return longest;
}

/// Returns the bound with storage in double, for points at `arm` from the centres.
template <class S>
Distance InUsersTerms(const WideDistance<S>& wide, double arm, const Snapshot& kept) {
  constexpr double kEps = std::numeric_limits<double>::epsilon();
  // each number is rounded once, and a few products lie between the part's axes and the user's
  constexpr double kRoundings = 8.0;
  double far = 0.0, fast = 0.0, turning = 0.0;
  for (const BodyState& body : kept.bodies) {
    far = std::max(far, body.pose.p.norm());
    fast = std::max(fast, body.velocity.norm());
    turning = std::max(turning, body.angular_velocity.norm());
  }
  const auto sum = [](const S& bound, double size) {
    return static_cast<double>(bound) + kRoundings * kEps * size;
  };
  Distance bound;
  bound.rotation = sum(wide.rotation, 1.0);
  bound.position = sum(wide.position, far + arm) + bound.rotation * arm;
  bound.angular_velocity = sum(wide.angular_velocity, turning);
  bound.velocity = sum(wide.velocity, fast + turning * arm) +
                   (bound.angular_velocity + bound.rotation * turning) * arm;
  bound.angle = 2 * bound.rotation;  // of two bodies against each other
  bound.displacement = 2 * bound.position;
  bound.energy = sum(wide.energy, std::abs(kept.energy));
  return bound;
}

template <class S>
constexpr const char* kScalarName = std::same_as<S, long double> ? "long-double" : "float128";

template <class Space, class S>
void Fill(const Measured& measured, const Certified<Space, S>& certified, Reference* reference) {
  const MechanismDescription& part = measured.compiled.parts.front().description;
  const Mechanism<Space, double> mechanism(part, Coordinates::kJoint);
  Kinematics<Space, double> kinematics(mechanism);
  const double arm = LongestArm(measured);
  for (std::size_t k = 0; k < certified.bounds.size(); ++k) {
    const Moment<Space, S>& moment = certified.reference.moments[k];
    Snapshot snapshot = EmptySnapshot(measured);
    for (std::size_t i = 1; i < moment.poses.size(); ++i) {
      EnterBody(measured, 0, static_cast<int>(i),
                StateAtCentre<Space, S>(moment.poses[i], moment.motions[i]), &snapshot);
    }
    // joint coordinates are the tree's, rounded
    kinematics.SetTime(reference->times[k]);
    kinematics.UpdatePosition(certified.reference.positions[k].template cast<double>());
    for (int j = 0; j < static_cast<int>(mechanism.joints().size()); ++j) {
      const auto& joint = mechanism.joints()[static_cast<std::size_t>(j)];
      if (joint.description < 0 || joint.kind->num_u != 1) continue;
      EnterJoint(measured, 0, joint.description, kinematics.JointCoordinate(j),
                 std::numeric_limits<double>::quiet_NaN(), &snapshot);
    }
    snapshot.energy = static_cast<double>(moment.energy);
    reference->bounds.push_back(InUsersTerms(certified.bounds[k], arm, snapshot));
    reference->snapshots.push_back(std::move(snapshot));
  }
  reference->scalar = kScalarName<S>;
  reference->outcome = ToString(certified.outcome);
  reference->message = certified.message;
  reference->witnesses = certified.witnesses;
  reference->rhs_evaluations = certified.rhs_evaluations;
  reference->cpu_s = certified.cpu_s;
}

/// One subsystem: one energy for all and one list of times.
CompileOptions InOnePiece() { return {.islands = false}; }

bool IsPlanar(const Compiled& compiled) {
  return compiled.parts.front().description.space == SpaceKind::kPlanar;
}

using Way = std::function<void(Reference*)>;

template <class Space, class S>
Way By(PutBack put_back, const Measured& measured, double cpu_s) {
  return [=, &measured](Reference* reference) {
    const MechanismDescription& part = measured.compiled.parts.front().description;
    Fill(measured, Certify<Space, S>(part, reference->times, cpu_s, put_back), reference);
  };
}

/// Returns the methods from the cheapest to the one with the longest validity.
std::vector<Way> WaysOf(const Measured& measured, const ReferenceOptions& options) {
  const double cpu_s = options.cpu_s;
  if (!IsPlanar(measured.compiled)) {
    return {By<Spatial, long double>(PutBack::kAtSteps, measured, cpu_s),
            By<Spatial, long double>(PutBack::kAtStages, measured, cpu_s)};
  }
  const auto planar = [&](bool is_wide, PutBack put_back) {
    return is_wide ? By<Planar, Float128>(put_back, measured, cpu_s)
                   : By<Planar, long double>(put_back, measured, cpu_s);
  };
  return {planar(options.scalar == "float128", PutBack::kAtSteps),
          planar(options.scalar != "long-double", PutBack::kAtStages)};
}

/// The last time before bounds exceed kCertifiedShare.
double TrustHorizonOf(const Reference& reference, double length) {
  double horizon = 0.0;
  for (std::size_t k = 0; k < reference.bounds.size(); ++k) {
    if (!(reference.bounds[k].position <= kCertifiedShare * length)) break;
    horizon = reference.times[k];
  }
  return horizon;
}

}  // namespace

std::string WhyNoReference(const MechanismDescription& user, const ReferenceOptions& options) {
  for (const JointDescription& joint : user.joints) {
    if (!IsBuiltIn(joint.type)) return "joint \"" + joint.name + "\" is of another program";
  }
  for (const ForceDescription& force : user.forces) {
    if (std::holds_alternative<OtherForce>(force)) return "a force is of another program";
  }
  if (options.scalar == "float128" && !IsPlanar(Compile(user, InOnePiece()))) {
    return "float128 is for planar mechanisms";
  }
  return "";
}

Reference MakeReference(const MechanismDescription& user, double horizon, double length,
                        const ReferenceOptions& options, WaysTried tried) {
  Reference empty;
  empty.scalar = options.scalar;
  for (int k = 0; k < options.points; ++k) {
    empty.times.push_back(k + 1 == options.points ? horizon : horizon * k / (options.points - 1));
  }
  empty.message = WhyNoReference(user, options);
  if (!empty.message.empty()) {
    empty.outcome = "unsupported";
    return empty;
  }
  const Compiled compiled = Compile(user, InOnePiece());
  const Measured measured{user, compiled};
  std::optional<Reference> furthest;
  double cpu_s = 0.0;
  std::vector<Way> ways = WaysOf(measured, options);
  if (tried == WaysTried::kCheapest) ways.resize(1);
  if (tried == WaysTried::kFurthest) ways.erase(ways.begin(), ways.end() - 1);
  for (const Way& way : ways) {
    Reference reference = empty;
    way(&reference);
    reference.trust_horizon = TrustHorizonOf(reference, length);
    cpu_s += reference.cpu_s;
    if (!furthest || reference.trust_horizon > furthest->trust_horizon) {
      furthest = std::move(reference);
    }
    if (furthest->trust_horizon >= horizon) break;
  }
  furthest->cpu_s = cpu_s;  // total of all attempts
  return *std::move(furthest);
}

}  // namespace loopbench::harness
