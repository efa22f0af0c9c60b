#include "mechanism/simplify/immovable.h"

#include "mechanism/algebra/decompositions.h"
#include "mechanism/loops/scaled_loops.h"
#include "mechanism/start/assembly.h"

namespace loopbench {

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
    const Eigen::Vector3d& com = description_.bodies[body].com;
    Attachment at;
    at.attached = true;
    if constexpr (Space::kRot == 1) {
      at.turn = at_com.angle;
      at.X.R.topLeftCorner<2, 2>() = at_com.R.eigen();
      at.X.p.head<2>() = at_com.p.eigen();
    } else {
      at.X = {at_com.R.eigen(), at_com.p.eigen()};
    }
    at.X.p -= at.X.R * com;
    return at;
  }

  const MechanismDescription& description_;
  const Mechanism<Space, double>& mechanism_;
  Kinematics<Space, double> kinematics_;
};

template <class Space>
std::vector<Attachment> FindIn(const MechanismDescription& description) {
  const std::vector<Attachment> none(description.bodies.size());
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  if (mechanism.num_u() > kMaxSpeedsForImmovable) return none;
  const Start<double> start = Assemble<Space>(description, mechanism);
  if (start.outcome != Outcome::kFinished) return none;
  return Search<Space>(description, mechanism, start).Run();
}

}  // namespace

std::vector<Attachment> FindImmovable(const MechanismDescription& description) {
  return description.space == SpaceKind::kPlanar ? FindIn<Planar>(description)
                                                 : FindIn<Spatial>(description);
}

}  // namespace loopbench
