// O-DCA held against the oracle: errors of one sample, and the worst of a family.
#pragma once

#include <optional>
#include <string>

#include "mechanism/formulation/options.h"
#include "mechanism/model/mechanism.h"
#include "tests/contract/generators.h"

namespace loopbench::testing {

/// Errors are relative to the largest component of the oracle's answer.
struct Comparison {
  Outcome outcome = Outcome::kFinished;
  double error = 0.0;        ///< of udot
  double force_error = 0.0;  ///< of joint forces
  int rank = 0;              ///< as the formulation reports it
};

/// A sample in one space: mechanism and consistent state in both coordinate sets, the oracle's
/// answers. Absolute coordinates of more than 20 bodies take their answer from the bodies'
/// accelerations in joint coordinates: a dense system of six speeds per body grows too slow.
template <class Space>
class Sample {
 public:
  /// `q`: joint coordinates where the description itself has none that close its loops.
  Sample(const MechanismDescription& description, std::uint64_t seed,
         const std::optional<VectorX<double>>& q = {});

  const MechanismDescription& description() const { return description_; }
  const Answer& answer() const { return joint_answer_; }
  int num_bodies() const { return joint_.num_bodies() - 1; }
  const Mechanism<Space, double>& mechanism(Coordinates coordinates) const {
    return coordinates == Coordinates::kJoint ? joint_ : absolute_;
  }
  const State& state(Coordinates coordinates) const {
    return coordinates == Coordinates::kJoint ? joint_state_ : absolute_state_;
  }
  /// The oracle's udot in either set.
  RealVector udot(Coordinates coordinates) const;
  /// What the comparison allows: 100 eps n / rcond, round-off of n bodies magnified by the
  /// condition of the closures.
  double Bound() const;

  Comparison CompareOdca(Coordinates coordinates, SolverKind solver) const;

 private:
  const MechanismDescription description_;
  const Mechanism<Space, double> joint_, absolute_;
  State joint_state_, absolute_state_;
  Answer joint_answer_;
  std::optional<Answer> absolute_answer_;
};

/// max |a - b| / max |b|; NaN stays NaN.
double RelativeError(const VectorX<double>& a, const RealVector& b);

/// What a family of samples must show, and its worst.
class Family {
 public:
  /// At least `share` of the samples must have rcond above 1e-2, and these are held to 1e-12. A
  /// share of zero: the bound with rcond alone.
  Family(const std::string& name, double share) : name_(name), share_(share) {}
  /// Holds both coordinate sets and the given solvers to the sample's bound, joint forces where
  /// they are unique.
  template <class Space>
  void Hold(const Sample<Space>& sample, bool as_published);
  /// Prints and records the worst.
  void Finish();

 private:
  std::string name_;
  double share_;
  int samples_ = 0, good_ = 0;
  double worst_ = 0.0, worst_good_ = 0.0, worst_of_bound_ = 0.0, worst_force_ = 0.0;
  double smallest_rcond_ = 1.0;
};

}  // namespace loopbench::testing
