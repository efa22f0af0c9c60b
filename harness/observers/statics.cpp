#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/observers/trajectory.h"
#include "mechanism/loops/excursion.h"
#include "mechanism/loops/scaled_loops.h"

namespace loopbench::harness {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A coordinate holds a motion in which it moves by more than this share of unit bodies' motions
/// [rad, or lengths]. Smaller shares would need efforts of more than 1e4 times the loads.
constexpr double kHolds = 1e-4;
/// Power that counts as zero, over the sum of its parts: speeds have round-off over kRankRatio.
constexpr double kBalanced = 1e-10;

template <class Space>
class AtRestSearch {
 public:
  AtRestSearch(const MechanismDescription& description, const Start<double>& start)
      : held_(Held(description)),
        mechanism_(held_, Coordinates::kJoint),
        kinematics_(mechanism_),
        user_(held_) {
    kinematics_.UpdatePosition(start.q);
    kinematics_.UpdateVelocity(VectorXd::Zero(mechanism_.num_u()));
    const Compiled compiled = Compile(held_, CompileOptions::None());
    sample_.bodies = AtRest(compiled);
    const std::vector<Acceleration<Space, double>> none(mechanism_.num_bodies(),
                                                        Acceleration<Space, double>::Zero());
    EnterPart<Space>(compiled, 0, kinematics_, none, &sample_.bodies);
    sample_.followed.assign(held_.joints.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t j = 0; j < held_.joints.size(); ++j) {
      const Joint<Space, double>& joint = mechanism_.joints()[j];
      if (!joint.in_tree() || joint.kind->num_u != 1) continue;
      sample_.followed[j] = kinematics_.JointCoordinate(static_cast<int>(j));
    }
    user_.Set(0.0, sample_.bodies, sample_.followed);
    applied_.assign(mechanism_.num_bodies(), Wrench<Space, double>::Zero());
    AppliedForces<Space, double>(kinematics_, applied_);
  }

  Statics Run(const MechanismDescription& description) {
    Statics statics;
    if (mechanism_.num_u() > kMaxAnalysedSpeeds) {
      statics.why = fmt::format("found {} speeds, expected at most {}", mechanism_.num_u(),
                                kMaxAnalysedSpeeds);
      return statics;
    }
    Permit();
    for (const int joint : description.initial.held) Hold(joint);
    for (int j = 0; j < static_cast<int>(held_.joints.size()); ++j) Hold(j);
    statics.free = static_cast<int>(permitted_.cols() - held_rates_.cols());
    statics.why = Unbalanced();
    if (!statics.why.empty()) return statics;
    OutputOptions output;
    output.quantities = {OutputPart::kReactions};
    const auto row = MakeRowWriter(held_, output);
    statics.columns = row->columns();
    row->Write(sample_, &statics.values);
    for (std::size_t j = 0; j < held_.joints.size(); ++j) {
      const auto words = ValueWords(held_.joints[j].type, held_.space, false);
      const std::size_t given = description.joints[j].motions.size();
      for (std::size_t i = given; i < held_.joints[j].motions.size(); ++i) {
        const ValueWord& word = words[held_.joints[j].motions[i].coordinate];
        statics.held.push_back(fmt::format("{}:{}", LabelName(held_.joints[j].name), word.name));
      }
    }
    return statics;
  }

 private:
  static MechanismDescription Held(MechanismDescription description) {
    for (JointDescription& joint : description.joints) {
      for (PrescribedMotion& motion : joint.motions) {
        motion.value = Polynomial{{TimeFunction(motion.value).At(0.0).value}};
      }
    }
    return description;
  }

  /// The motions of all joints, and the power of applied forces, along each permitted speed.
  void Permit() {
    permitted_ = ScaleLoops(kinematics_).to_u;
    const Eigen::Index n = permitted_.cols();
    power_.setZero(n);
    double parts = 0.0;
    for (Eigen::Index k = 0; k < n; ++k) {
      kinematics_.UpdateVelocity(permitted_.col(k));
      std::vector<Velocity<Space, double>>& relative = relative_.emplace_back();
      for (const auto& joint : kinematics_.joints()) relative.push_back(joint.V_rel);
      double sum = 0.0;
      for (int b = 1; b < mechanism_.num_bodies(); ++b) {
        const Velocity<Space, double>& V = kinematics_.motions()[b];
        power_[k] += applied_[b].dot(V);
        sum += applied_[b].angular.norm() * V.angular.norm() +
               applied_[b].linear.norm() * V.linear.norm();
      }
      parts = std::max(parts, sum);
    }
    negligible_ = kBalanced * parts;
    held_rates_.resize(n, 0);
  }

  /// Holds the coordinates of a joint that no held coordinates determine.
  void Hold(int j) {
    const Joint<Space, double>& joint = mechanism_.joints()[j];
    JointDescription& described = held_.joints[j];
    if (described.type == JointType::kFree || joint.kind->has_quaternion()) return;
    const auto words = ValueWords(described.type, held_.space, false);
    for (int i = 0; i < static_cast<int>(words.size()); ++i) {
      if (held_rates_.cols() == permitted_.cols()) return;
      VectorXd rates(permitted_.cols());
      // permitted speeds belong to unit bodies, about 1 m/s
      const double scale =
          joint.kind->inverse_H_squared * (words[i].is_length() ? 1.0 : mechanism_.length());
      for (Eigen::Index k = 0; k < rates.size(); ++k) {
        rates[k] = scale * user_.DirectionOfSpeed(j, i).dot(relative_[k][j]);
      }
      Beyond(&rates);
      if (!(rates.norm() > kHolds)) continue;
      held_rates_.conservativeResize(Eigen::NoChange, held_rates_.cols() + 1);
      held_rates_.rightCols(1) = rates.normalized();
      double q[7], u[6];
      user_.Measure(j, q, u);
      described.motions.push_back({i, Polynomial{{q[i]}}});
    }
  }

  /// Removes the part of a combination of permitted speeds that held coordinates determine.
  void Beyond(VectorXd* rates) const {
    for (int twice = 0; twice < 2; ++twice) {
      *rates -= held_rates_ * (held_rates_.transpose() * *rates);
    }
  }

  /// Returns the reason why forces at rest do not exist, or "".
  std::string Unbalanced() {
    VectorXd power = power_;
    Beyond(&power);
    if (!(power.norm() > negligible_)) return "";
    kinematics_.UpdateVelocity(permitted_ * power);
    int most = 1;
    double largest = 0.0;
    for (int b = 1; b < mechanism_.num_bodies(); ++b) {
      const double gain = applied_[b].dot(kinematics_.motions()[b]);
      if (gain > largest) largest = gain, most = b;
    }
    return fmt::format("nothing holds {}: forces move it, and no coordinate of a joint stops this",
                       mechanism_.body_names()[most]);
  }

  MechanismDescription held_;
  Mechanism<Space, double> mechanism_;
  Kinematics<Space, double> kinematics_;
  UserMechanism<Space> user_;
  RunSample sample_;
  std::vector<Wrench<Space, double>> applied_;
  MatrixXd permitted_;                                          ///< speeds, columns
  std::vector<std::vector<Velocity<Space, double>>> relative_;  ///< by permitted speed and joint
  MatrixXd held_rates_;  ///< orthonormal: combinations of permitted speeds that are held
  VectorXd power_;       ///< of applied forces, by permitted speed
  double negligible_ = 0.0;
};

}  // namespace

Statics FindStatics(const MechanismDescription& description, const Start<double>& start) {
  return description.space == SpaceKind::kPlanar
             ? AtRestSearch<Planar>(description, start).Run(description)
             : AtRestSearch<Spatial>(description, start).Run(description);
}

}  // namespace loopbench::harness
