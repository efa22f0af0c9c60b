#include "mechanism/simplify/attach.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "mechanism/algebra/decompositions.h"
#include "mechanism/description/topology.h"
#include "mechanism/loops/scaled_loops.h"
#include "mechanism/start/assembly.h"

namespace loopbench {

namespace {

using Matrix3 = Eigen::Matrix3d;
using Vector3 = Eigen::Vector3d;

/// Inertia of a point mass m at r.
Matrix3 PointInertia(double m, const Vector3& r) {
  return m * (r.squaredNorm() * Matrix3::Identity() - r * r.transpose());
}

void MoveSide(const Attachment& at, SpaceKind space, JointSide* side) {
  side->body = at.carrier;
  side->position = at.X.R * side->position + at.X.p;
  if (space == SpaceKind::kPlanar) {
    side->position.z() = 0.0;
    side->rotation.z() += at.turn;
    return;
  }
  const Eigen::AngleAxisd turned(at.X.R * PoseOf(*side).R);
  side->rotation = turned.angle() * turned.axis();
}

}  // namespace

void AddMass(const BodyDescription& body, const Frame& X, BodyDescription* carrier) {
  const Vector3 com = X.R * body.com + X.p;
  const double mass = carrier->mass + body.mass;
  Vector3 joint_com = carrier->com;
  if (mass > 0.0) joint_com = (carrier->mass * carrier->com + body.mass * com) / mass;
  carrier->inertia += PointInertia(carrier->mass, carrier->com - joint_com) +
                      X.R * body.inertia * X.R.transpose() +
                      PointInertia(body.mass, com - joint_com);
  carrier->inertia = (0.5 * (carrier->inertia + carrier->inertia.transpose())).eval();
  carrier->com = joint_com;
  carrier->mass = mass;
}

MechanismDescription MergeRigidBodies(const MechanismDescription& description,
                                      const std::vector<Attachment>& attachments,
                                      Renumbering* renumbering) {
  MechanismDescription changed = description;
  const std::size_t num_bodies = description.bodies.size();
  std::vector<int> carrier(num_bodies);
  renumbering->bodies.assign(num_bodies, -1);
  int kept = 0;
  for (std::size_t i = 0; i < num_bodies; ++i) {
    const Attachment& at = attachments[i];
    carrier[i] = at.attached ? at.carrier : static_cast<int>(i);
    if (!at.attached) {
      renumbering->bodies[i] = kept++;
      continue;
    }
    BodyDescription& whole = changed.bodies[at.carrier];
    if (at.carrier != kGround) AddMass(description.bodies[i], at.X, &whole);
    for (const auto& [name, p] : description.bodies[i].points) {
      whole.points[description.bodies[i].name + "." + name] = at.X.R * p + at.X.p;
    }
  }
  renumbering->joints.assign(description.joints.size(), -1);
  int joints = 0;
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    JointDescription& joint = changed.joints[j];
    for (JointSide* side : {&joint.from, &joint.to}) {
      const Attachment& at = attachments[side->body];
      if (at.attached) MoveSide(at, description.space, side);
    }
    if (joint.from.body != joint.to.body) renumbering->joints[j] = joints++;
  }
  for (ForceDescription& force : changed.forces) {
    const ForceParts parts = PartsOf(force);
    for (BodyPoint* point : parts.points) {
      const Attachment& at = attachments[point->body];
      if (!at.attached) continue;
      if (parts.force != nullptr && *parts.in_body_axes) *parts.force = at.X.R * *parts.force;
      *point = {at.carrier, at.X.R * point->at + at.X.p};
    }
  }
  MechanismDescription result = Select(changed, *renumbering);
  for (const Island& island : FindIslands(description)) {
    const int root = island.bodies.front();
    const Vector3& com = description.bodies[root].com;
    if (island.grounded || carrier[root] != root || changed.bodies[root].com == com) continue;
    JointDescription free;
    free.name = description.bodies[root].name;
    free.type = JointType::kFree;
    free.to.body = renumbering->bodies[root];
    free.to.position = com;
    result.joints.push_back(free);
  }
  return result;
}

namespace {

/// Poses along two ways through the same welds agree to this, in rad and in units of the arms.
constexpr double kAgrees = 1e-12;

Attachment Then(const Attachment& first, const Frame& X, double turn) {
  Attachment at = first;
  at.X = first.X * X;
  at.turn = first.turn + turn;
  return at;
}

/// The group of welded bodies that begins with `root`; its poses seen from there.
class Group {
 public:
  Group(const MechanismDescription& description, const std::vector<bool>& welds,
        const std::vector<bool>& in_tree, int root)
      : description_(description),
        welds_(welds),
        in_tree_(in_tree),
        at_(description.bodies.size()) {
    at_[root].attached = true;
    at_[root].carrier = root;
    bodies_.push_back(root);
    for (std::size_t k = 0; k < bodies_.size(); ++k) GrowFrom(bodies_[k]);
  }

  const std::vector<int>& bodies() const { return bodies_; }
  const Attachment& at(int body) const { return at_[body]; }

  /// Returns true if all joints within the group are welds that agree.
  bool IsOneBody() const {
    for (std::size_t j = 0; j < description_.joints.size(); ++j) {
      const JointDescription& joint = description_.joints[j];
      const Attachment& P = at_[joint.from.body];
      const Attachment& Q = at_[joint.to.body];
      if (!P.attached || !Q.attached) continue;
      if (!welds_[j]) return false;
      const auto X_F = P.X * PoseOf(joint.from), X_M = Q.X * PoseOf(joint.to);
      const double arm = 1.0 + X_F.p.norm() + joint.to.position.norm();
      if ((X_F.R - X_M.R).norm() > kAgrees || (X_F.p - X_M.p).norm() > kAgrees * arm) return false;
    }
    return true;
  }

 private:
  void GrowFrom(int body) {
    for (std::size_t j = 0; j < description_.joints.size(); ++j) {
      const JointDescription& joint = description_.joints[j];
      if (!welds_[j] || !in_tree_[j]) continue;
      for (const auto& [here, there] :
           {std::pair{&joint.from, &joint.to}, {&joint.to, &joint.from}}) {
        if (here->body != body || at_[there->body].attached) continue;
        at_[there->body] = Then(at_[body], PoseOf(*here) * PoseOf(*there).Inverse(),
                                here->rotation.z() - there->rotation.z());
        bodies_.push_back(there->body);
      }
    }
  }

  const MechanismDescription& description_;
  const std::vector<bool>& welds_;
  const std::vector<bool>& in_tree_;
  std::vector<Attachment> at_;
  std::vector<int> bodies_;
};

}  // namespace

std::vector<Attachment> FindWelded(const MechanismDescription& description) {
  std::vector<bool> welds;
  for (const JointDescription& joint : description.joints) {
    welds.push_back(joint.type == JointType::kWeld);
  }
  return FindWelded(description, welds);
}

std::vector<Attachment> FindWelded(const MechanismDescription& description,
                                   const std::vector<bool>& welds) {
  std::vector<Attachment> attachments(description.bodies.size());
  std::vector<bool> seen(description.bodies.size(), false), welded(seen);
  std::vector<bool> in_tree(description.joints.size(), true);
  for (const int j : BuildTopology(description, Coordinates::kJoint).constraints)
    in_tree[j] = false;
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    const JointDescription& joint = description.joints[j];
    if (welds[j]) welded[joint.from.body] = welded[joint.to.body] = true;
  }
  for (int root = 0; root < static_cast<int>(seen.size()); ++root) {
    if (seen[root] || !welded[root]) continue;
    const Group group(description, welds, in_tree, root);
    const bool merge = group.IsOneBody();
    for (const int body : group.bodies()) {
      seen[body] = true;
      if (merge && body != root) attachments[body] = group.at(body);
    }
  }
  return attachments;
}

namespace {

/// Speed of a body that counts as rest, per unit speed of the whole [1/s, lengths scaled].
constexpr double kStill = 1e-8;

template <class Space>
class Search {
 public:
  Search(const MechanismDescription& description, const Mechanism<Space, double>& mechanism,
         const Start<double>& start)
      : description_(description), mechanism_(mechanism), kinematics_(mechanism) {
    kinematics_.UpdatePosition(start.q);
  }

  std::vector<Attachment> Run() {
    std::vector<bool> rigid = StillBodies();
    while (Shrink(&rigid)) {
    }
    std::vector<Attachment> attachments(description_.bodies.size());
    for (const JointDescription& joint : description_.joints) {
      // a driver between immovable bodies cannot be followed: the run reports it
      const bool within = rigid[joint.from.body] && rigid[joint.to.body];
      if (!joint.motions.empty() && within) return attachments;
    }
    for (int body = 1; body < mechanism_.num_bodies(); ++body) {
      if (rigid[body]) attachments[body] = ToGround(body);
    }
    return attachments;
  }

 private:
  /// No motion that the loops permit at the start moves them: all that can be rigid is among these.
  std::vector<bool> StillBodies() {
    std::vector<bool> still(mechanism_.num_bodies(), true);
    const ScaledLoops loops = ScaleLoops(kinematics_);
    for (Eigen::Index i = 0; i < loops.to_u.cols(); ++i) {
      kinematics_.UpdateVelocity(loops.to_u.col(i));
      for (int body = 1; body < mechanism_.num_bodies(); ++body) {
        Velocity<Space, double> V = kinematics_.motions()[body];
        V.angular *= mechanism_.length();
        if (V.norm() > kStill) still[body] = false;
      }
    }
    return still;
  }

  /// Takes out bodies that move when only the joints of the set hold it. False when none did, or
  /// when nothing is certain and the set is empty.
  bool Shrink(std::vector<bool>* rigid) {
    std::vector<int> column(rigid->size(), -1);
    int columns = 0;
    for (std::size_t i = 1; i < rigid->size(); ++i) {
      if ((*rigid)[i]) column[i] = Space::kDim * columns++;
    }
    if (columns == 0) return false;
    const Eigen::MatrixXd J = Constraints(column, Space::kDim * columns);
    if (J.rows() < J.cols()) return Release(J, column, rigid);
    const Eigen::BDCSVD<Eigen::MatrixXd> svd(J);
    const auto& sigma = svd.singularValues();
    if (sigma[J.cols() - 1] > kCertain * sigma[0]) return false;
    return Release(J, column, rigid);
  }

  /// Removes bodies moved by null vectors from the set; all if the null space is uncertain.
  bool Release(const Eigen::MatrixXd& J, const std::vector<int>& column, std::vector<bool>* rigid) {
    Eigen::MatrixXd square = Eigen::MatrixXd::Zero(std::max(J.rows(), J.cols()), J.cols());
    square.topRows(J.rows()) = J;
    const Eigen::BDCSVD<Eigen::MatrixXd> svd(square, Eigen::ComputeFullV);
    const auto& sigma = svd.singularValues();
    bool released = false;
    for (std::size_t i = 1; i < column.size(); ++i) {
      if (column[i] < 0) continue;
      double speed = 0.0;
      for (Eigen::Index k = 0; k < sigma.size(); ++k) {
        if (sigma[k] > kCertain * sigma[0]) continue;
        speed = std::max(speed, svd.matrixV().col(k).segment(column[i], Space::kDim).norm());
      }
      if (speed <= kStill) continue;
      (*rigid)[i] = false;
      released = true;
    }
    if (!released) rigid->assign(rigid->size(), false);
    return released;
  }

  /// D^T (V_Q - V_P) of the joints within the set, angular velocities times length; unit rows.
  Eigen::MatrixXd Constraints(const std::vector<int>& column, int columns) const {
    const auto in_set = [&](int body) { return body == kGround || column[body] >= 0; };
    std::vector<Eigen::RowVectorXd> rows;
    for (std::size_t j = 0; j < description_.joints.size(); ++j) {
      const Joint<Space, double>& joint = mechanism_.joints()[j];
      if (!in_set(joint.from) || !in_set(joint.to)) continue;
      // a joint with a prescribed motion fixes nothing
      if (!description_.joints[j].motions.empty()) continue;
      const JointState<Space, double>& state = kinematics_.joints()[j];
      for (int i = 0; i < state.rows(); ++i) {
        Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(columns);
        const auto add = [&](int body, const Linear<Space, double>& r, double sign) {
          for (int k = 0; body != kGround && k < Space::kDim; ++k) {
            auto unit = Velocity<Space, double>::Unit(k);
            if (k < Space::kRot) unit /= mechanism_.length();
            row[column[body] + k] += sign * state.D(i).dot(ShiftMotion<Space, double>(unit, r));
          }
        };
        add(joint.to, state.r_Q, 1.0);
        add(joint.from, state.r_P, -1.0);
        if (row.norm() > 0.0) rows.push_back(row / row.norm());
      }
    }
    Eigen::MatrixXd J(rows.size(), columns);
    for (std::size_t i = 0; i < rows.size(); ++i) J.row(static_cast<Eigen::Index>(i)) = rows[i];
    return J;
  }

  Attachment ToGround(int body) const {
    const Pose<Space, double>& at_com = kinematics_.poses()[body];
    Attachment at;
    at.attached = true;
    if constexpr (Space::kRot == 1) at.turn = at_com.angle;
    at.X = OriginOf(at_com, description_.bodies[body].com);
    return at;
  }

  const MechanismDescription& description_;
  const Mechanism<Space, double>& mechanism_;
  Kinematics<Space, double> kinematics_;
};

}  // namespace

std::vector<Attachment> FindImmovable(const MechanismDescription& description) {
  return ForSpace(description.space, [&]<class Space>(Space) {
    const std::vector<Attachment> none(description.bodies.size());
    const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
    if (mechanism.num_u() > kMaxSpeedsForImmovable) return none;
    const Start<double> start = Assemble<Space>(description, mechanism);
    if (start.outcome != Outcome::kFinished) return none;
    return Search<Space>(description, mechanism, start).Run();
  });
}

}  // namespace loopbench
