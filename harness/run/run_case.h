// Runs one case for accuracy: start, integration, observers, record.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "harness/analysis/growth.h"
#include "harness/config/experiment.h"
#include "harness/config/options.h"
#include "harness/integrator/ode.h"
#include "harness/record/record.h"
#include "mechanism/formulation/forward_jacobian.h"

namespace loopbench::harness {

/// The formulation a column names.
template <class Space>
std::unique_ptr<Formulation<Space, double>> MakeFormulation(
    const Column& column, const Mechanism<Space, double>& mechanism);

/// Power [W] that enters and leaves the mechanism at the formulation's last successful evaluation:
/// of whatever does work without a potential, prescribed motions included.
template <class Space>
Power<double> PowerOf(Formulation<Space, double>& formulation) {
  Power<double> power = AppliedPower(formulation.kinematics());
  power.supplied += formulation.DrivePower();
  return power;
}

/// The Jacobian that a case's Newton iteration is given; null where it makes difference quotients,
/// or has none.
template <class Space>
std::unique_ptr<ForwardJacobian<Space>> MakeJacobian(const std::string& integrator,
                                                     JacobianKind kind,
                                                     const MechanismDescription& description,
                                                     Formulation<Space, double>& formulation) {
  const bool wanted = FindProfile(integrator)->is_implicit && kind == JacobianKind::kForward;
  return wanted ? std::make_unique<ForwardJacobian<Space>>(description, formulation) : nullptr;
}

/// A formulation as the integrator sees it: its state, and after it, if asked for, the work [J]
/// supplied and the work dissipated since the start (quadratures: the motion has the same bits with
/// and without them). Timings do without.
template <class Space>
class FormulationOde final : public Ode {
 public:
  /// `jacobian` is that of `formulation`, or null.
  explicit FormulationOde(Formulation<Space, double>& formulation, bool with_work = false,
                          std::unique_ptr<ForwardJacobian<Space>> jacobian = nullptr)
      : formulation_(formulation),
        with_work_(with_work || formulation.state_size() == 0),
        jacobian_(std::move(jacobian)),
        y_(static_cast<std::size_t>(size())),
        ydot_(y_.size()) {}
  int size() const override { return formulation_.state_size() + (with_work_ ? 2 : 0); }
  /// Where prescribed motions leave no state, the work itself is what is integrated.
  int num_quadratures() const override {
    return with_work_ && formulation_.state_size() > 0 ? 2 : 0;
  }
  Outcome Derivative(double t, std::span<const double> y, std::span<double> ydot) override {
    const std::size_t n = static_cast<std::size_t>(formulation_.state_size());
    const Outcome outcome = formulation_.Derivative(t, y.first(n), ydot.first(n));
    if (jacobian_ != nullptr) {
      version_ = outcome == Outcome::kFinished ? formulation_.kinematics().position_version() : -1;
      t_ = t;
      std::copy(y.begin(), y.end(), y_.begin());
    }
    if (!with_work_ || outcome != Outcome::kFinished) return outcome;
    const Power<double> power = PowerOf(formulation_);
    ydot[n] = power.supplied;
    ydot[n + 1] = power.dissipated;
    return outcome;
  }
  std::optional<JacobianWork> Jacobian(double t, std::span<const double> y,
                                       std::span<double> jacobian) override {
    if (jacobian_ == nullptr) return std::nullopt;
    JacobianWork work{.derivatives = 0, .dual_evaluations = jacobian_->evaluations()};
    if (!IsAt(t, y)) {
      if (Derivative(t, y, ydot_) != Outcome::kFinished) return std::nullopt;  // it will say why
      work.derivatives = 1;
    }
    Eigen::Map<Eigen::MatrixXd> all(jacobian.data(), size(), size() - num_quadratures());
    jacobian_->Evaluate(all.leftCols(formulation_.state_size()));
    version_ = -1;  // its solutions stand where those of the derivative stood
    return work;
  }

 private:
  /// Whether the formulation's last evaluation was the derivative at this (t, y).
  bool IsAt(double t, std::span<const double> y) const {
    return version_ == formulation_.kinematics().position_version() && t == t_ &&
           std::equal(y.begin(), y.end(), y_.begin());
  }

  Formulation<Space, double>& formulation_;
  bool with_work_;
  std::unique_ptr<ForwardJacobian<Space>> jacobian_;
  long version_ = -1;
  double t_ = 0.0;
  std::vector<double> y_, ydot_;
};

/// Method, tolerances and limits of a case, and the stop times of its mechanism.
IntegratorOptions OptionsOf(const Case& one, const std::vector<double>& stop_times);

/// Runs the case and, where it asks for one, its ensemble of perturbed starts. The record holds the
/// keys, the outcome and all measured values of the unperturbed run; growth is analysed over the
/// ensemble (or over the single run, which resolves nothing). Limits hold for each run.
///
/// Whatever goes wrong numerically ends in the record; only misuse throws.
Record RunCase(const Experiment& experiment, const Case& one);

}  // namespace loopbench::harness
