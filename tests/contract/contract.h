// The fixture of the contract suites: every combination of formulation, level of enforcement,
// solver, coordinate set and space, on mechanisms that all of them can run.
#pragma once

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lagrange/lagrange.h"
#include "mechanism/formulation/system.h"
#include "odca/odca.h"
#include "reduction/reduction.h"
#include "tests/contract/comparison.h"

namespace loopbench::testing {

constexpr double kEps = std::numeric_limits<double>::epsilon();

struct Case {
  const char* formulation;
  Enforcement enforcement;
  SolverKind solver;
  Coordinates coordinates;
  SpaceKind space;
  std::optional<BaumgarteGains> gains = std::nullopt;
};

/// Keeps addresses out of the test list.
inline void PrintTo(const Case& c, std::ostream* out) { *out << c.formulation; }

inline std::string NameOf(const ::testing::TestParamInfo<Case>& info) {
  std::string name =
      std::string(info.param.formulation) + "_" + std::string(ToString(info.param.enforcement)) +
      "_" + std::string(ToString(info.param.solver)) + "_" +
      std::string(ToString(info.param.coordinates)) + "_" + std::string(ToString(info.param.space));
  for (char& c : name) c = c == '-' ? '_' : c;
  return name;
}

inline std::vector<Case> AllCases() {
  std::vector<Case> cases;
  for (const char* formulation : {"odca", "lagrange", "reduction"}) {
    for (Enforcement enforcement : {Enforcement::kAcceleration, Enforcement::kVelocity,
                                    Enforcement::kPosition, Enforcement::kBaumgarte}) {
      for (SolverKind solver : {SolverKind::kAsPublished, SolverKind::kRankRevealing}) {
        for (Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
          for (SpaceKind space : {SpaceKind::kPlanar, SpaceKind::kSpatial}) {
            cases.push_back({formulation, enforcement, solver, coordinates, space});
          }
        }
      }
    }
  }
  return cases;
}

template <class Space>
std::unique_ptr<System<Space, double>> Make(const Case& c,
                                            const Mechanism<Space, double>& mechanism) {
  const FormulationOptions options{c.enforcement, c.solver, c.gains};
  const std::string name = c.formulation;
  if (name == "odca") return MakeSystem<odca::Odca>(mechanism, options);
  if (name == "lagrange") return MakeSystem<lagrange::Lagrange>(mechanism, options);
  return MakeSystem<reduction::Reduction>(mechanism, options);
}

/// Coupled loops with forces of every kind, every second with joints of every kind, every fourth
/// with prescribed motions; independent closures, so that every column can run.
inline MechanismDescription CoupledLoops(SpaceKind space, std::uint64_t seed) {
  const int loops = space == SpaceKind::kPlanar ? 2 : 1;
  return seed % 2 == 0 ? MixedGraph(loops, space, seed, seed % 4 == 2 ? 2 : 0)
                       : RandomGraph(loops, space, seed);
}

/// A formulation on a sample, started.
template <class Space>
struct Bench {
  Bench(const Case& c, const MechanismDescription& description, std::uint64_t seed)
      : sample(description, seed),
        mechanism(sample.mechanism(c.coordinates)),
        state(sample.state(c.coordinates)),
        formulation(Make(c, mechanism)) {
    EXPECT_EQ(formulation->Start(0.0, state.q, state.u), Outcome::kFinished);
    y.resize(formulation->state_size());
    ydot.resize(formulation->state_size());
    formulation->ToState(state.q, state.u, y);
  }
  Outcome Derivative(std::vector<double>& at) {
    return formulation->Derivative(0.0, std::span<const double>(at), std::span<double>(ydot));
  }
  /// 100 eps N / rcond with the size N of the dense system: elimination of N unknowns.
  double Bound() const {
    return 100 * kEps * (mechanism.num_u() + mechanism.num_rows()) / sample.answer().rcond;
  }

  Sample<Space> sample;
  const Mechanism<Space, double>& mechanism;
  State state;
  std::unique_ptr<System<Space, double>> formulation;
  std::vector<double> y, ydot;
};

class ContractTest : public ::testing::TestWithParam<Case> {
 protected:
  /// Calls `check` with a bench of the parameter's space.
  template <class Check>
  void Run(const MechanismDescription& description, std::uint64_t seed, Check check) {
    if (GetParam().space == SpaceKind::kPlanar) {
      check(Bench<Planar>(GetParam(), description, seed));
    } else {
      check(Bench<Spatial>(GetParam(), description, seed));
    }
  }
  MechanismDescription Description(std::uint64_t seed) const {
    return CoupledLoops(GetParam().space, seed);
  }
};

}  // namespace loopbench::testing
