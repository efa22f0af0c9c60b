#include "mechanism/simplify/structure.h"

#include <algorithm>
#include <iterator>

#include "mechanism/algebra/factors.h"
#include "mechanism/description/topology.h"
#include "mechanism/loops/excursion.h"
#include "mechanism/loops/joint_response.h"
#include "mechanism/loops/loop_speeds.h"
#include "mechanism/loops/scaled_loops.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench {

namespace {

/// Directions left over by a pivoted factorisation at one position after the rank: contradictory
/// prescribed motions, and directions lost only there.
template <class Space>
std::vector<RedundantDirection> FindDependent(const MechanismDescription& description,
                                              const Kinematics<Space, double>& kinematics) {
  std::vector<RedundantDirection> dependent;
  const Mechanism<Space, double>& mechanism = kinematics.mechanism();
  const ScaledLoops scaled = ScaleLoops(kinematics);
  if (scaled.rows.rows() == scaled.rank) return dependent;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(scaled.rows.transpose());
  const auto& order = qr.colsPermutation().indices();
  std::vector<int> left(order.data() + scaled.rank, order.data() + order.size());
  std::ranges::sort(left);
  const auto add = [&](int index, int row) {
    const Joint<Space, double>& joint = mechanism.joints()[index];
    // drivers come first in D
    const bool drive = row < joint.num_drives;
    dependent.push_back({joint.description,
                         drive ? "the prescribed motion"
                               : NameOfDirection(description, {joint.description, {}},
                                                 kinematics.DirectionOf(index, row)),
                         false});
  };
  for (const int row : left) {
    if (const int c = row - mechanism.num_rows(); c >= 0) {
      const Coupling<double>& coupling = mechanism.couplings()[c];
      const auto [joint, column] = kinematics.FirstOf(c);
      if (coupling.is_moving_row) {
        add(joint, column - mechanism.joints()[joint].num_u());
      } else {
        dependent.push_back({joint, "coupling \"" + coupling.name + "\"", false});
      }
      continue;
    }
    for (int index : mechanism.constraints()) {
      const Joint<Space, double>& joint = mechanism.joints()[index];
      const int i = row - joint.row;
      if (i >= 0 && i < joint.num_constraints()) add(index, i);
    }
  }
  return dependent;
}

/// Couplings whose rows depend on all others here, each without the ones found before it; the last
/// of a file first.
template <class Space>
std::vector<RedundantDirection> FindDependentCouplings(const Kinematics<Space, double>& kinematics,
                                                       const MechanismDescription& description) {
  std::vector<RedundantDirection> dependent;
  const Mechanism<Space, double>& mechanism = kinematics.mechanism();
  const Eigen::MatrixXd rows = ScaleLoops(kinematics).rows;
  if (rows.size() == 0) return dependent;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr;
  qr.setThreshold(kRankRatio);
  qr.compute(rows);
  const Eigen::Index m = rows.rows();
  // columns: sums of rows that vanish
  Eigen::MatrixXd relations =
      Eigen::MatrixXd(qr.householderQ() * Eigen::MatrixXd::Identity(m, m)).rightCols(m - qr.rank());
  for (int c = mechanism.num_coordinate_couplings() - 1; c >= 0 && relations.cols() > 0; --c) {
    const Eigen::MatrixXd share = relations.row(mechanism.num_rows() + c).transpose();
    if (!(share.norm() > kRankRatio)) continue;
    // the other relations leave this row out
    const Eigen::HouseholderQR<Eigen::MatrixXd> turn(share);
    relations.applyOnTheRight(turn.householderQ());
    relations = relations.rightCols(relations.cols() - 1).eval();
    dependent.push_back({kinematics.FirstOf(c).joint,
                         "coupling \"" + description.couplings[c].name + "\"", false, c});
  }
  return dependent;
}

/// Largest component of the accelerations of constraints that no acceleration of the joints meets
/// at speeds u. Less than a hundredth of u^2, times lengths below 1 m, counts as 0: near a singular
/// position, coordinates of six digits change speeds by a thousandth.
template <class Space>
double UnmetAcceleration(Kinematics<Space, double>& kinematics, const VectorX<double>& u) {
  const Mechanism<Space, double>& mechanism = kinematics.mechanism();
  TreeDynamics<Space, double> dynamics(mechanism);
  kinematics.UpdateVelocity(u);
  VectorX<double> bias, gamma = VectorX<double>::Zero(mechanism.num_equations());
  MatrixX<double> J, G;
  dynamics.Bias(kinematics, bias);
  dynamics.JacobianBias(kinematics, gamma);
  dynamics.Jacobian(kinematics, J);
  dynamics.CouplingJacobian(kinematics, G);
  Eigen::MatrixXd rows(gamma.size(), mechanism.num_u());
  rows << J, G;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(kRankRatio);
  solver.compute(rows);
  const VectorX<double> left = gamma - rows * solver.solve(gamma);
  constexpr double kOfRoundedStart = 1e-2;
  const double unmet = left.template lpNorm<Eigen::Infinity>();
  return unmet > kOfRoundedStart * u.squaredNorm() * std::min(1.0, mechanism.length()) ? unmet
                                                                                       : 0.0;
}

template <class Space>
class Analysis {
 public:
  explicit Analysis(const MechanismDescription& description)
      : description_(description), mechanism_(description, Coordinates::kJoint) {}

  Structure Run() {
    Count();
    result_.islands = FindIslands(description_);
    result_.start = Assemble<Space>(description_, mechanism_);
    Kinematics<Space, double> kinematics(mechanism_);
    kinematics.UpdatePosition(result_.start.q);
    for (int index : mechanism_.constraints()) result_.loops.push_back(FindLoop(index, kinematics));
    result_.analysed = result_.joint_u <= kMaxAnalysedSpeeds;
    if (!result_.analysed) {
      result_.analysed = result_.couplings == 0 && AreIndependent(kinematics);
      if (result_.analysed) result_.rank = result_.rank_nearby = result_.loop_rows;
      return result_;
    }
    const LoopSpectrum here = SpectrumOfLoops(kinematics);
    result_.rank = here.rank;
    result_.singular_values = here.singular_values;
    const Redundancy redundancy = FindRedundancy(description_);
    result_.rounding = redundancy.rounding;
    for (const Released& out : redundancy.released) {
      for (const int direction : out.directions) {
        if (out.IsMoving(direction)) continue;
        result_.redundant.push_back(
            {out.joint, NameOfDirection(description_, out, direction), true});
      }
    }
    const bool driven = !mechanism_.drives().empty();
    const bool known =
        redundancy.rows > 0 && !driven && redundancy.num_couplings == result_.couplings;
    if (known && redundancy.rounding > 0.0) result_.rank = redundancy.rank_at_start;
    result_.rank_nearby = known ? redundancy.rank : result_.rank;
    FindFreedomOfParts();
    if (!driven && !known && result_.couplings > 0) {
      const MechanismDescription rest = Release(description_, redundancy);
      const Mechanism<Space, double> mechanism(rest, Coordinates::kJoint);
      Kinematics<Space, double> at_start(mechanism);
      at_start.UpdatePosition(result_.start.q);
      std::ranges::copy(FindDependentCouplings(at_start, description_),
                        std::back_inserter(result_.redundant));
    }
    if (!driven && result_.singular_start() && result_.start.outcome == Outcome::kFinished) {
      result_.unmet_acceleration = UnmetAcceleration(kinematics, result_.start.u);
    }
    if (!driven) return result_;
    const MechanismDescription released = Release(description_, redundancy);
    const Mechanism<Space, double> rest(released, Coordinates::kJoint);
    Kinematics<Space, double> at_start(rest);
    at_start.UpdatePosition(result_.start.q);
    std::ranges::copy(FindDependent(description_, at_start), std::back_inserter(result_.redundant));
    return result_;
  }

 private:
  void FindFreedomOfParts() {
    if (result_.start.outcome != Outcome::kLocked) return;
    const std::vector<Part> parts = SplitByJoints(description_);
    if (parts.size() < 2) return;
    int freedom = 0;
    for (const Part& part : parts) {
      freedom += AnalyseStructure(part.description).freedom();
    }
    if (freedom > 0) result_.freedom_of_parts = freedom;
  }

  void Count() {
    const Mechanism<Space, double> absolute(description_, Coordinates::kAbsolute);
    result_.space = description_.space;
    result_.bodies = mechanism_.num_bodies() - 1;
    result_.joints = static_cast<int>(description_.joints.size());
    result_.couplings = static_cast<int>(mechanism_.couplings().size());
    result_.rows = absolute.num_equations();
    result_.loop_rows = mechanism_.num_equations();
    result_.joint_q = mechanism_.num_q();
    result_.joint_u = mechanism_.num_u();
    result_.absolute_q = absolute.num_q();
    result_.absolute_u = absolute.num_u();
    result_.length = mechanism_.length();
    for (int body = 0; body < mechanism_.num_bodies(); ++body) {
      result_.centre_distances.push_back(mechanism_.geometric_centre(body).norm());
    }
    result_.counted_freedom = Space::kDim * result_.bodies - result_.rows;
  }

  LoopPath FindLoop(int index, const Kinematics<Space, double>& kinematics) const {
    const Joint<Space, double>& joint = mechanism_.joints()[index];
    const auto [up, down] = WaysOfLoop(mechanism_, index);
    LoopPath loop;
    loop.cut_joint = index;
    loop.joints.push_back(index);
    loop.bodies.push_back(joint.to);
    for (const TreeStep& step : up) {
      loop.joints.push_back(step.joint);
      loop.bodies.push_back(step.parent);
    }
    for (auto step = down.rbegin(); step != down.rend(); ++step) {
      loop.joints.push_back(step->joint);
      loop.bodies.push_back(step->child);
    }
    const JointState<Space, double>& state = kinematics.joints()[index];
    const Direction<Space, double> open =
        state.Sum(state.Along(kinematics.ConstraintMismatch(index), state.rows()), state.rows());
    loop.open_rotation = open.angular.norm();
    loop.open_shift = open.linear.norm();
    return loop;
  }

  const MechanismDescription& description_;
  Mechanism<Space, double> mechanism_;
  Structure result_;
};

}  // namespace

double Structure::conditioning() const {
  return singular_values.size() > 0 && rank > 0 ? singular_values[rank - 1] / singular_values[0]
                                                : 1.0;
}

Structure AnalyseStructure(const MechanismDescription& description) {
  return ForSpace(description.space,
                  [&]<class Space>(Space) { return Analysis<Space>(description).Run(); });
}

}  // namespace loopbench
