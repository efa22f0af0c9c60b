#include "mechanism/start/assembly.h"

#include <algorithm>
#include <limits>
#include <random>
#include <utility>

#include "mechanism/loops/tree_dynamics.h"
#include "mechanism/start/closure.h"

namespace loopbench {

namespace {

/// The assembly problem of one mechanism in joint coordinates. Lengths count in units of the
/// mechanism's own, so that its size decides nothing; a power of two, so that they round nothing.
template <class Space>
class Assembler {
 public:
  Assembler(const MechanismDescription& description, const Mechanism<Space, double>& mechanism)
      : description_(description),
        mechanism_(mechanism),
        kinematics_(mechanism),
        given_u_(mechanism.num_u(), false) {
    start_.q = GuessedPositions(description, mechanism);
    start_.u.setZero(mechanism.num_u());
    ReadSpeeds();
    kinematics_.UpdatePosition(start_.q);
    units_ = AssemblyUnits<Space>(kinematics_);
  }

  Start<double> Run() {
    ClosePositions(description_, kinematics_, units_, &start_);
    if (start_.outcome == Outcome::kFinished) CloseSpeeds();
    if (start_.outcome != Outcome::kFinished) return start_;
    if (const std::string why = WhyLocked(description_, mechanism_, start_.q); !why.empty()) {
      start_.outcome = Outcome::kLocked;
      start_.message = mechanism_.name() + ": " + why;
    }
    return start_;
  }

 private:
  void ReadSpeeds() {
    for (const JointValues& values : description_.initial.speeds) {
      const Joint<Space, double>& joint = mechanism_.joints()[values.joint];
      mechanism_.ForEachFree(joint, joint.kind->num_u, [&](int i, int free) {
        if (!joint.in_tree()) {
          given_cut_.push_back({values.joint, free});
          given_cut_speeds_.push_back(values.values[i]);
        } else {
          start_.u[joint.u_offset + free] = values.values[i];
          given_u_[joint.u_offset + free] = true;
        }
      });
    }
  }

  /// Speed of the free coordinate `component` of a cut joint.
  double CutJointSpeed(int index, int component) const {
    const JointState<Space, double>& state = kinematics_.joints()[index];
    return mechanism_.joints()[index].kind->inverse_H_squared * state.H(component).dot(state.V_rel);
  }

  void CloseSpeeds() {
    kinematics_.UpdatePosition(start_.q);
    const int rows = mechanism_.num_equations(), extra = static_cast<int>(given_cut_.size());
    if (rows + extra == 0) return;
    const VectorX<double> at_rest = VectorX<double>::Zero(mechanism_.num_u());
    VectorX<double> target, bias;
    SpeedBias(kinematics_, at_rest, bias);
    target = -bias;
    target.conservativeResize(rows + extra);
    const VectorX<double> units = units_.With(kinematics_, given_cut_);
    kinematics_.UpdateVelocity(at_rest);
    for (int c = 0; c < static_cast<int>(mechanism_.couplings().size()); ++c) {
      target[mechanism_.num_rows() + c] = -kinematics_.CouplingSpeed(c);
    }
    for (int k = 0; k < extra; ++k) {
      const auto& [joint, component] = given_cut_[k];
      target[rows + k] = given_cut_speeds_[k] - CutJointSpeed(joint, component);
    }
    const std::vector<bool> none(given_u_.size(), false);
    const SparseRows J = LoopRows(kinematics_, units_, units, given_cut_, none);
    target = target.cwiseQuotient(units);
    start_.u = start_.u.cwiseQuotient(units_.columns);
    const VectorX<double> miss = target - J * start_.u;
    const double size =
        1.0 + target.stableNorm() + start_.u.stableNorm() * Extent(mechanism_, units_);
    const bool off = miss.stableNorm() > 64 * std::numeric_limits<double>::epsilon() * size;
    if (off && mechanism_.num_u() > 0) {
      VectorX<double> change =
          LeastSquares(LoopRows(kinematics_, units_, units, given_cut_, given_u_),
                       mechanism_.name())
              .Smallest(miss);
      ClearFixed(given_u_, &change);
      start_.u += change;
    }
    VectorX<double> left = target - J * start_.u;
    const double misfit = left.template lpNorm<Eigen::Infinity>(), least = 1e-10 * size;
    const double accuracy = description_.accuracy * size;
    bool fits = misfit <= least && std::isfinite(size) && left.allFinite();
    const bool is_rounding = !fits && mechanism_.num_u() > 0 && misfit < kHintFactor * accuracy;
    if (is_rounding) {
      // Given speeds are rounded if a small change of all makes them exact. Otherwise redundant
      // constraints are: these leave no motion, or no speeds at all.
      constexpr double kSmallChange = 0.01;
      const VectorX<double> change =
          LeastSquares(LoopRows(kinematics_, units_, units, given_cut_, none), mechanism_.name())
              .Smallest(left);
      const VectorX<double> after = left - J * change;
      fits = misfit <= accuracy;
      if (fits && after.template lpNorm<Eigen::Infinity>() <= least &&
          change.norm() <= kSmallChange * start_.u.norm()) {
        start_.u += change;
        start_.has_given_speeds = false;
        left = after;
      }
    }
    start_.u = start_.u.cwiseProduct(units_.columns);
    start_.speed_residual = InSi(left, units);
    if (fits) return;
    start_.outcome = Outcome::kInconsistentStart;
    UnsatisfiedConstraints unmet{left, units, true, given_cut_};
    if (is_rounding) unmet.accuracy = misfit / size;
    start_.message = mechanism_.name() + ": " + DescribeConflict(description_, kinematics_, unmet);
  }

  const MechanismDescription& description_;
  const Mechanism<Space, double>& mechanism_;
  Kinematics<Space, double> kinematics_;
  Start<double> start_;
  std::vector<bool> given_u_;
  AssemblyUnits<Space> units_;
  std::vector<OfCutJoint> given_cut_;
  std::vector<double> given_cut_speeds_;
};

/// If directions are released for the accuracy of the input: the description with guesses at the
/// start of all constraints, where the released ones are closed within the accuracy. Other
/// positions may close the imposed ones alone.
template <class Space>
MechanismDescription NearAllImposed(const MechanismDescription& description) {
  MechanismDescription near = description;
  if (!description.rounded) return near;
  MechanismDescription all = description;
  all.rounded = false;
  all = Unreleased(all);
  const Mechanism<Space, double> mechanism(all, Coordinates::kJoint);
  const Start<double> start = Assembler<Space>(all, mechanism).Run();
  if (start.outcome != Outcome::kFinished) return near;
  std::vector<JointValues>& values = near.initial.coordinates;
  std::erase_if(values, [&](const JointValues& one) {
    return mechanism.joints()[one.joint].in_tree() && !near.initial.IsHeld(one.joint);
  });
  for (JointValues& one : TreeValues(mechanism, start.q)) {
    if (!near.initial.IsHeld(one.joint)) values.push_back(std::move(one));
  }
  return near;
}

}  // namespace

template <class Space>
Start<double> Assemble(const MechanismDescription& description,
                       const Mechanism<Space, double>& mechanism) {
  if (mechanism.coordinates() == Coordinates::kJoint && mechanism.released().empty()) {
    return Assembler<Space>(description, mechanism).Run();
  }
  // released directions hold, too
  const Mechanism<Space, double> joints(Unreleased(description), Coordinates::kJoint);
  Start<double> start = Assembler<Space>(NearAllImposed<Space>(description), joints).Run();
  if (start.outcome != Outcome::kFinished) return start;
  if (mechanism.coordinates() == Coordinates::kJoint) return start;
  Kinematics<Space, double> from(joints), to(mechanism);
  from.UpdatePosition(start.q);
  from.UpdateVelocity(start.u);
  start.q = from.CoordinatesIn(mechanism);
  to.UpdatePosition(start.q);
  start.u = from.SpeedsIn(to);
  return start;
}

template Start<double> Assemble(const MechanismDescription&, const Mechanism<Planar, double>&);
template Start<double> Assemble(const MechanismDescription&, const Mechanism<Spatial, double>&);

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

template VectorX<double> GuessedPositions(const MechanismDescription&,
                                          const Mechanism<Planar, double>&);
template VectorX<double> GuessedPositions(const MechanismDescription&,
                                          const Mechanism<Spatial, double>&);

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

MechanismDescription Perturb(MechanismDescription description, double amplitude, std::uint64_t seed,
                             int member) {
  std::seed_seq sequence{seed, static_cast<std::uint64_t>(member)};
  std::mt19937_64 generator(sequence);
  for (JointValues& values : description.initial.coordinates) {
    if (!description.initial.IsHeld(values.joint)) continue;
    for (double& value : values.values) value += amplitude * (2.0 * UnitNumber(generator) - 1.0);
  }
  return description;
}

}  // namespace loopbench
