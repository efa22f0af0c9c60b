// Paths of a mechanism, and their bodies as the links of pins.h. Each body has a joint to the
// previous and to the next one; any may have one to Ground. Chains, ladders and arms are paths.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "mechanism/model/mechanism.h"
#include "odca/pins.h"
#include "odca/plan.h"

namespace loopbench::odca::pins {

struct PathBody {
  int body = 0;
  int before = -1;  ///< joint to the body before it, -1 for the first
  int ground = -1;  ///< joint to Ground, -1 without
};
using Path = std::vector<PathBody>;

/// Returns all bodies on paths, or none if bodies do not form paths: a body has joints to three
/// others, two to the same or two to Ground, or a ring is closed without an end.
std::vector<Path> FindPaths(int num_bodies, std::span<const PlanJoint> joints);

struct PathLinks {
  Path path;  ///< in one direction or the other
  std::vector<Link<double>> links;
  std::vector<Closure<double>> closures;
  std::vector<double> axes;  ///< angle of a link's axes relative to its body [rad]
  bool has_loops = false;    ///< any joint is cut
  /// true if the last body's joint to Ground is cut: a handle 2, not the link's pin
  bool ends_at_ground = false, ground_is_P = false;
  Vector2<double> end = {0.0, 0.0};
  double end_limit = 0.0;
};

/// Measures a path in a direction in which every cut joint of two bodies precedes one with a tree
/// joint to Ground, and a cut joint to Ground is the last body's; returns nothing if there is none.
/// Limits of links are zero. All joints must be pins.
std::optional<PathLinks> MeasurePath(const Mechanism<Planar, double>& mechanism, const Path& path);

/// Returns the body between the joints `before` and `after` (null: none), pinned to Ground or not,
/// relative to the centre of mass; `axes`, if requested, as in PathLinks. The limit is zero.
Link<double> MeasureLink(const Inertia<Planar, double>& inertia,
                         const Linear<Planar, double>& gravity, const Vector2<double>* pin,
                         const Vector2<double>* before = nullptr,
                         const Vector2<double>* after = nullptr, double* axes = nullptr);

/// Returns the place of a joint on one of its bodies: from the centre of mass, in body axes.
Vector2<double> ArmOf(const Joint<Planar, double>& joint, int body);

/// Returns true if all joints are pins with coordinates or constraints, as the passes over pins
/// require.
bool HasOnlyPins(const Mechanism<Planar, double>& mechanism);

/// Returns the smallest response of a joint that closes a loop: the suspicious pivot of
/// loop_solver.h times the trace of the response of its two bodies alone. For Link::limit.
double LimitOf(const Mechanism<Planar, double>& mechanism, int joint);

}  // namespace loopbench::odca::pins
