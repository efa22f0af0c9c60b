// The formulations by name: what experiments may ask for, and what readers, commands, tables and
// figures know about each.
//
// Those that come with Loopbench are rows of formulations.cpp. A program of somebody else registers
// its own before it calls loopbench::Main() (harness/cli/program.h; examples/own-formulation/):
//
//   harness::RegisterFormulation(harness::Row<NullSpace>("null-space", "a basis of ..."));
//
// and from then on the name is valid wherever "odca" is. Only runs in several scalars
// (harness/precision/) know the built-in ones alone: a row makes solvers in double.
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

/// All that the harness knows of a formulation.
struct FormulationRow {
  /// A word in files, tables and names: a-z, 0-9, '-' and '_'; of peers "peer/" and a word.
  std::string name;
  std::string sentence;  ///< what `explain` says of it, after "name: "
  SolverFactory<Planar> planar;
  SolverFactory<Spatial> spatial;
  std::vector<Enforcement> levels = {};  ///< those it has; empty: all there are
  /// Of its curves in figures, "#RRGGBB". Without one the row is given the next free one.
  std::string color = {};
  /// Of a peer (harness/run/peers.h), somebody else's program, the name of its own integrator,
  /// which tables show in the place of the experiment's; empty for formulations. The factories are
  /// then those of the solver that the peer's states are looked at through.
  std::string integrator = {};

  /// Of a peer whose closures give way: where its runs end says nothing about others.
  bool is_soft = false;

  bool is_peer() const { return !integrator.empty(); }
  bool Has(Enforcement level) const;
};

/// The row of a class template such as odca::Odca, made from a mechanism and options.
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

/// Adds a row; not while experiments run. Throws std::invalid_argument for one that is not sound
/// (mechanism/description/registration.h), or a colour that is none.
void RegisterFormulation(FormulationRow row, int alignment = EIGEN_MAX_STATIC_ALIGN_BYTES);

/// All rows: the built-in ones, then the others in the order of their registration. Rows stay where
/// they are.
const std::deque<FormulationRow>& Formulations();
std::vector<std::string> FormulationNames();
/// Without those of other engines, which have right-hand sides of their own.
std::vector<std::string> FormulationNamesWithoutPeers();
/// Null for a name that is not registered: stores may hold records of other programs.
const FormulationRow* FindFormulation(std::string_view name);

/// The mechanism with the solver of that name, at the level of the options. Throws
/// std::invalid_argument where there is no such name, or where it does not have the level. Of a
/// peer's row: what its states are looked at through, which projects nothing.
template <class Space>
std::unique_ptr<System<Space, double>> MakeFormulation(std::string_view name,
                                                       const Mechanism<Space, double>& mechanism,
                                                       const FormulationOptions& options);

}  // namespace loopbench::harness
