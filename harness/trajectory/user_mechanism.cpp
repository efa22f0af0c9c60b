#include "harness/trajectory/user_mechanism.h"

#include <algorithm>

namespace loopbench::harness {

template <class Space>
UserMechanism<Space>::UserMechanism(const MechanismDescription& user)
    : mechanism_(Unreleased(user), Coordinates::kAbsolute),
      kinematics_(mechanism_),
      q_(VectorX<double>::Zero(mechanism_.num_q())),
      u_(VectorX<double>::Zero(mechanism_.num_u())) {
  for (const BodyDescription& body : user.bodies) com_.push_back(body.com);
}

template <class Space>
void UserMechanism<Space>::Set(double t, std::span<const BodyMotion> bodies) {
  for (const TreeStep& step : mechanism_.tree()) {
    // a virtual free joint from Ground to the centre of mass
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
  kinematics_.UpdatePosition(q_);
  kinematics_.UpdateVelocity(u_);
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

}  // namespace loopbench::harness
