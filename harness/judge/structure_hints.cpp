#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <ranges>
#include <set>

#include "harness/base/text.h"
#include "harness/judge/analysis.h"
#include "mechanism/description/joint_frames.h"
#include "mechanism/model/kinematics.h"
#include "mechanism/simplify/compile.h"
#include "mechanism/start/branches.h"
#include "mechanism/start/closure.h"

namespace loopbench::harness {

namespace {

using Eigen::Vector3d;

/// Radius of gyration over the size of a body beyond which, or below its inverse, units may be
/// mixed. Bodies of usual shapes have 0.1 to 1; g for kg gives 1/30, mm for m 1000 times.
constexpr double kOddGyration = 100.0;

std::string BodyNames(const MechanismDescription& description, const std::vector<int>& bodies) {
  constexpr std::size_t kMaxNames = 6;
  std::vector<std::string> names =
      Mapped<std::string>(bodies | std::views::take(kMaxNames),
                          [&](int body) { return description.bodies[body].name; });
  if (bodies.size() > kMaxNames) names.push_back(fmt::format("{} more", bodies.size() - kMaxNames));
  return ListInWords(names);
}

struct Line {
  Vector3d point, direction;
};

class IdleSearch {
 public:
  IdleSearch(const MechanismDescription& description, const Structure& structure)
      : description_(description),
        mechanism_(description, Coordinates::kJoint),
        kinematics_(mechanism_),
        group_(description.bodies.size()) {
    kinematics_.UpdatePosition(structure.start.q);
  }

  std::vector<IdleFreedom> Run() {
    std::vector<std::vector<int>> joints_of(description_.bodies.size());
    for (int j = 0; j < static_cast<int>(description_.joints.size()); ++j) {
      for (const int body : {At(j).from, At(j).to}) joints_of[body].push_back(j);
    }
    std::vector<IdleFreedom> idle;
    std::ranges::fill(group_, -1);
    for (int first = 0; first < static_cast<int>(group_.size()); ++first) {
      if (group_[first] >= 0) continue;
      IdleFreedom found{{first}, {}};
      group_[first] = first;
      for (std::size_t i = 0; i < found.bodies.size(); ++i) {
        for (const int j : joints_of[found.bodies[i]]) {
          if (At(j).kind->num_u > 1) {
            found.joints.push_back(j);
            continue;
          }
          for (const int body : {At(j).from, At(j).to}) {
            if (group_[body] >= 0) continue;
            group_[body] = first;
            found.bodies.push_back(body);
          }
        }
      }
      if (first != kGround && IsIdle(found)) idle.push_back(std::move(found));
    }
    return idle;
  }

 private:
  const Joint<Spatial, double>& At(int joint) const { return mechanism_.joints()[joint]; }

  Vector3d PointOn(int group, int j) const {
    const bool is_second = group_[At(j).to] == group;
    const Pose<Spatial, double>& X_W = kinematics_.poses()[is_second ? At(j).to : At(j).from];
    return Compose(X_W, is_second ? At(j).X_QM : At(j).X_PF).p.eigen();
  }

  bool IsIdle(const IdleFreedom& found) const {
    const int group = group_[found.bodies.front()];
    std::set<int> others;
    Line line{Vector3d::Zero(), Vector3d::Zero()};
    for (const int j : found.joints) {
      const int from = group_[At(j).from], to = group_[At(j).to];
      if (from == to) return false;  // the group holds itself
      others.insert(from == group ? At(j).to : At(j).from);
      const Vector3d point = PointOn(group, j);
      if (j == found.joints.front()) line.point = point;
      Vector3d along = point - line.point;
      if (description_.joints[j].type == JointType::kCylindrical) {
        const Pose<Spatial, double>& X_W = kinematics_.poses()[At(j).from];
        along = mechanism_.length() * Compose(X_W, At(j).X_PF).R.eigen().col(2);
      }
      if (along.norm() > line.direction.norm()) line.direction = along;
    }
    if (others.size() < 2 || line.direction.norm() <= Tolerance()) return false;
    line.direction.normalize();
    return std::ranges::all_of(found.joints, [&](int j) { return Permits(group, j, line); });
  }

  /// Returns true if the joint's point lies on the line and its constraints permit the spin.
  bool Permits(int group, int j, const Line& line) const {
    const Vector3d arm = PointOn(group, j) - line.point;
    if (arm.cross(line.direction).norm() > Tolerance()) return false;
    const Vector3d rate = line.direction.cross(kinematics_.JointPoint(j).eigen() - line.point);
    const JointState<Spatial, double>& state = kinematics_.joints()[j];
    for (int i = 0; i < state.directions(); ++i) {
      const Direction<Spatial, double>& D = state.D(i);
      const double speed =
          D.angular.eigen().dot(line.direction) + D.linear.eigen().dot(rate) / mechanism_.length();
      if (std::abs(speed) > description_.accuracy) return false;
    }
    return true;
  }

  double Tolerance() const { return description_.accuracy * mechanism_.length(); }

  const MechanismDescription& description_;
  Mechanism<Spatial, double> mechanism_;
  Kinematics<Spatial, double> kinematics_;
  std::vector<int> group_;  ///< first body of its group, by body
};

/// Returns the extent [m] of the joints and the centre of mass of each body.
std::vector<double> SizesOf(const MechanismDescription& description) {
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const BodyDescription& body : description.bodies) boxes.emplace_back(body.com);
  for (const JointDescription& joint : description.joints) {
    if (joint.type == JointType::kFree) continue;
    for (const JointSide& side : {joint.from, joint.to}) boxes[side.body].extend(side.position);
  }
  return Mapped<double>(boxes,
                        [](const Eigen::AlignedBox3d& box) { return box.diagonal().norm(); });
}

/// Returns true for welds, rods, and balanced rotors: a centre of mass on a hinge's axis.
bool MayEndAt(const MechanismDescription& description, const JointDescription& joint,
              const JointSide& side, double size) {
  if (joint.type == JointType::kWeld || joint.type == JointType::kRod) return true;
  if (joint.type != JointType::kRevolute) return false;
  const Vector3d arm = description.bodies[side.body].com - side.position,
                 axis = PoseOf(side).R * AxisAlignment(joint).col(2);
  return arm.cross(axis).norm() <= description.accuracy * size;
}

/// Returns the root mean square distance [m] of the mass from the centre of mass, in the plane from
/// the normal through it.
double GyrationOf(const MechanismDescription& description, int body) {
  const BodyDescription& of = description.bodies[body];
  const bool planar = description.space == SpaceKind::kPlanar;
  return std::sqrt((planar ? of.inertia(2, 2) : of.inertia.trace() / 2) / of.mass);
}

}  // namespace

std::vector<IdleFreedom> FindIdleFreedoms(const MechanismDescription& description,
                                          const Structure& structure) {
  const bool is_closed = structure.start.outcome != Outcome::kInconsistentStart;
  if (description.space == SpaceKind::kPlanar || !is_closed) return {};
  return IdleSearch(description, structure).Run();
}

std::vector<std::string> NamesOf(const MechanismDescription& description,
                                 const std::vector<IdleFreedom>& idle) {
  std::vector<std::string> names;
  for (const auto& [bodies, joints] : idle) {
    const std::vector<std::string> points =
        Mapped<std::string>(joints, [&](int j) { return description.joints[j].name; });
    names.push_back(fmt::format("spin of {} about the line of its joints {}",
                                BodyNames(description, bodies), ListInWords(points)));
  }
  return names;
}

std::vector<std::string> FindHints(const MechanismDescription& description,
                                   const Structure& structure) {
  const std::vector<double> sizes = SizesOf(description);
  std::vector<int> joints_of(description.bodies.size()), odd, hanging;
  std::vector<bool> may_end(joints_of.size());  // chains end with such bodies on purpose
  for (const JointDescription& joint : description.joints) {
    if (joint.type == JointType::kFree) continue;
    for (const JointSide& side : {joint.from, joint.to}) {
      ++joints_of[side.body];
      if (MayEndAt(description, joint, side, sizes[side.body])) may_end[side.body] = true;
    }
  }
  std::vector<std::string> hints;
  for (int body = 1; body < static_cast<int>(joints_of.size()); ++body) {
    if (joints_of[body] == 1 && !may_end[body]) hanging.push_back(body);
    const double size = sizes[body],
                 ratio = size > 0.0 ? GyrationOf(description, body) / size : 1.0;
    if (ratio > kOddGyration || ratio < 1 / kOddGyration) odd.push_back(body);
  }
  if (!structure.loops.empty() && !hanging.empty()) {
    hints.push_back(
        fmt::format("{} {} by one joint and {} no loop, though other bodies do: is a "
                    "joint missing?",
                    BodyNames(description, hanging), hanging.size() == 1 ? "hangs" : "hang",
                    hanging.size() == 1 ? "closes" : "close"));
  }
  for (std::size_t i = 0; i < odd.size(); ++i) {
    constexpr std::size_t kMostHints = 6;
    if (i == kMostHints) {
      hints.push_back(fmt::format("so it is for {} more bodies", odd.size() - i));
      break;
    }
    const double size = sizes[odd[i]], gyration = GyrationOf(description, odd[i]);
    hints.push_back(fmt::format(
        "the radius of gyration of {} is {:.3g} m, {:.3g} times the extent {:.3g} m of its "
        "joints and centre of mass: {}mass in g, or lengths in mm?",
        description.bodies[odd[i]].name, gyration, gyration / size, size,
        gyration < size ? "a point mass, " : ""));
  }
  return hints;
}

std::string FreedomFault(const MechanismDescription& description, const ObservedQuantities& observe,
                         const Structure& structure) {
  if (!observe.expected || structure.start.outcome == Outcome::kInconsistentStart) return "";
  const auto& [expected, place] = *observe.expected;
  if (!structure.analysed) {
    return fmt::format("{}: found {} speeds, too many to count the degrees of freedom, expected {}",
                       place, structure.joint_u, expected);
  }
  if (structure.freedom() == expected) return "";
  std::vector<std::string> parts;
  constexpr std::size_t kMostParts = 12;
  for (const RedundantDirection& one : structure.redundant) {
    if (parts.size() == kMostParts) {
      parts.push_back("...");
      break;
    }
    parts.push_back(fmt::format("{}: {}", description.joints[one.joint].name, one.name));
  }
  std::string text = fmt::format("{}: found {}", place, structure.freedom());
  if (structure.freedom() != structure.freedom_at_start()) {
    text += fmt::format(" ({} at the start)", structure.freedom_at_start());
  }
  text += fmt::format(", expected {}", expected);
  if (!parts.empty()) {
    text += fmt::format("; redundant constraints ({}): {}", structure.redundant.size(),
                        fmt::join(parts, ", "));
  }
  const std::vector<IdleFreedom> idle = FindIdleFreedoms(description, structure);
  if (!idle.empty()) {
    text +=
        fmt::format("; idle ({}): {}", idle.size(), fmt::join(NamesOf(description, idle), ", "));
  }
  return text;
}

namespace {

/// First step, and the negligible one: about the accepted gaps [rad, or lengths].
constexpr double kStep = 0.05, kLeast = 1e-11;
/// Largest change of a pose in one step that is no jump to another branch [rad, or lengths].
/// Near a limit poses change by the square root of a step.
constexpr double kJump = 0.5;
constexpr double kFar = 10.0;     ///< [lengths]
constexpr double kInLine = 1e-4;  ///< sine of an angle: the root of a limit's accuracy, and more
constexpr double kGap = 1e-15;    ///< accuracy of the input meanwhile: round-off decides

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
    const double from = ValueIn(here);
    double step = kStep * unit_;
    while (!end.binds && std::abs(ValueIn(here) - from) < far_) {
      Place next = here, there;
      double& value = ValueIn(next);
      const double least = kLeast * std::max(unit_, std::abs(value));
      value = from + sign * std::min(far_, std::abs(value - from) + step);
      if (Close(std::move(next.description), &there).empty() && Apart(here, there) <= kJump) {
        here = std::move(there);
      } else {
        step /= 2;
        end.binds = step < least;
      }
    }
    end.value = ValueIn(here);
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
  double& ValueIn(Place& place) const {
    return std::ranges::find(place.description.initial.coordinates, joint_, &JointValues::joint)
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
  const auto freedom = [&, idle = FindIdleFreedoms(description, structure).size()] {
    return FindBranches(start.description, 0).freedom - static_cast<int>(idle);
  };
  // if "fixed" joints leave no motion, only the initial assembly holds them
  std::erase(initial.held, joint);
  if (freedom() <= 0) initial.held.clear();
  AddOnce(initial.held, joint);
  const int free = freedom();
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
