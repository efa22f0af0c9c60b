#include "mechanism/model/mechanism.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>
#include <stdexcept>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/description/joint_frames.h"
#include "mechanism/description/topology.h"

namespace loopbench {

namespace {

/// Joints of a body nearer to each other than this fraction of its size count as coincident, as do
/// joints separated by rounding.
constexpr double kOnePin = 1e-9;

/// A joint's frame in body axes, from the centre of mass.
template <class Space, class S>
Pose<Space, S> SidePose(const JointSide& side, const JointDescription& joint,
                        const Eigen::Vector3d& com) {
  Pose<Space, S> X;
  X.p = ToLinear<Space, S>(side.position - com);
  if constexpr (Space::kRot == 1) {
    double angle = side.rotation.z();
    if (TraitsOf(joint.type).own_axis == 'x' && !joint.axis.isZero()) {
      angle += std::atan2(joint.axis.y(), joint.axis.x());
    }
    X.SetAngle(S(angle));
  } else {
    X.R = Rotation<Space, double>(PoseOf(side).R * AxisAlignment(joint)).template cast<S>();
  }
  return X;
}

/// Inverts by cofactors.
template <class S>
Small<S, 3, 3> Inverse(const Small<S, 3, 3>& A) {
  Small<S, 3, 3> cofactors;
  for (int j = 0; j < 3; ++j) {
    const Small<S, 3> column = A.col((j + 1) % 3).cross(A.col((j + 2) % 3));
    for (int i = 0; i < 3; ++i) cofactors(j, i) = column[i];
  }
  return cofactors / A.col(0).dot(cofactors.transpose().col(0));
}

/// Names of the speeds of a joint with several, by component of a motion.
template <class Space>
std::vector<std::string> ComponentNames() {
  if constexpr (Space::kRot == 1) return {"angle", "x", "y"};
  return {"wx", "wy", "wz", "x", "y", "z"};
}

/// Validate() in this space.
template <class Space>
std::string WhyUnusable(const MechanismDescription& description) {
  if (Space::kRot == 1 || description.space == SpaceKind::kSpatial) return Validate(description);
  MechanismDescription in_space = description;
  in_space.space = SpaceKind::kSpatial;
  return Validate(in_space);
}

}  // namespace

template <class Space, class S>
Mechanism<Space, S>::Mechanism(const MechanismDescription& description, Coordinates coordinates)
    : name_(description.name), coordinates_(coordinates) {
  if (const std::string error = WhyUnusable<Space>(description); !error.empty()) {
    throw std::invalid_argument(error);
  }
  if (Space::kRot == 1 && description.space == SpaceKind::kSpatial) {
    throw std::invalid_argument(name_ + ": a spatial mechanism cannot be compiled for the plane");
  }
  gravity_ = ToLinear<Space, S>(description.gravity);
  const Topology joint_topology = BuildTopology(description, Coordinates::kJoint);
  num_loops_ = static_cast<int>(joint_topology.constraints.size());
  rounded_ = description.rounded;
  accuracy_ = description.accuracy;
  for (const TreeEdge& edge : joint_topology.edges) {
    const JointType type = edge.joint < 0 ? JointType::kFree : description.joints[edge.joint].type;
    num_joint_speeds_ += KindOf<Space, S>(type).num_u;
    if (edge.joint >= 0) {
      num_joint_speeds_ -= static_cast<int>(description.joints[edge.joint].motions.size());
    }
  }
  AddBodies(description);
  AddJoints(description, BuildTopology(description, coordinates));
  const std::vector<bool> on_loops = OnLoops(description, joint_topology);
  for (std::size_t j = 0; j < on_loops.size(); ++j) joints_[j].on_loop = on_loops[j];
  AddCouplings(description);
  for (int j = 0; j < std::ssize(description.joints); ++j) {
    const double inertia = description.joints[j].rotor_inertia;
    if (inertia > 0.0) rotors_.push_back({j, S(inertia)});
  }
  for (const JointValues& values : description.initial.coordinates) {
    const bool is_given = values.values.size() == 1 && !std::isnan(values.values[0]);
    if (is_given) joints_[values.joint].initial = values.values[0];
  }
  forces_ = ForceElements<Space, S>(description);
  AddStopTimes();
  AddGeometry(description);
  NameSpeeds(description);
}

template <class Space, class S>
void Mechanism<Space, S>::AddBodies(const MechanismDescription& description) {
  bodies_.reserve(description.bodies.size());
  body_names_.reserve(description.bodies.size());
  for (const BodyDescription& body : description.bodies) {
    body_names_.push_back(body.name);
    Inertia<Space, S> inertia;
    if (body_names_.size() > 1) {
      inertia.mass = S(body.mass);
      if constexpr (Space::kRot == 1) {
        inertia.rotational(0, 0) = S(body.inertia(2, 2));
        inertia.rotational_inverse(0, 0) = S(1) / inertia.rotational(0, 0);
      } else {
        inertia.rotational = Small<double, 3, 3>(body.inertia).template cast<S>();
        inertia.rotational_inverse = Inverse(inertia.rotational);
      }
    }
    bodies_.push_back(inertia);
  }
}

template <class Space, class S>
Joint<Space, S> Mechanism<Space, S>::MakeJoint(const MechanismDescription& description, int index) {
  const JointDescription& user = description.joints[index];
  Joint<Space, S> joint;
  joint.kind = &KindOf<Space, S>(user.type);
  if (!TraitsOf(user.type).parameter.key.empty()) {
    own_kinds_.push_back(std::make_shared<const JointKind<Space, S>>(
        KindWith<Space, S>(user.type, S(user.parameter))));
    joint.kind = own_kinds_.back().get();
  }
  joint.from = user.from.body;
  joint.to = user.to.body;
  joint.X_PF = SidePose<Space, S>(user.from, user, description.bodies[joint.from].com);
  joint.X_QM = SidePose<Space, S>(user.to, user, description.bodies[joint.to].com);
  joint.description = index;
  joint.is_cut = user.cut;
  joint.first_drive = static_cast<int>(drives_.size());
  joint.num_drives = static_cast<int>(user.motions.size());
  for (const PrescribedMotion& motion : user.motions) {
    drives_.push_back({index, motion.coordinate, TimeFunction(motion.value)});
  }
  std::ranges::sort(drives_.begin() + joint.first_drive, drives_.end(), {}, &Drive::coordinate);
  return joint;
}

template <class Space, class S>
void Mechanism<Space, S>::AddStopTimes() {
  stop_times_ = forces_.Knots();
  for (const Drive& drive : drives_) {
    stop_times_.insert(stop_times_.end(), drive.value.knots().begin(), drive.value.knots().end());
  }
  std::ranges::sort(stop_times_);
  stop_times_.erase(std::unique(stop_times_.begin(), stop_times_.end()), stop_times_.end());
}

template <class Space, class S>
void Mechanism<Space, S>::AddJoints(const MechanismDescription& description,
                                    const Topology& topology) {
  joints_.reserve(description.joints.size());
  joint_names_.reserve(description.joints.size());
  for (int j = 0; j < static_cast<int>(description.joints.size()); ++j) {
    joint_names_.push_back(description.joints[j].name);
    joints_.push_back(MakeJoint(description, j));
  }
  step_of_body_.assign(bodies_.size(), -1);
  for (const TreeEdge& edge : topology.edges) {
    int index = edge.joint;
    if (index < 0) {
      index = static_cast<int>(joints_.size());
      Joint<Space, S> joint;
      joint_names_.push_back(body_names_[edge.child]);
      joint.kind = &KindOf<Space, S>(JointType::kFree);
      joint.to = edge.child;
      joints_.push_back(joint);
    }
    Joint<Space, S>& joint = joints_[index];
    joint.q_offset = num_q_;
    joint.u_offset = num_u_;
    num_q_ += joint.num_q();
    num_u_ += joint.num_u();
    step_of_body_[edge.child] = static_cast<int>(tree_.size());
    tree_.push_back({index, edge.parent, edge.child, joint.to == edge.child ? 1 : -1});
  }
  const bool is_redundant = std::ranges::any_of(
      description.joints, [](const JointDescription& user) { return !user.released.empty(); });
  for (int index : topology.constraints) {
    Joint<Space, S>& joint = joints_[index];
    if (is_redundant && joint.kind->exact_basis != nullptr) {
      JointKind<Space, S> exact = *joint.kind;
      exact.basis = exact.exact_basis;
      exact.bias = exact.exact_bias;
      exact.basis_rate = exact.exact_basis_rate;
      own_kinds_.push_back(std::make_shared<const JointKind<Space, S>>(exact));
      joint.kind = own_kinds_.back().get();
    }
    if (const std::vector<int>& released = description.joints[index].released; !released.empty()) {
      joint.num_released = static_cast<int>(released.size());
      released_.push_back({index, released, description.joints[index].moving});
      num_moving_rows_ += static_cast<int>(released_.back().moving.size());
    }
    joint.row = num_rows_;
    num_rows_ += joint.num_constraints();
    constraints_.push_back(index);
  }
}

template <class Space, class S>
void Mechanism<Space, S>::AddCouplings(const MechanismDescription& description) {
  for (const CouplingDescription& given : description.couplings) {
    Coupling<S>& coupling = couplings_.emplace_back();
    coupling.name = given.name;
    coupling.offset = S(given.offset);
    coupling.in_loops = given.in_loops;
    for (const auto& [index, ratio] : given.parts) {
      const Joint<Space, S>& joint = joints_[index];
      coupling.parts.push_back({index, S(ratio)});
      if (!joint.kind->IsAngle(0) || joint.in_tree()) continue;
      coupling.measured_turns.push_back(S(2.0 * std::numbers::pi * std::abs(ratio)));
    }
    std::ranges::sort(coupling.measured_turns, std::greater<>());
  }
  for (int i = 0; i < num_moving_rows_; ++i) couplings_.emplace_back().is_moving_row = true;
}

template <class Space, class S>
std::vector<int> Mechanism<Space, S>::RowsOfConstraints() const {
  std::vector<int> rows;
  for (const int index : constraints_) rows.push_back(joints_[index].num_constraints());
  return rows;
}

template <class Space, class S>
void Mechanism<Space, S>::AddGeometry(const MechanismDescription& description) {
  using Point = Linear<Space, S>;
  std::vector<std::vector<Point>> joints_of(bodies_.size());
  for (const Joint<Space, S>& joint : joints_) {
    if (joint.num_directions() == 0) continue;  // a free joint holds nothing
    for (const auto& [body, p] : {std::pair{joint.from, joint.X_PF.p}, {joint.to, joint.X_QM.p}}) {
      if (body != kGround) joints_of[body].push_back(p);
    }
  }
  // coincident joints count once: their number does not affect the body's shape
  for (std::vector<Point>& points : joints_of) {
    S nearest = S(0);
    for (const Point& p : points) {
      nearest = std::max({nearest, S(S(kOnePin) * (p - points[0]).norm()),
                          S(S(16) * std::numeric_limits<S>::epsilon() * p.norm())});
    }
    std::vector<Point> apart;
    for (const Point& p : points) {
      const bool known = std::ranges::any_of(
          apart, [&](const Point& other) { return !((p - other).norm() > nearest); });
      if (!known) apart.push_back(p);
    }
    points = std::move(apart);
  }
  geometric_centres_.assign(bodies_.size(), Point::Zero());
  for (std::size_t body = 0; body < bodies_.size(); ++body) {
    for (const Point& p : joints_of[body]) {
      geometric_centres_[body] += p / S(static_cast<int>(joints_of[body].size()));
    }
  }
  const auto length = [&](std::span<const int> bodies) {
    S sum = S(0), sum_from_com = S(0);
    int count = 0, all = 0;
    for (int body : bodies) {
      all += static_cast<int>(joints_of[body].size());
      for (const Point& p : joints_of[body]) sum_from_com += p.squaredNorm();
      if (joints_of[body].size() < 2) continue;
      count += static_cast<int>(joints_of[body].size());
      for (const Point& p : joints_of[body]) sum += (p - geometric_centres_[body]).squaredNorm();
    }
    using std::sqrt;
    if (sum > S(0)) return S(sqrt(sum / S(count)));
    return sum_from_com > S(0) ? S(sqrt(sum_from_com / S(all))) : S(1);
  };
  std::vector<int> all(bodies_.size());
  std::iota(all.begin(), all.end(), 0);
  length_ = length(all);
  geometric_bodies_.assign(bodies_.size(), {});
  for (const Island& island : FindIslands(description, Connection::kJoints)) {
    const S radius = length(island.bodies);
    for (int body : island.bodies) {
      geometric_bodies_[body].mass = S(1);
      using Matrix = typename Inertia<Space, S>::Matrix;
      geometric_bodies_[body].rotational = Matrix::Identity() * (radius * radius);
      geometric_bodies_[body].rotational_inverse = Matrix::Identity() * (S(1) / (radius * radius));
    }
  }
}

template <class Space, class S>
void Mechanism<Space, S>::NameSpeeds(const MechanismDescription& description) {
  const std::vector<std::string> components = ComponentNames<Space>();
  for (const TreeStep& step : tree_) {
    const Joint<Space, S>& joint = joints_[step.joint];
    const std::string& name = joint_names_[step.joint];
    ForEachFree(joint, joint.kind->num_u, [&](int i, int) {
      const bool single = joint.kind->num_u == 1;
      speed_names_.push_back(single ? name : name + "." + components[joint.kind->axes[i]]);
    });
  }
  for (const std::string& name : description.independent) {
    const auto it = std::ranges::find(speed_names_, name);
    if (it != speed_names_.end()) {
      independent_.push_back(static_cast<int>(it - speed_names_.begin()));
    }
  }
}

template <class Space, class S>
void Mechanism<Space, S>::Normalise(VectorX<S>& q) const {
  for (const TreeStep& step : tree_) {
    const Joint<Space, S>& joint = joints_[step.joint];
    if (joint.kind->has_quaternion()) q.template segment<4>(joint.q_offset).normalize();
  }
}

template <class Space, class S>
void Mechanism<Space, S>::Rates(const VectorX<S>& q, const VectorX<S>& u,
                                Eigen::Ref<VectorX<S>> qdot) const {
  for (const TreeStep& step : tree_) {
    const Joint<Space, S>& joint = joints_[step.joint];
    if (joint.num_drives == 0) {
      joint.kind->rates(q.data() + joint.q_offset, u.data() + joint.u_offset,
                        qdot.data() + joint.q_offset);
    } else {  // kinds whose speeds are the rates of their coordinates
      qdot.segment(joint.q_offset, joint.num_q()) = u.segment(joint.u_offset, joint.num_u());
    }
  }
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Mechanism<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
