#include "odca/arm_links.h"

#include <algorithm>

namespace loopbench::odca::arms {

namespace {

using Matrix6 = Eigen::Matrix<double, kAll, kAll>;
using Side = Pose<Spatial, double>;

Side SideOf(const Joint<Spatial, double>& joint, int body) {
  return joint.from == body ? joint.X_PF : joint.X_QM;
}

GroundSide OnGround(const Mechanism<Spatial, double>& mechanism,
                    const Joint<Spatial, double>& joint) {
  const Side side = SideOf(joint, kGround);
  return {side, -(side.R.transpose() * mechanism.gravity())};
}

/// Maps the motion of the centre of mass to a handle, in its axes and in the order of its rows.
Matrix6 ShiftTo(const Side& side) {
  constexpr int kComponent[kAll] = {0, 1, 3, 4, 5, 2};
  Matrix6 S;
  for (int j = 0; j < kAll; ++j) {
    const auto unit = Velocity<Spatial, double>::Unit(j);
    const auto column =
        Rotate<Spatial, double>(side.R.transpose(), ShiftMotion<Spatial, double>(unit, side.p));
    for (int i = 0; i < kAll; ++i) S(i, j) = column[kComponent[i]];
  }
  return S;
}

template <int k>
void SetResponse(const Matrix6& Z11, const Matrix6& Z12, const Matrix6& Z22,
                 Response<double, kRows, k>& response) {
  for (int i = 0; i < k; ++i) {
    for (int j = 0; j <= i; ++j) response.zeta22(i, j) = Z22(i, j);
    for (int j = 0; j < kRows; ++j) response.zeta12[j][i] = Z12(j, i);
  }
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; j <= i; ++j) response.zeta11(i, j) = Z11(i, j);
  }
}

/// zeta_ij = S_i M^-1 S_j^T.
void Measure(const Inertia<Spatial, double>& inertia, const Side& side_1, const Side& side_2,
             Link<double>& link, ArmTip& tip) {
  Matrix6 M_inverse = Matrix6::Identity() / inertia.mass;
  M_inverse.topLeftCorner<3, 3>() = inertia.rotational_inverse.eigen();
  const Matrix6 S1 = ShiftTo(side_1), S2 = ShiftTo(side_2);
  const Matrix6 Z11 = S1 * M_inverse * S1.transpose(), Z12 = S1 * M_inverse * S2.transpose(),
                Z22 = S2 * M_inverse * S2.transpose();
  SetResponse(Z11, Z12, Z22, link.response);
  SetResponse(Z11, Z12, Z22, tip.response);
  for (int i = 0; i < kRows; ++i) {
    link.about11[i] = Z11(kRows, i);
    link.about12[i] = Z12(kRows, i);
    link.about21[i] = Z12(i, kRows);
    link.about22[i] = Z22(kRows, i);
  }
  for (int i = 0; i < kAll; ++i) tip.about12[i] = Z12(kRows, i);
  const Rotation<Spatial, double> to_1 = side_1.R.transpose();
  link.shape = {.inertia = to_1 * inertia.rotational * side_1.R,
                .inverse = to_1 * inertia.rotational_inverse * side_1.R,
                .r1 = to_1 * side_1.p,
                .r2 = to_1 * side_2.p,
                .to_2 = side_2.R.transpose() * side_1.R};
}

/// Finds the step of the tree by which each body carries another, -1 for none. Returns false if a
/// body carries two.
bool FindBeyond(const Mechanism<Spatial, double>& mechanism, std::vector<int>& beyond) {
  beyond.assign(mechanism.num_bodies(), -1);
  for (int step = 0; step < static_cast<int>(mechanism.tree().size()); ++step) {
    const int parent = mechanism.tree()[step].parent;
    if (parent == kGround) continue;
    if (beyond[parent] >= 0) return false;
    beyond[parent] = step;
  }
  return true;
}

/// Finds cut joints, and the joint at each body. Returns false if one is not at the ends of arms.
bool FindClosings(const Mechanism<Spatial, double>& mechanism, const std::vector<int>& beyond,
                  std::vector<int>& closing_of, Arms& arms) {
  closing_of.assign(mechanism.num_bodies(), -1);
  for (const int index : mechanism.constraints()) {
    const Joint<Spatial, double>& joint = mechanism.joints()[index];
    if (joint.kind->basis != nullptr || joint.num_constraints() == 0) return false;
    for (const int body : {joint.from, joint.to}) {
      if (body == kGround) continue;
      if (beyond[body] >= 0 || closing_of[body] >= 0) return false;
      closing_of[body] = static_cast<int>(arms.closings.size());
    }
    ArmClosing& closing = arms.closings.emplace_back();
    closing.kind = *joint.kind;
    if (joint.from == kGround || joint.to == kGround) {
      closing.ground = OnGround(mechanism, joint);
    }
  }
  return true;
}

/// Returns the arm whose first body belongs to this step of the tree.
Arm FollowArm(const Mechanism<Spatial, double>& mechanism, int step, const std::vector<int>& beyond,
              const std::vector<int>& closing_of) {
  const auto joint_of = [&](int one) -> const Joint<Spatial, double>& {
    return mechanism.joints()[mechanism.tree()[one].joint];
  };
  Arm arm;
  arm.ground = OnGround(mechanism, joint_of(step));
  while (step >= 0) {
    const int child = mechanism.tree()[step].child, next = beyond[child];
    const Side side_1 = SideOf(joint_of(step), child);
    Side side_2 = side_1;  // of an open end nothing is asked
    arm.last = child;
    arm.closing = closing_of[child];
    if (next >= 0) side_2 = SideOf(joint_of(next), child);
    if (arm.closing >= 0) {
      side_2 = SideOf(mechanism.joints()[mechanism.constraints()[arm.closing]], child);
    }
    ArmBody& body = arm.bodies.emplace_back();
    body.u = joint_of(step).u_offset;
    body.sign = mechanism.tree()[step].sign;
    Measure(mechanism.bodies()[child], side_1, side_2, body.link, arm.tip);
    step = next;
  }
  return arm;
}

}  // namespace

bool SinesOfJoints(const double* angles, int count, double* sines, double* cosines) {
  return SinesAndCosines(angles, count, sines, cosines);
}

Arms FindArms(const Mechanism<Spatial, double>& mechanism) {
  const auto is_plain = [](const Joint<Spatial, double>& joint) {
    return joint.num_drives == 0 && joint.num_released == 0 &&
           (joint.kind == &KindOf<Spatial, double>(JointType::kRevolute) || !joint.in_tree());
  };
  Arms arms;
  std::vector<int> beyond, closing_of;
  if (!mechanism.forces().empty() || !std::ranges::all_of(mechanism.joints(), is_plain) ||
      !FindBeyond(mechanism, beyond) || !FindClosings(mechanism, beyond, closing_of, arms)) {
    return {};
  }
  for (int first = 0; first < static_cast<int>(mechanism.tree().size()); ++first) {
    if (mechanism.tree()[first].parent != kGround) continue;
    arms.arms.push_back(FollowArm(mechanism, first, beyond, closing_of));
    const int closing = arms.arms.back().closing;
    if (closing < 0) continue;
    const Joint<Spatial, double>& cut = mechanism.joints()[mechanism.constraints()[closing]];
    const bool is_P = arms.arms.back().last == cut.from;
    (is_P ? arms.closings[closing].arm_P : arms.closings[closing].arm_Q) =
        static_cast<int>(arms.arms.size()) - 1;
  }
  return arms;
}

}  // namespace loopbench::odca::arms
