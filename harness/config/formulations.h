// Registry of formulations by name, with their properties for readers, tables and figures.
//
// Built-in formulations are rows of formulations.cpp. A program registers its own formulation
// before loopbench::Main() (harness/cli/program.h; examples/own-formulation/):
//
//   harness::RegisterFormulation(harness::Row<NullSpace>("null-space", "a basis of ..."));
//
// Afterwards the name is valid wherever "odca" is. Runs in several scalars (harness/precision/)
// need built-in formulations: rows make solvers in double.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mechanism/formulation/system.h"

namespace loopbench::harness {

/// Makes a formulation's solver for a mechanism, which must outlive it.
template <class Space>
using SolverFactory = std::function<std::unique_ptr<ConstraintSolver<Space, double>>(
    const Mechanism<Space, double>&, const FormulationOptions&)>;

/// Properties of a formulation.
struct FormulationRow {
  /// Name in files and tables: a-z, 0-9, '-' and '_'; for peers "peer/" and a name.
  std::string name;
  std::string sentence;  ///< text of `explain`, after "name: "
  SolverFactory<Planar> planar;
  SolverFactory<Spatial> spatial;
  std::vector<Enforcement> levels = {};  ///< available levels; empty: all
  /// Colour of its curves in figures, "#RRGGBB". If empty, the next free colour is assigned.
  std::string color = {};
  /// Integrator of a peer (harness/run/run.h), an external program. Tables show it instead of the
  /// experiment's integrator. Empty for formulations. Its factories make the solver for the peer's
  /// states.
  std::string integrator = {};

  /// True for a peer with compliant closures, whose final states do not verify other runs.
  bool is_soft = false;

  bool is_peer() const { return !integrator.empty(); }
  bool Has(Enforcement level) const;
};

/// Returns the row of a class template such as odca::Odca, made from a mechanism and options.
template <template <class Space, class S> class Solver>
FormulationRow Row(std::string name, std::string sentence, std::string color = {}) {
  const auto make = []<class Space>(const Mechanism<Space, double>& mechanism,
                                    const FormulationOptions& options) {
    return std::unique_ptr<ConstraintSolver<Space, double>>(
        std::make_unique<Solver<Space, double>>(mechanism, options));
  };
  return {.name = std::move(name),
          .sentence = std::move(sentence),
          .planar = make,
          .spatial = make,
          .color = std::move(color)};
}

/// Adds a row; not while experiments run. Throws std::invalid_argument for an invalid row
/// (mechanism/description/registration.h) or colour.
void RegisterFormulation(FormulationRow row, int alignment = EIGEN_MAX_STATIC_ALIGN_BYTES);

/// Returns all rows: built-in ones, then others as registered. References stay valid.
const std::deque<FormulationRow>& Formulations();
std::vector<std::string> FormulationNames();
/// Returns names without peers, which have their own right-hand sides.
std::vector<std::string> FormulationNamesWithoutPeers();
/// Returns null for a name that is not registered: stores may contain records of other programs.
const FormulationRow* FindFormulation(std::string_view name);

/// Returns the mechanism with the solver of that name, at the level of the options. Throws
/// std::invalid_argument if the name is unknown or the level is not available. For a peer, returns
/// the system that evaluates its states, without projection.
template <class Space>
std::unique_ptr<System<Space, double>> MakeFormulation(std::string_view name,
                                                       const Mechanism<Space, double>& mechanism,
                                                       const FormulationOptions& options);

}  // namespace loopbench::harness
