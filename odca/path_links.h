// A path's bodies (paths.h) as the links of two_handle.h.
#pragma once

#include <optional>

#include "mechanism/model/mechanism.h"
#include "odca/paths.h"
#include "odca/two_handle.h"

namespace loopbench::odca::pins {

struct PathLinks {
  Path path;  ///< in one direction or the other
  std::vector<Link<double>> links;
  std::vector<Closure<double>> closures;
  std::vector<double> axes;  ///< angle of a link's axes in those of its body [rad]
  bool has_loops = false;    ///< any joint is cut
  /// The last body's joint to Ground, where it is cut: a handle 2, not the link's pin.
  bool ends_at_ground = false, ground_is_P = false;
  Vector2<double> end = {0.0, 0.0};
  double end_limit = 0.0;
};

/// In a direction in which every cut joint of two bodies stands before one with a joint of the tree
/// to Ground, and a cut joint to Ground is the last body's; nothing where there is none. Limits of
/// links are zero. All joints must be pins.
std::optional<PathLinks> MeasurePath(const Mechanism<Planar, double>& mechanism, const Path& path);

/// The body between the joints `before` and `after` (null: none), with or without a pin on Ground,
/// all seen from the centre of mass; `axes`, if asked for, as in PathLinks. The limit is zero.
Link<double> MeasureLink(const Inertia<Planar, double>& inertia,
                         const Linear<Planar, double>& gravity, const Vector2<double>* pin,
                         const Vector2<double>* before = nullptr,
                         const Vector2<double>* after = nullptr, double* axes = nullptr);

/// Whether all joints are pins with coordinates or constraints of their own: what sweeps over pins
/// are made for.
bool HasOnlyPins(const Mechanism<Planar, double>& mechanism);

/// Least response of a joint that closes a loop: what loop_solver.h calls suspicious times the
/// trace of the response of its two bodies alone. For Link::limit.
double LimitOf(const Mechanism<Planar, double>& mechanism, int joint);

}  // namespace loopbench::odca::pins
