#include "harness/analysis/coordinate_range.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "harness/analysis/structure_hints.h"
#include "mechanism/simplify/compile.h"
#include "mechanism/start/branches.h"
#include "mechanism/start/guesses.h"

namespace loopbench::harness {
namespace {

using Eigen::Vector3d;

/// First step, and the negligible one: about the accepted gaps [rad, or lengths].
constexpr double kStep = 0.05, kLeast = 1e-11;
/// Largest change of a pose in one step that is no jump to another branch [rad, or lengths].
/// Near a limit poses change by the square root of a step.
constexpr double kJump = 0.5;
constexpr double kFar = 10.0;     ///< [lengths]
constexpr double kInLine = 1e-4;  ///< sine of an angle: the root of a limit's accuracy, and more
constexpr double kGap = 1e-15;    ///< accuracy of the input meanwhile: round-off decides

/// A closed position.
struct Place {
  MechanismDescription description;  ///< with it as its start
  std::vector<Frame> bodies;         ///< at their origins
};

template <class Space>
class RangeSearch {
 public:
  RangeSearch(Place start, int joint, double length)
      : start_(std::move(start)), joint_(joint), length_(length) {
    const auto words =
        ValueWords(start_.description.joints[joint].type, start_.description.space, false);
    if (words.front().is_length()) unit_ = length_, far_ = kFar * length_;
  }

  RangeEnd Run(int sign) const {
    RangeEnd end;
    Place here = start_;
    const double from = ValueIn(here.description);
    double step = kStep * unit_;
    while (!end.binds && std::abs(ValueIn(here.description) - from) < far_) {
      MechanismDescription next = here.description;
      double& value = ValueIn(next);
      const double least = kLeast * std::max(unit_, std::abs(value));
      value = from + sign * std::min(far_, std::abs(value - from) + step);
      Place there;
      if (Close(std::move(next), &there).empty() && Apart(here, there) <= kJump) {
        here = std::move(there);
      } else {
        step /= 2;
        end.binds = step < least;
      }
    }
    end.value = ValueIn(here.description);
    if (end.binds) end.in_line = InLine(here.bodies);
    end.at = std::move(here.description);
    return end;
  }

  /// Assembles a description into a place; returns the reason if it does not close.
  static std::string Close(MechanismDescription description, Place* place) {
    const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
    const Start<double> start = Assemble<Space>(description, mechanism);
    if (start.outcome == Outcome::kInconsistentStart) return start.message;
    description.initial.coordinates = TreeValues(mechanism, start.q);
    std::erase_if(description.initial.coordinates, [&](const JointValues& values) {
      return !description.joints[values.joint].motions.empty();
    });
    Kinematics<Space, double> kinematics(mechanism);
    kinematics.UpdatePosition(start.q);
    const Compiled compiled = Compile(description, CompileOptions::None());
    place->bodies.clear();
    for (int body = 0; body < mechanism.num_bodies(); ++body) {
      place->bodies.push_back(UserPose(compiled, body, &kinematics));
    }
    place->description = std::move(description);
    return "";
  }

 private:
  double& ValueIn(MechanismDescription& description) const {
    return std::ranges::find(description.initial.coordinates, joint_, &JointValues::joint)
        ->values.front();
  }
  double ValueIn(const MechanismDescription& description) const {
    return std::ranges::find(description.initial.coordinates, joint_, &JointValues::joint)
        ->values.front();
  }

  double Apart(const Place& a, const Place& b) const {
    double apart = 0.0;
    for (std::size_t body = 1; body < a.bodies.size(); ++body) {
      const Frame &X = a.bodies[body], &Y = b.bodies[body];
      // |A - B| = 2 sqrt(2) sin(angle / 2)
      apart =
          std::max({apart, (X.R - Y.R).norm() / std::numbers::sqrt2, (X.p - Y.p).norm() / length_});
    }
    return apart;
  }

  /// Joints whose bodies have another joint each, all three points in a line.
  std::vector<std::string> InLine(const std::vector<Frame>& bodies) const {
    const MechanismDescription& of = start_.description;
    const auto point_of = [&](const JointSide& side) -> Vector3d {
      return bodies[side.body].p + bodies[side.body].R * side.position;
    };
    std::vector<std::string> names;
    for (const JointDescription& at : of.joints) {
      if (at.from.body == kGround || at.to.body == kGround) continue;
      const Vector3d middle = point_of(at.to);
      const auto arms = [&](int body) {
        std::vector<Vector3d> found;
        for (const JointDescription& other : of.joints) {
          for (const JointSide& side : {other.from, other.to}) {
            if (&other == &at || side.body != body) continue;
            const Vector3d arm = point_of(side) - middle;
            if (arm.norm() > kInLine * length_) found.push_back(arm.normalized());
          }
        }
        return found;
      };
      const std::vector<Vector3d> before = arms(at.from.body), after = arms(at.to.body);
      const bool is_straight = std::ranges::any_of(before, [&](const Vector3d& a) {
        return std::ranges::any_of(after,
                                   [&](const Vector3d& b) { return a.cross(b).norm() <= kInLine; });
      });
      if (!is_straight) continue;
      names.push_back(fmt::format("{} and {} at {}", of.bodies[at.from.body].name,
                                  of.bodies[at.to.body].name, at.name));
    }
    return names;
  }

  Place start_;
  int joint_;
  double length_, unit_ = 1.0, far_ = 2 * std::numbers::pi;  ///< of the coordinate [rad] or [m]
};

template <class Space>
void Search(const MechanismDescription& description, int joint, CoordinateRange* range) {
  const Structure structure = AnalyseStructure(description);
  const JointDescription& described = description.joints[joint];
  // gaps within the accuracy of rounded input would blur the limits
  MechanismDescription exact = description;
  exact.accuracy = std::min(kGap, description.accuracy);
  Place start;
  range->why = RangeSearch<Space>::Close(exact, &start);
  if (!range->why.empty()) range->why = RangeSearch<Space>::Close(description, &start);
  if (!range->why.empty()) return;
  InitialDescription& initial = start.description.initial;
  const auto own = std::ranges::find(initial.coordinates, joint, &JointValues::joint);
  if (own == initial.coordinates.end()) {
    range->why = fmt::format("\"{}\" closes a loop, expected a joint with an initial coordinate",
                             described.name);
    return;
  }
  range->start = own->values.front();
  if (std::ranges::find(initial.held, joint) == initial.held.end()) initial.held.push_back(joint);
  const int free = FindBranches(start.description, 0).freedom -
                   static_cast<int>(FindIdleFreedoms(description, structure).size());
  if (free > 0) {
    range->why = fmt::format(
        "{} other motions remain if \"{}\" is held, expected none: list as many coordinates under "
        "\"fixed\"",
        free, described.name);
    return;
  }
  const RangeSearch<Space> search(std::move(start), joint, structure.length);
  range->low = search.Run(-1);
  range->high = search.Run(1);
}

}  // namespace

CoordinateRange FindRange(MechanismDescription description, int joint) {
  CoordinateRange range;
  JointDescription& described = description.joints[joint];
  const auto words = ValueWords(described.type, description.space, false);
  if (words.size() != 1) {
    range.why = fmt::format("\"{}\" is {}, expected a joint with one coordinate", described.name,
                            ToString(described.type));
    return range;
  }
  std::vector<JointValues>& given = description.initial.coordinates;
  if (!described.motions.empty()) {
    std::erase_if(given, [=](const JointValues& values) { return values.joint == joint; });
    given.push_back({joint, {TimeFunction(described.motions[0].value).At(0.0).value}});
    described.motions.clear();
  }
  description.initial.speeds.clear();
  description.initial.poses.clear();  // they hold at the start only
  if (description.space == SpaceKind::kPlanar) {
    Search<Planar>(description, joint, &range);
  } else {
    Search<Spatial>(description, joint, &range);
  }
  return range;
}

}  // namespace loopbench::harness
