// Runs one case for accuracy: start, integration, observers, record.
#pragma once

#include <functional>
#include <memory>

#include "harness/analysis/growth.h"
#include "harness/config/experiment.h"
#include "harness/integrator/ode.h"
#include "harness/integrator/options.h"
#include "harness/record.h"
#include "mechanism/formulation.h"

namespace loopbench::harness {

/// The formulation a column names.
template <class Space>
std::unique_ptr<Formulation<Space, double>> MakeFormulation(
    const Column& column, const Mechanism<Space, double>& mechanism);

/// A formulation as the integrator sees it.
template <class Space>
class FormulationOde final : public Ode {
 public:
  explicit FormulationOde(Formulation<Space, double>& formulation) : formulation_(formulation) {}
  int size() const override { return formulation_.state_size(); }
  Outcome Derivative(double t, std::span<const double> y, std::span<double> ydot) override {
    return formulation_.Derivative(t, y, ydot);
  }

 private:
  Formulation<Space, double>& formulation_;
};

/// Method, tolerances and limits of a case.
IntegratorOptions OptionsOf(const Case& one);

/// Names all that decides the run: keys, ensemble, limits, and the mechanism itself.
std::string CaseContent(const Experiment& experiment, const Case& one);

/// Runs the case and, where it asks for one, its ensemble of perturbed starts. The record holds the
/// keys, the outcome and all measured values of the unperturbed run; growth is analysed over the
/// ensemble (or over the single run, which resolves nothing). Limits hold for each run.
///
/// Whatever goes wrong numerically ends in the record; only misuse throws.
Record RunCase(const Experiment& experiment, const Case& one);

}  // namespace loopbench::harness
