// The user's mechanism at given motions of its bodies, and labels of columns.

#include <cmath>

#include "harness/base/text.h"
#include "harness/observers/trajectory.h"

namespace loopbench::harness {
namespace {

template <class Space, class Kind>
Eigen::Vector3d LinearOf(const SpatialVector<Space, double, Kind>& V) {
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  for (int i = 0; i < Space::kLin; ++i) v[i] = V.linear[i];
  return v;
}
template <class Space, class Kind>
Eigen::Vector3d AngularOf(const SpatialVector<Space, double, Kind>& V) {
  Eigen::Vector3d w = Eigen::Vector3d::Zero();
  for (int i = 0; i < Space::kRot; ++i) w[Space::kRot == 1 ? 2 : i] = V.angular[i];
  return w;
}

/// Returns the motion of the centre of mass, in the part's ground axes.
template <class Space>
BodyMotion AtCentre(const Pose<Space, double>& pose, const Velocity<Space, double>& V) {
  BodyMotion motion;
  for (int i = 0; i < Space::kLin; ++i) {
    motion.pose.p[i] = pose.p[i];
    for (int j = 0; j < Space::kLin; ++j) motion.pose.R(i, j) = pose.R(i, j);
  }
  if constexpr (Space::kRot == 1) motion.angle = pose.angle;
  motion.velocity = LinearOf(V);
  motion.angular_velocity = AngularOf(V);
  motion.acceleration = motion.angular_acceleration = Eigen::Vector3d::Constant(std::nan(""));
  return motion;
}

}  // namespace

std::vector<BodyMotion> AtRest(const Compiled& compiled) {
  std::vector<BodyMotion> bodies(compiled.bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (compiled.bodies[i].part >= 0) continue;
    bodies[i].pose = compiled.bodies[i].X;
    bodies[i].angle = compiled.bodies[i].turn;
  }
  return bodies;
}

template <class Space>
void EnterPart(const Compiled& compiled, int part, const Kinematics<Space, double>& kinematics,
               std::span<const Acceleration<Space, double>> accelerations,
               std::vector<BodyMotion>* bodies) {
  const CompiledPart& own = compiled.parts[static_cast<std::size_t>(part)];
  for (std::size_t i = 0; i < compiled.bodies.size(); ++i) {
    const BodyImage& image = compiled.bodies[i];
    if (image.part != part) continue;
    const auto b = static_cast<std::size_t>(image.body);
    BodyMotion carrier = AtCentre<Space>(kinematics.poses()[b], kinematics.motions()[b]);
    if (!accelerations.empty()) {
      carrier.acceleration = LinearOf(accelerations[b]);
      carrier.angular_acceleration = AngularOf(accelerations[b]);
    }
    Eigen::Vector3d com = own.description.bodies[b].com;
    if (Space::kRot == 1) com.z() = 0.0;
    // the user's origin relative to the carrier's centre of mass, in carrier axes
    const Eigen::Vector3d at = image.X.p - com;
    BodyMotion& body = (*bodies)[i];
    body.pose = {own.R_WC * carrier.pose.R * image.X.R, own.R_WC * carrier.PointAt(at)};
    body.angle = carrier.angle + image.turn;
    body.velocity = own.R_WC * carrier.VelocityAt(at);
    body.angular_velocity = own.R_WC * carrier.angular_velocity;
    body.acceleration = own.R_WC * carrier.AccelerationAt(at);
    body.angular_acceleration = own.R_WC * carrier.angular_acceleration;
  }
}

#define LOOPBENCH_INSTANTIATE(Space)                                              \
  template void EnterPart(const Compiled&, int, const Kinematics<Space, double>&, \
                          std::span<const Acceleration<Space, double>>, std::vector<BodyMotion>*);
LOOPBENCH_INSTANTIATE(Planar)
LOOPBENCH_INSTANTIATE(Spatial)
#undef LOOPBENCH_INSTANTIATE

template <class Space>
UserMechanism<Space>::UserMechanism(const MechanismDescription& user)
    : mechanism_(Unreleased(user), Coordinates::kAbsolute),
      kinematics_(mechanism_),
      q_(VectorX<double>::Zero(mechanism_.num_q())),
      u_(VectorX<double>::Zero(mechanism_.num_u())) {
  for (const BodyDescription& body : user.bodies) com_.push_back(body.com);
}

template <class Space>
void UserMechanism<Space>::Set(double t, std::span<const BodyMotion> bodies,
                               std::span<const double> followed) {
  for (const TreeStep& step : mechanism_.tree()) {
    // virtual free joint from Ground to the centre of mass
    const Joint<Space, double>& joint = mechanism_.joints()[step.joint];
    const auto b = static_cast<std::size_t>(step.child);
    const BodyMotion& body = bodies[b];
    const Eigen::Vector3d p = body.PointAt(com_[b]), v = body.VelocityAt(com_[b]);
    double* q = q_.data() + joint.q_offset;
    double* u = u_.data() + joint.u_offset;
    if constexpr (Space::kRot == 1) {
      q[0] = body.angle;
      u[0] = body.angular_velocity.z();
    } else {
      Pose<Space, double> X;
      X.R = Rotation<Space, double>(body.pose.R);
      ToQuaternion(X.R, q);
      for (int i = 0; i < 3; ++i) u[i] = body.angular_velocity[i];
    }
    for (int i = 0; i < Space::kLin; ++i) {
      q[joint.kind->num_q - Space::kLin + i] = p[i];
      u[Space::kRot + i] = v[i];
    }
  }
  kinematics_.SetTime(t);
  for (std::size_t j = 0; j < followed.size(); ++j) {
    if (std::isfinite(followed[j])) kinematics_.ContinueFrom(static_cast<int>(j), followed[j]);
  }
  kinematics_.UpdatePosition(q_);
  kinematics_.UpdateVelocity(u_);
  kinematics_.AcceptStep();
}

template <class Space>
const Direction<Space, double>& UserMechanism<Space>::DirectionOfSpeed(int index, int i) const {
  const Joint<Space, double>& joint = mechanism_.joints()[index];
  const JointState<Space, double>& state = kinematics_.joints()[index];
  const int drive = mechanism_.DriveOf(joint, i);
  if (drive >= 0) return state.D(drive - joint.first_drive);
  int free = i;
  for (int k = 0; k < i; ++k) free -= mechanism_.DriveOf(joint, k) >= 0;
  return state.H(free);
}

template <class Space>
void UserMechanism<Space>::Measure(int index, double* q, double* u) const {
  const Joint<Space, double>& joint = mechanism_.joints()[index];
  const auto& poses = kinematics_.poses();
  const Pose<Space, double> X_FM = Compose(Inverse(Compose(poses[joint.from], joint.X_PF)),
                                           Compose(poses[joint.to], joint.X_QM));
  joint.kind->coordinates(X_FM, q, joint.kind->parameter);
  if (joint.kind->num_u == 1) q[0] = kinematics_.JointCoordinate(index);
  const Velocity<Space, double>& V = kinematics_.joints()[index].V_rel;
  for (int i = 0; i < joint.kind->num_u; ++i) {
    u[i] = joint.kind->inverse_H_squared * DirectionOfSpeed(index, i).dot(V);
  }
}

template <class Space>
JointMismatch UserMechanism<Space>::MismatchOf(int index) const {
  const JointState<Space, double>& state = kinematics_.joints()[index];
  const Components<Space, double> positions =
      state.Along(kinematics_.ConstraintMismatch(index), state.rows());
  const Components<Space, double> speeds = kinematics_.ConstraintSpeed(index);
  Direction<Space, double> shift = state.Sum(positions, state.rows());
  Direction<Space, double> rate = state.Sum(speeds, state.rows());
  return {.shift = shift.linear.norm(),
          .rotation = shift.angular.norm(),
          .velocity = rate.linear.norm(),
          .angular_velocity = rate.angular.norm()};
}

template <class Space>
double UserMechanism<Space>::RelativeMismatch() const {
  double largest = 0.0;
  for (const int joint : mechanism_.constraints()) {
    const JointMismatch mismatch = MismatchOf(joint);
    largest = std::max({largest, mismatch.rotation, mismatch.shift / mechanism_.length()});
  }
  return largest;
}

template class UserMechanism<Planar>;
template class UserMechanism<Spatial>;

std::string TrajectoryColumn::Label() const {
  if (kind == component) return fmt::format("{} [{}]", kind, unit);
  return fmt::format("{}{}:{} [{}]", kind, name.empty() ? "" : ":" + name, component, unit);
}

std::string LabelName(std::string_view name) {
  std::string marked;
  for (const char c : name) {
    if (c == ':' || c == '\\') marked += '\\';
    marked += c;
  }
  return EscapeTerminal(marked);
}

std::optional<TrajectoryColumn> ParseLabel(std::string_view label) {
  const std::size_t bracket = label.rfind(" [");
  if (bracket == std::string_view::npos || !label.ends_with(']')) return std::nullopt;
  TrajectoryColumn column;
  column.unit = label.substr(bracket + 2, label.size() - bracket - 3);
  label = label.substr(0, bracket);
  // components have no colon; colons in names follow a backslash
  const std::size_t first = label.find(':'), last = label.rfind(':');
  column.kind = label.substr(0, first);
  column.component = first == std::string_view::npos ? label : label.substr(last + 1);
  if (first == std::string_view::npos && label != "t") return std::nullopt;
  if (first != last) column.name = label.substr(first + 1, last - first - 1);
  if (column.kind.empty() || column.component.empty()) return std::nullopt;
  return column;
}

}  // namespace loopbench::harness
