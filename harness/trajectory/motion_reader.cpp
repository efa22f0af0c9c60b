#include <fmt/format.h>

#include <limits>
#include <memory>
#include <stdexcept>

#include "harness/trajectory/check.h"

namespace loopbench::harness {
namespace {

/// Where columns stand in a file, and which of them do not.
class Places {
 public:
  explicit Places(const std::vector<TrajectoryColumn>& columns) : columns_(columns) {}

  /// The places of all of `wanted`; those that are not there go to `missing`.
  std::vector<std::size_t> Of(const std::vector<TrajectoryColumn>& wanted,
                              std::vector<std::string>* missing) const {
    std::vector<std::size_t> places;
    for (const TrajectoryColumn& column : wanted) {
      const auto at = std::ranges::find(columns_, column);
      if (at == columns_.end()) missing->push_back(column.Label());
      places.push_back(static_cast<std::size_t>(at - columns_.begin()));
    }
    return places;
  }

 private:
  const std::vector<TrajectoryColumn>& columns_;
};

std::string Listed(const std::vector<std::string>& labels) {
  constexpr std::size_t kMost = 6;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, labels.size()); ++i) {
    text += fmt::format("{}\"{}\"", i == 0 ? "" : ", ", labels[i]);
  }
  if (labels.size() > kMost) text += fmt::format(" and {} more", labels.size() - kMost);
  return text;
}

/// A mechanism that joint coordinates put in place.
struct ByJoints {
  virtual ~ByJoints() = default;
  virtual void Set(double t, const std::vector<double>& row, bool has_speeds,
                   std::vector<BodyMotion>* bodies) = 0;
};

template <class Space>
struct ByJointsIn final : ByJoints {
  ByJointsIn(const MechanismDescription& user, const Places& places,
             std::vector<std::string>* missing, std::vector<std::string>* no_speed)
      : compiled(Compile(user, CompileOptions::None())),
        mechanism(Unreleased(user), Coordinates::kJoint),
        kinematics(mechanism),
        q(VectorX<double>::Zero(mechanism.num_q())),
        u(VectorX<double>::Zero(mechanism.num_u())) {
    for (const TreeStep& step : mechanism.tree()) {
      const Joint<Space, double>& joint = mechanism.joints()[step.joint];
      if (joint.description < 0) {
        // nothing but a virtual joint leads there
        missing->push_back("a joint of body " + mechanism.body_names()[step.child]);
        continue;
      }
      const auto columns = JointColumns(user, static_cast<std::size_t>(joint.description));
      // prescribed coordinates follow their function, whatever a file says
      std::vector<TrajectoryColumn> q_of, u_of;
      for (int i = 0; i < joint.kind->num_q; ++i) {
        if (mechanism.DriveOf(joint, i) < 0) q_of.push_back(columns[i]);
      }
      for (int i = 0; i < joint.kind->num_u; ++i) {
        if (mechanism.DriveOf(joint, i) < 0) u_of.push_back(columns[joint.kind->num_q + i]);
      }
      for (const std::size_t at : places.Of(q_of, missing)) of_q.push_back(at);
      for (const std::size_t at : places.Of(u_of, no_speed)) of_u.push_back(at);
    }
  }

  void Set(double t, const std::vector<double>& row, bool has_speeds,
           std::vector<BodyMotion>* bodies) override {
    std::size_t next_q = 0, next_u = 0;
    for (const TreeStep& step : mechanism.tree()) {
      const Joint<Space, double>& joint = mechanism.joints()[step.joint];
      for (int i = 0; i < joint.num_q(); ++i) q[joint.q_offset + i] = row[of_q[next_q++]];
      for (int i = 0; i < joint.num_u(); ++i) {
        const std::size_t at = of_u[next_u++];
        if (has_speeds) u[joint.u_offset + i] = row[at];
      }
    }
    kinematics.SetTime(t);
    kinematics.UpdatePosition(q);
    kinematics.UpdateVelocity(u);
    EnterPart<Space>(compiled, 0, kinematics, {}, bodies);
  }

  Compiled compiled;
  Mechanism<Space, double> mechanism;
  Kinematics<Space, double> kinematics;
  VectorX<double> q, u;
  std::vector<std::size_t> of_q, of_u;  ///< columns, in the order of the tree
};

}  // namespace

struct MotionReader::Work {
  const MechanismDescription& user;
  std::vector<BodyMotion> bodies;
  std::vector<std::vector<std::size_t>> of_body;  ///< pose and speeds; empty: by joints
  std::unique_ptr<ByJoints> joints;
  bool has_speeds = false;
};

MotionReader::MotionReader(const MechanismDescription& user,
                           const std::vector<TrajectoryColumn>& columns, const std::string& file)
    : work_(new Work{user, std::vector<BodyMotion>(user.bodies.size()), {}, nullptr, false}) {
  const Places places(columns);
  const std::size_t pose = user.space == SpaceKind::kPlanar ? 3 : 7;
  std::vector<std::string> no_pose, no_speed;
  work_->of_body.resize(user.bodies.size());
  for (std::size_t b = 1; b < user.bodies.size(); ++b) {
    const auto wanted = BodyColumns(user, b);
    const auto speeds = wanted.begin() + static_cast<std::ptrdiff_t>(pose);
    work_->of_body[b] = places.Of({wanted.begin(), speeds}, &no_pose);
    const auto more = places.Of({speeds, wanted.end()}, &no_speed);
    work_->of_body[b].insert(work_->of_body[b].end(), more.begin(), more.end());
  }
  work_->has_speeds = no_speed.empty();
  if (no_pose.empty()) return;
  work_->of_body.clear();
  std::vector<std::string> no_joint;
  no_speed.clear();
  if (user.space == SpaceKind::kPlanar) {
    work_->joints = std::make_unique<ByJointsIn<Planar>>(user, places, &no_joint, &no_speed);
  } else {
    work_->joints = std::make_unique<ByJointsIn<Spatial>>(user, places, &no_joint, &no_speed);
  }
  work_->has_speeds = no_speed.empty();
  if (no_joint.empty()) return;
  throw std::runtime_error(
      fmt::format("{}: found neither the poses of all bodies nor the coordinates of joints that "
                  "lead to them, expected {}, or else {}",
                  file, Listed(no_pose), Listed(no_joint)));
}

MotionReader::~MotionReader() = default;

bool MotionReader::from_joints() const { return work_->joints != nullptr; }
bool MotionReader::has_speeds() const { return work_->has_speeds; }

const std::vector<BodyMotion>& MotionReader::Read(double t, const std::vector<double>& row) {
  Work& work = *work_;
  if (work.joints) {
    work.joints->Set(t, row, work.has_speeds, &work.bodies);
    return work.bodies;
  }
  const bool planar = work.user.space == SpaceKind::kPlanar;
  const std::size_t pose = planar ? 3 : 7;
  for (std::size_t b = 1; b < work.bodies.size(); ++b) {
    const std::vector<std::size_t>& at = work.of_body[b];
    BodyMotion& body = work.bodies[b];
    body.pose = PoseColumns{at, planar}.At(row.data());
    if (planar) body.angle = row[at[2]];
    if (!work.has_speeds) continue;
    const auto value = [&](std::size_t i) { return row[at[pose + i]]; };
    body.velocity = {value(0), value(1), planar ? 0.0 : value(2)};
    body.angular_velocity = planar ? Eigen::Vector3d(0.0, 0.0, value(2))
                                   : Eigen::Vector3d(value(3), value(4), value(5));
  }
  return work.bodies;
}

}  // namespace loopbench::harness
