#include "tests/contract/check.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>

#include "harness/config/formulations.h"
#include "mechanism/loops/tree_dynamics.h"
#include "tests/contract/sample.h"

namespace loopbench::contract {
namespace {

using namespace loopbench::testing;  // NOLINT: the oracle's words
using Bits = std::vector<double>;

constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr int kMaxShown = 3;  ///< violations of one promise

/// Violations so far, the first of each promise in words.
class Findings {
 public:
  void Expect(bool kept, const std::string& promise, const std::string& found,
              const std::string& where) {
    if (kept || ++counts_[promise] > kMaxShown) return;
    sentences_.push_back(fmt::format("{}: {} ({})", promise, found, where));
  }
  std::vector<std::string> Sentences() const {
    std::vector<std::string> all = sentences_;
    for (const auto& [promise, count] : counts_) {
      if (count > kMaxShown) {
        all.push_back(fmt::format("{}: {} more", promise, count - kMaxShown));
      }
    }
    return all;
  }

 private:
  std::vector<std::string> sentences_;
  std::map<std::string, int> counts_;
};

constexpr double kLater = 0.8;  ///< [s]

/// The oracle's values of a sample in one coordinate set, for any formulation.
template <class Space>
struct Truth {
  Truth(const Sample<Space>& from, Coordinates coordinates)
      : sample(from),
        set(coordinates),
        mechanism(from.mechanism(coordinates)),
        state(from.state(coordinates)),
        oracle(from.description(), LayoutOf(mechanism)),
        udot(from.udot(coordinates)) {
    if (!mechanism.drives().empty()) return;
    oracle.SetTime(kLater);
    later = oracle.Solve(ToReal(state.q), ToReal(state.u)).udot;
    oracle.SetTime(0);
  }

  const Sample<Space>& sample;
  Coordinates set;
  const Mechanism<Space, double>& mechanism;
  const State& state;
  Oracle oracle;
  RealVector udot;
  /// At kLater, at the same positions and speeds. Not with prescribed motions, which would move the
  /// constraints away from them.
  RealVector later;
};

Real Largest(const RealVector& v) { return v.size() == 0 ? Real(0) : v.lpNorm<Eigen::Infinity>(); }

bool SameBits(const Bits& a, const Bits& b) {
  return std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

/// One formulation on one sample.
template <class Space>
class Inspection {
 public:
  Inspection(const std::string& name, const FormulationOptions& options, Truth<Space>& truth,
             Findings& findings)
      : name_(name),
        options_(options),
        truth_(truth),
        mechanism_(truth.mechanism),
        state_(truth.state),
        oracle_(truth.oracle),
        findings_(findings),
        own_(Make()) {}

  void Run() {
    if (!Starts()) return;
    CheckAccelerations();
    CheckForces();
    CheckTime();
    CheckEnergy();
    CheckPurity();
    CheckSpeeds();
    if (level() == Enforcement::kVelocity) CheckVelocityLevel();
    CheckEndings();
    if (level() == Enforcement::kPosition) CheckProjection();
  }

 private:
  Enforcement level() const { return options_.enforcement; }
  auto Make() const { return harness::MakeFormulation<Space>(name_, mechanism_, options_); }

  void Expect(bool kept, const std::string& promise, const std::string& found) {
    findings_.Expect(kept, promise, found,
                     fmt::format("{}, {}, {}; {}, {}", ToString(level()), ToString(truth_.set),
                                 ToString(options_.solver), mechanism_.name(),
                                 Space::kRot == 1 ? "in the plane" : "in space"));
  }
  void ExpectBelow(double error, double bound, const std::string& promise) {
    Expect(error <= bound, promise, fmt::format("{:.2g} where {:.2g} is allowed", error, bound));
  }

  /// Elimination of N unknowns loses 100 eps N / rcond.
  double Bound() const {
    return 100 * kEps * (mechanism_.num_u() + mechanism_.num_rows()) / truth_.sample.answer().rcond;
  }

  Outcome Derivative(const Bits& at) {
    return own_->Derivative(0.0, std::span<const double>(at), std::span<double>(ydot_));
  }
  Outcome Examine(const Bits& at) {
    return own_->Examine(0.0, std::span<const double>(at), std::span<double>(ydot_));
  }
  RealVector q() const { return ToReal(own_->q()); }
  RealVector u() const { return ToReal(own_->u()); }

  bool Starts() {
    const Outcome start = own_->Start(0.0, state_.q, state_.u);
    Expect(start == Outcome::kFinished, "starts", fmt::format("ended as {}", ToString(start)));
    if (start != Outcome::kFinished) return false;
    y_.resize(static_cast<std::size_t>(own_->state_size()));  // which the start decides
    ydot_.resize(y_.size());
    own_->ToState(state_.q, state_.u, y_);
    const Outcome outcome = Derivative(y_);
    Expect(outcome == Outcome::kFinished, "starts",
           fmt::format("the first derivative ended as {}", ToString(outcome)));
    return outcome == Outcome::kFinished;
  }

  /// By whatever way is the shortest, and with all that can be asked afterwards.
  void CheckAccelerations() {
    Derivative(y_);
    const Bits shortest = ydot_;
    Examine(y_);
    ExpectBelow(RelativeError(own_->udot(), truth_.udot), Bound(), "accelerations");
    const auto as_vector = [](const Bits& bits) {
      return Eigen::Map<const VectorX<double>>(bits.data(), std::ssize(bits));
    };
    ExpectBelow(RelativeError(as_vector(shortest), ToReal(VectorX<double>(as_vector(ydot_)))),
                2.0 * Bound(), "accelerations");
    const int rank = own_->diagnostics().rank, expected = truth_.sample.answer().rank;
    Expect(rank == expected, "rank", fmt::format("{} where {} is right", rank, expected));
  }

  /// J^T lambda is what the oracle's masses take beyond the forces applied.
  void CheckForces() {
    Examine(y_);
    const Equations e = oracle_.Form(q(), u());
    const RealVector needed = e.M * ToReal(own_->udot()) + e.h;
    MatrixX<double> J = MatrixX<double>::Zero(mechanism_.num_rows(), mechanism_.num_u());
    TreeDynamics<Space, double>(mechanism_).Jacobian(own_->kinematics(), J);
    const RealVector forces = ToReal(J).transpose() * ToReal(own_->Multipliers());
    // masses and accelerations of different sizes cancel
    const Real size =
        (e.M.cwiseAbs() * ToReal(own_->udot()).cwiseAbs() + e.h.cwiseAbs()).maxCoeff();
    ExpectBelow(static_cast<double>(Largest(needed - forces) / size), Bound(), "forces");
  }

  void CheckTime() {
    if (truth_.later.size() == 0) return;
    VectorX<double> udot;
    const Outcome outcome = own_->Evaluate(kLater, state_.q, state_.u, udot);
    Expect(outcome == Outcome::kFinished, "time", fmt::format("ended as {}", ToString(outcome)));
    if (outcome == Outcome::kFinished) {
      ExpectBelow(RelativeError(udot, truth_.later), Bound(), "time");
    }
  }

  /// The energy's rate by differences of the oracle's along the motion.
  void CheckEnergy() {
    Examine(y_);
    const RealVector at = q(), speeds = u(), udot = ToReal(own_->udot());
    const RealVector qdot = ToReal(Eigen::Map<const VectorX<double>>(ydot_.data(), at.size()));
    const Real step = 1e-6L;  // long double: truncation 1e-12, round-off 1e-13
    const auto energy = [&](Real t) {
      oracle_.SetTime(t);
      return oracle_.TotalEnergy(at + t * qdot, speeds + t * udot);
    };
    const Real rate = (energy(step) - energy(-step)) / (2 * step);
    const Real scale = 1 + std::abs(energy(0)) + Largest(udot);
    oracle_.SetTime(0);
    const Power<double> all = own_->TotalPower();
    const double power = all.supplied - all.dissipated;
    ExpectBelow(static_cast<double>(std::abs(rate - power) / scale), 1e-10 + Bound(), "energy");
  }

  void CheckPurity() {
    Derivative(y_);
    const Bits first = ydot_;
    Bits other = y_;
    for (std::size_t i = 0; i < other.size(); ++i) {
      other[i] += 1e-3 * std::sin(static_cast<double>(i + 1));
    }
    Derivative(other);
    VectorX<double> udot;
    own_->Evaluate(1.0, state_.q, -state_.u, udot);
    own_->FromState(0.0, std::span<const double>(other));
    for (int again = 0; again < 2; ++again) {
      Derivative(y_);
      Expect(SameBits(first, ydot_), "purity", "the same state has another derivative");
    }
    const auto second = Make();
    second->Start(0.0, state_.q, state_.u);
    second->Derivative(0.0, std::span<const double>(y_), std::span<double>(ydot_));
    Expect(SameBits(first, ydot_), "determinism", "a second object has another derivative");
  }

  void CheckSpeeds() {
    own_->FromState(0.0, std::span<const double>(y_));
    Expect(own_->q() == state_.q, "speeds", "positions of the state are changed");
    const bool projected = level() == Enforcement::kVelocity;
    ExpectBelow(static_cast<double>(Largest(u() - ToReal(state_.u))),
                projected ? Bound() * static_cast<double>(Largest(ToReal(state_.u))) : 0.0,
                "speeds");
    Bits again(y_.size());
    own_->ToState(own_->q(), own_->u(), again);
    again.resize(static_cast<std::size_t>(mechanism_.num_q()));
    Expect(SameBits(again, y_), "speeds", "the state of the same positions has others");
  }

  /// From speeds that do not satisfy the loops.
  void CheckVelocityLevel() {
    Bits off = y_;
    for (std::size_t i = static_cast<std::size_t>(mechanism_.num_q()); i < off.size(); ++i) {
      off[i] += 0.1;
    }
    Examine(off);
    const RealMatrix J = oracle_.Form(q(), u()).J;
    const Real row = J.size() == 0 ? Real(0) : J.cwiseAbs().rowwise().sum().maxCoeff();
    const Real scale = Largest(oracle_.ClosureRates(q(), 0 * u())) + row * Largest(u());
    ExpectBelow(static_cast<double>(Largest(oracle_.ClosureRates(q(), u()))),
                Bound() * static_cast<double>(scale), "speeds");
  }

  /// The last check: it moves the state.
  void CheckProjection() {
    Bits off = y_;
    for (std::size_t i = 0; i < off.size(); ++i) {
      off[i] += 1e-4 * std::sin(2.0 * static_cast<double>(i + 1));
    }
    const bool changed = own_->BeginStep(0.0, std::span<double>(off));
    const auto& correction = own_->level().correction();
    Expect(changed && correction.shift + correction.rotation > 0.0, "projection", "has no effect");
    own_->FromState(0.0, std::span<const double>(off));
    // rows of lengths and speeds of some metres, through as many bodies
    const double scale = 1.0 + static_cast<double>(q().norm() + u().norm());
    ExpectBelow(static_cast<double>(Largest(oracle_.ClosureMismatches(q()))), Bound() * scale,
                "projection");
    ExpectBelow(static_cast<double>(Largest(oracle_.ClosureRates(q(), u()))),
                Bound() * scale * scale, "projection");
    Bits again = off;
    own_->BeginStep(0.0, std::span<double>(again));
    double moved = 0.0;
    for (std::size_t i = 0; i < off.size(); ++i)
      moved = std::max(moved, std::abs(again[i] - off[i]));
    ExpectBelow(moved, Bound() * scale, "projection");
  }

  void CheckEndings() {
    Derivative(y_);
    const Bits good = ydot_;
    const auto first_speed = static_cast<std::size_t>(mechanism_.num_q());
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      for (const std::size_t i : {std::size_t{0}, first_speed - 1, first_speed, y_.size() - 1}) {
        Bits y = y_;
        y[i] = bad;
        const Outcome outcome = Derivative(y);
        Expect(outcome == Outcome::kNonFinite || outcome == Outcome::kSingular, "endings",
               fmt::format("y[{}] = {} ended as {}", i, bad, ToString(outcome)));
      }
    }
    Derivative(y_);
    Expect(SameBits(good, ydot_), "endings", "something is left of a bad state");
  }

  const std::string& name_;
  const FormulationOptions options_;
  Truth<Space>& truth_;
  const Mechanism<Space, double>& mechanism_;
  const State& state_;
  Oracle& oracle_;
  Findings& findings_;
  std::unique_ptr<System<Space, double>> own_;
  Bits y_, ydot_;
};

template <class Space>
void Inspect(const harness::FormulationRow& row, const MechanismDescription& description,
             std::uint64_t seed, Findings& findings) {
  const Sample<Space> sample(description, seed);
  for (const Coordinates set : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    Truth<Space> truth(sample, set);
    for (const Enforcement level : {Enforcement::kAcceleration, Enforcement::kVelocity,
                                    Enforcement::kPosition, Enforcement::kBaumgarte}) {
      if (!row.Has(level)) continue;
      for (const SolverKind solver : {SolverKind::kRankRevealing, SolverKind::kAsPublished}) {
        const FormulationOptions options{.enforcement = level, .solver = solver};
        Inspection<Space>(row.name, options, truth, findings).Run();
      }
    }
  }
}

}  // namespace

std::vector<std::string> Check(const std::string& formulation,
                               const std::vector<std::uint64_t>& seeds, bool all_kinds) {
  const harness::FormulationRow* row = harness::FindFormulation(formulation);
  if (row == nullptr) {
    throw std::invalid_argument(fmt::format("no formulation \"{}\" is registered", formulation));
  }
  Findings findings;
  for (const std::uint64_t seed : seeds) {
    Inspect<Planar>(*row, CoupledLoops(SpaceKind::kPlanar, seed), seed, findings);
  }
  for (const std::uint64_t seed : seeds) {
    Inspect<Spatial>(*row, CoupledLoops(SpaceKind::kSpatial, seed), seed, findings);
    if (all_kinds) Inspect<Spatial>(*row, LoopOfAllKinds(seed), seed, findings);
  }
  return findings.Sentences();
}

}  // namespace loopbench::contract
