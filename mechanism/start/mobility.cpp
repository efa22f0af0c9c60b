#include <algorithm>
#include <vector>

#include "mechanism/algebra/decompositions.h"
#include "mechanism/algebra/factors.h"
#include "mechanism/algebra/symmetric_eigen.h"
#include "mechanism/description/topology.h"
#include "mechanism/loops/excursion.h"
#include "mechanism/loops/joint_response.h"
#include "mechanism/loops/scaled_loops.h"
#include "mechanism/loops/tree_dynamics.h"
#include "mechanism/start/assembly.h"
#include "mechanism/start/closure.h"

namespace loopbench {

namespace {

/// A motion that few mixtures lead to is missed by some of them, not by all. [rad or lengths]
constexpr int kTrials = 12;
constexpr double kTrialDistance = 0.02;
/// A tenth of it counts as moved, and opens singular loops by 1e-4 lengths: ten times the effect of
/// rounded input.
constexpr double kRoundedDistance = 0.15;

/// Maximum number of self-stresses and free speeds that are tried: both are squared.
constexpr Eigen::Index kMaxTried = 64;

/// Returns true if a self-stress s of the constraints e proves that nothing moves. Along every
/// speed v with J v = 0 the second derivative of s^T e then has the same sign. Accelerations cannot
/// keep e at zero because s^T J = 0 (second-order rigidity: Connelly and Whiteley, SIAM J. Discrete
/// Math. 9 (1996) 453). Tries each of a basis of self-stresses and their sum.
template <class Space>
bool IsRigidToSecondOrder(const Mechanism<Space, double>& mechanism, const VectorX<double>& q,
                          int rank) {
  const Eigen::Index free = mechanism.num_u() - rank;
  if (!mechanism.couplings().empty()) return false;  // which gamma lacks below
  if (free > kMaxTried || mechanism.num_rows() - rank > kMaxTried) return false;
  Kinematics<Space, double> kinematics(mechanism);
  TreeDynamics<Space, double> dynamics(mechanism);
  kinematics.UpdatePosition(q);
  MatrixX<double> M, J(mechanism.num_rows(), mechanism.num_u());
  dynamics.MassMatrix(kinematics, Masses::kGeometric, M);
  dynamics.Jacobian(kinematics, J);
  const Eigen::LLT<Eigen::MatrixXd> mass(M);
  Eigen::MatrixXd rows = mass.matrixL().solve(J.transpose()).transpose();
  // moments and forces are scaled by the speeds in them; rows without speeds are not
  Eigen::VectorXd size = rows.rowwise().norm();
  const double usual = size.maxCoeff() > 0.0 ? size.maxCoeff() : 1.0;
  size = (size.array() > 1e-6 * usual).select(size, usual);
  rows = size.cwiseInverse().asDiagonal() * rows;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(rows, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::MatrixXd stresses = svd.matrixU().rightCols(rows.rows() - rank);
  const Eigen::MatrixXd speeds = mass.matrixU().solve(svd.matrixV().rightCols(free));
  // J udot = gamma(v) is e'' = 0, so that e'' is -gamma where nothing accelerates
  VectorX<double> h(mechanism.num_u()), gamma(mechanism.num_rows());
  double largest = 0.0;
  const auto second = [&](const Eigen::VectorXd& v) {
    kinematics.UpdateVelocity(v);
    dynamics.Bias(kinematics, h);
    dynamics.JacobianBias(kinematics, gamma);
    const Eigen::VectorXd scaled = gamma.cwiseQuotient(size);
    largest = std::max(largest, scaled.norm());
    return Eigen::VectorXd(-stresses.transpose() * scaled);
  };
  // by polarisation, the diagonal first, all self-stresses at once
  std::vector<Eigen::MatrixXd> forms(static_cast<std::size_t>(stresses.cols()),
                                     Eigen::MatrixXd::Zero(free, free));
  for (Eigen::Index i = 0; i < free; ++i) {
    for (Eigen::Index j = i; j >= 0; --j) {
      const Eigen::VectorXd along = second(i == j ? Eigen::VectorXd(speeds.col(i))
                                                  : Eigen::VectorXd(speeds.col(i) + speeds.col(j)));
      for (std::size_t s = 0; s < forms.size(); ++s) {
        double value = along[static_cast<Eigen::Index>(s)];
        if (i != j) value = 0.5 * (value - forms[s](i, i) - forms[s](j, j));
        forms[s](i, j) = forms[s](j, i) = value;
      }
    }
  }
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(free, free);
  for (const Eigen::MatrixXd& form : forms) all += form;
  forms.push_back(all);
  // the start closes to about 1e-10 of its size, with self-stresses of equal accuracy
  constexpr double kDefinite = 1e-8;
  const double least = kDefinite * largest;
  return largest > 0.0 && std::ranges::any_of(forms, [&](const Eigen::MatrixXd& form) {
           const VectorX<double> values = SymmetricEigenvalues(form);
           return values[0] > least || values[free - 1] < -least;
         });
}

/// Returns the end of a sentence for a mechanism of one part.
template <class Space>
std::string WhyStuck(const Mechanism<Space, double>& mechanism, const VectorX<double>& q,
                     double accuracy) {
  if (!mechanism.drives().empty()) return "";
  if (mechanism.num_u() == 0) return "no joint leaves a speed free";
  const int rows = mechanism.num_equations();
  if (rows == 0) return "";
  const int n = mechanism.num_u();
  const std::string all_taken =
      std::to_string(rows) + " constraints take all " + std::to_string(n) + " speeds";
  Kinematics<Space, double> here(mechanism);
  here.UpdatePosition(q);
  // which judges the constraints of joints
  if (accuracy <= kRankRatio && AreIndependent(here) &&
      (mechanism.couplings().empty() || n <= mechanism.num_rows())) {
    return n > rows ? "" : all_taken;
  }
  if (n > kMaxAnalysedSpeeds) return "";
  // redundant constraints of rounded input leave a motion that closes within its accuracy
  const auto moves_within = [&] {
    Excursion<Space> rounded(mechanism, q, accuracy);
    const double distance = std::max(kRoundedDistance, WayBeyond(accuracy));
    for (int trial = 1; trial <= kTrials; ++trial) {
      if (rounded.Step(distance, trial) == StepKind::kMoved) return true;
    }
    return false;
  };
  Excursion<Space> excursion(mechanism, q);
  const int first_order = excursion.freedom();
  if (first_order == 0) return moves_within() ? "" : all_taken;
  if (excursion.rank() == rows) return "";
  const int rank = excursion.rank();
  int fell_back = 0;
  for (int trial = 1; trial <= kTrials; ++trial) {
    const StepKind step = excursion.Step(kTrialDistance, trial);
    if (step == StepKind::kMoved) return "";
    fell_back += step == StepKind::kFellBack;
  }
  if (fell_back < kTrials && !IsRigidToSecondOrder(mechanism, q, rank)) return "";
  if (moves_within()) return "";
  return "this position is singular, the " + std::to_string(first_order) +
         (first_order == 1 ? " speed that its" : " independent speeds that its") +
         " constraints leave lead" + (first_order == 1 ? "s" : "") +
         " nowhere: what is tried next to it returns to it";
}

}  // namespace

template <class Space>
std::string WhyLocked(const MechanismDescription& description,
                      const Mechanism<Space, double>& mechanism, const VectorX<double>& q) {
  const std::string nothing = "nothing can move: ";
  const bool analysed = mechanism.num_u() <= kMaxAnalysedSpeeds;
  const std::vector<Part> parts = analysed ? SplitByJoints(description) : std::vector<Part>();
  if (parts.size() < 2) {
    const std::string why = WhyStuck(mechanism, q, description.accuracy);
    return why.empty() ? "" : nothing + why;
  }
  std::string first, stuck;
  bool moves = false;
  for (const Part& part : parts) {
    const Mechanism<Space, double> own(part.description, Coordinates::kJoint);
    const Start<double> start = Assemble<Space>(part.description, own);
    const std::string why = start.outcome == Outcome::kLocked
                                ? WhyStuck(own, start.q, description.accuracy)
                                : std::string();
    moves = moves || why.empty();
    if (first.empty()) first = why;
    if (!why.empty() && stuck.empty() && Excursion<Space>(own, start.q).freedom() > 0) {
      stuck = "the part of body \"" + part.description.bodies[1].name +
              "\" cannot move, though others can: " + why;
    }
  }
  return moves ? stuck : nothing + first;
}

template std::string WhyLocked(const MechanismDescription&, const Mechanism<Planar, double>&,
                               const VectorX<double>&);
template std::string WhyLocked(const MechanismDescription&, const Mechanism<Spatial, double>&,
                               const VectorX<double>&);

}  // namespace loopbench
