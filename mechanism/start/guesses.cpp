#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "mechanism/start/closure.h"

namespace loopbench {

namespace {

/// Weight of the distance of a coordinate without a guess from 0.
constexpr double kUnguessed = 1e-3;

/// q less g of a joint, by the speeds of its kind: of a quaternion the rotation vector from g to q.
template <class Space>
std::array<double, 6> Difference(const JointKind<Space, double>& kind, const double* q,
                                 const double* g) {
  std::array<double, 6> apart{};
  const int rotations = kind.has_quaternion() ? 3 : 0, shift = kind.num_q - kind.num_u;
  for (int i = rotations; i < kind.num_u; ++i) apart[i] = q[i + shift] - g[i + shift];
  if (rotations == 0) return apart;
  const Eigen::Quaterniond from(g[0], g[1], g[2], g[3]), to(q[0], q[1], q[2], q[3]);
  const Eigen::AngleAxisd turn(to.normalized() * from.normalized().conjugate());
  Eigen::Vector3d::Map(apart.data()) = turn.angle() * turn.axis();
  return apart;
}

}  // namespace

template <class Space>
Guesses<Space>::Guesses(const MechanismDescription& description,
                        const Mechanism<Space, double>& mechanism,
                        const AssemblyUnits<Space>& units)
    : description_(description),
      mechanism_(mechanism),
      units_(units),
      guess_(GuessedPositions(description, mechanism)),
      is_held_(description.joints.size(), false),
      fixed_(mechanism.num_u(), false),
      guessed_(mechanism.num_u(), false),
      weights_(VectorX<double>::Ones(mechanism.num_u())) {
  for (int index : description.initial.held) {
    is_held_[index] = true;
    SetColumns(mechanism.joints()[index], &fixed_);
  }
  // A link is about twice as long as the distances in length(). Weights do not depend on the unit
  // of length, which is a power of two.
  const double per_link = units.length / (2.0 * mechanism.length());
  for (const JointValues& values : description.initial.coordinates) {
    const Joint<Space, double>& joint = mechanism.joints()[values.joint];
    const auto weight = [&](int coordinate) {
      return values.weight * (joint.kind->axes[coordinate] < Space::kRot ? 1.0 : per_link);
    };
    if (joint.in_tree()) {
      if (!is_held_[values.joint]) SetColumns(joint, &guessed_);
      mechanism.ForEachFree(joint, joint.kind->num_u,
                            [&](int i, int free) { weights_[joint.u_offset + free] = weight(i); });
      continue;
    }
    if (joint.num_u() == 0) continue;  // prescribed
    CutJoints& cut = is_held_[values.joint] ? held_ : loose_;
    cut.values.push_back({values.joint, values.values.data()});
    mechanism.ForEachFree(joint, joint.kind->num_u, [&](int i, int free) {
      if (!IsGiven(*joint.kind, values.values.data(), i)) return;
      cut.free.push_back({values.joint, free});
      cut.weights.conservativeResize(cut.weights.size() + 1);
      cut.weights[cut.weights.size() - 1] = weight(i);
    });
  }
}

template <class Space>
void Guesses<Space>::SetColumns(const Joint<Space, double>& joint,
                                std::vector<bool>* columns) const {
  for (int i = 0; joint.in_tree() && i < joint.num_u(); ++i) {
    (*columns)[joint.u_offset + i] = true;
  }
}

template <class Space>
VectorX<double> Guesses<Space>::Apart(const VectorX<double>& q) const {
  VectorX<double> apart(mechanism_.num_u());
  for (const TreeStep& step : mechanism_.tree()) {
    const Joint<Space, double>& joint = mechanism_.joints()[step.joint];
    double at[7] = {}, guess[7] = {};
    mechanism_.ForEachFree(joint, joint.kind->num_q, [&](int i, int free) {
      at[i] = q[joint.q_offset + free];
      guess[i] = guess_[joint.q_offset + free];
    });
    const std::array<double, 6> all = Difference<Space>(*joint.kind, at, guess);
    mechanism_.ForEachFree(joint, joint.kind->num_u,
                           [&](int i, int free) { apart[joint.u_offset + free] = all[i]; });
  }
  return apart.cwiseQuotient(units_.columns);
}

template <class Space>
VectorX<double> Guesses<Space>::GuessedApart(const VectorX<double>& q) const {
  VectorX<double> apart = Apart(q);
  for (int i = 0; i < mechanism_.num_u(); ++i) {
    if (!guessed_[i]) apart[i] = 0.0;
  }
  return apart;
}

template <class Space>
VectorX<double> Guesses<Space>::Apart(const CutJoints& cut,
                                      const Kinematics<Space, double>& kinematics) const {
  VectorX<double> apart(static_cast<Eigen::Index>(cut.free.size()));
  Eigen::Index row = 0;
  for (const auto& [index, values] : cut.values) {
    const Joint<Space, double>& joint = mechanism_.joints()[index];
    double at[7] = {};
    joint.kind->coordinates(kinematics.MeasuredPose(joint), at, joint.kind->parameter);
    std::array<double, 6> all = Difference<Space>(*joint.kind, at, values);
    mechanism_.ForEachFree(joint, joint.kind->num_u,
                           [&, index = index, given = values](int i, int free) {
                             if (joint.kind->IsAngle(i)) all[i] = std::remainder(all[i], kTurn);
                             const double unit = units_.Of(kinematics.joints()[index].H(free));
                             if (IsGiven(*joint.kind, given, i)) apart[row++] = all[i] / unit;
                           });
  }
  return apart;
}

template <class Space>
double Guesses<Space>::SquaredDistance(const Kinematics<Space, double>& kinematics) const {
  const VectorX<double> all = Apart(kinematics.q());
  double sum = LooseApart(kinematics).cwiseProduct(loose_.weights).squaredNorm();
  for (int i = 0; i < mechanism_.num_u(); ++i) {
    const double difference = (guessed_[i] ? weights_[i] : kUnguessed) * all[i];
    sum += difference * difference;
  }
  return sum;
}

template <class Space>
double Guesses<Space>::Farthest(const Kinematics<Space, double>& kinematics) const {
  double farthest = 0.0;
  for (const VectorX<double>& apart : {GuessedApart(kinematics.q()), LooseApart(kinematics)}) {
    if (apart.size() > 0) farthest = std::max(farthest, apart.cwiseAbs().maxCoeff());
  }
  return farthest;
}

template <class Space>
std::vector<MissedGuess> Guesses<Space>::Missed(const Kinematics<Space, double>& kinematics) const {
  const VectorX<double> apart = Apart(kinematics.q()), cut = LooseApart(kinematics);
  const double link = 2.0 * mechanism_.length();  // between its ends: twice from its middle
  std::vector<MissedGuess> missed;
  Eigen::Index row = 0;
  for (const JointValues& values : description_.initial.coordinates) {
    const Joint<Space, double>& joint = mechanism_.joints()[values.joint];
    if (is_held_[values.joint]) continue;
    const int shift = joint.kind->num_q - joint.kind->num_u;
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    mechanism_.ForEachFree(joint, joint.kind->num_u, [&](int i, int free) {
      const Direction<Space, double>& H = kinematics.joints()[values.joint].H(free);
      const double by =
          units_.Of(H) * (joint.in_tree() ? apart[joint.u_offset + free] : cut[row++]);
      if (shift > 0 && i < 3) {
        turn[i] = by;
      } else if (std::abs(by) > kFarGuess * (H.angular.isZero() ? link : 1.0)) {
        missed.push_back({values.joint, i + shift, values.values[i + shift], by});
      }
    });
    if (turn.norm() > kFarGuess) missed.push_back({values.joint, -1, 0.0, turn.norm()});
  }
  return missed;
}

template <class Space>
VectorX<double> Guesses<Space>::Unwound(VectorX<double> q) const {
  const VectorX<double> apart = Apart(q);
  for (const TreeStep& step : mechanism_.tree()) {
    const Joint<Space, double>& joint = mechanism_.joints()[step.joint];
    mechanism_.ForEachFree(joint, joint.kind->num_u, [&](int i, int free) {
      if (!joint.kind->IsAngle(i)) return;
      q[joint.q_offset + free] -= kTurn * std::round(apart[joint.u_offset + free] / kTurn);
    });
  }
  return q;
}

template <class Space>
VectorX<double> GuessedPositions(const MechanismDescription& description,
                                 const Mechanism<Space, double>& mechanism) {
  VectorX<double> q = VectorX<double>::Zero(mechanism.num_q());
  for (const TreeStep& step : mechanism.tree()) {
    const Joint<Space, double>& joint = mechanism.joints()[step.joint];
    if (joint.kind->has_quaternion()) q[joint.q_offset] = 1.0;  // the unit quaternion
  }
  for (const JointValues& values : description.initial.coordinates) {
    const Joint<Space, double>& joint = mechanism.joints()[values.joint];
    if (!joint.in_tree()) continue;
    mechanism.ForEachFree(joint, joint.kind->num_q,
                          [&](int i, int free) { q[joint.q_offset + free] = values.values[i]; });
  }
  return q;
}

template <class Space>
std::vector<JointValues> TreeValues(const Mechanism<Space, double>& mechanism,
                                    const VectorX<double>& q) {
  std::vector<JointValues> list;
  for (const TreeStep& step : mechanism.tree()) {
    const Joint<Space, double>& joint = mechanism.joints()[step.joint];
    if (joint.description < 0 || joint.num_q() == 0) continue;
    std::vector<double> values(joint.kind->num_q, 0.0);
    mechanism.ForEachFree(joint, joint.kind->num_q,
                          [&](int i, int free) { values[i] = q[joint.q_offset + free]; });
    list.push_back({joint.description, std::move(values)});
  }
  return list;
}

std::vector<MissedGuess> FindMissedGuesses(const MechanismDescription& description,
                                           const VectorX<double>& q) {
  return ForSpace(description.space, [&]<class Space>(Space) {
    const Mechanism<Space, double> mechanism(Unreleased(description), Coordinates::kJoint);
    Kinematics<Space, double> kinematics(mechanism);
    kinematics.UpdatePosition(q);
    const AssemblyUnits<Space> units(kinematics);
    return Guesses<Space>(description, mechanism, units).Missed(kinematics);
  });
}

#define LOOPBENCH_INSTANTIATE(Space)                                            \
  template class Guesses<Space>;                                                \
  template VectorX<double> GuessedPositions(const MechanismDescription&,        \
                                            const Mechanism<Space, double>&);   \
  template std::vector<JointValues> TreeValues(const Mechanism<Space, double>&, \
                                               const VectorX<double>&);
LOOPBENCH_INSTANTIATE(Planar)
LOOPBENCH_INSTANTIATE(Spatial)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
