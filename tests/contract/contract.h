// The fixture of the contract suites: every combination of formulation, level of enforcement,
// solver, coordinate set and space, on mechanisms that all of them can run.
#pragma once

#include "harness/config/formulations.h"
#include "tests/contract/comparison.h"

namespace loopbench::testing {

struct Case {
  std::string formulation;
  Enforcement enforcement;
  SolverKind solver;
  Coordinates coordinates;
  SpaceKind space;
  std::optional<BaumgarteGains> gains = std::nullopt;
};

/// Keeps addresses out of the test list.
inline void PrintTo(const Case& c, std::ostream* out) { *out << c.formulation; }

inline std::string NameOf(const ::testing::TestParamInfo<Case>& info) {
  std::string name = info.param.formulation + "_" + std::string(ToString(info.param.enforcement)) +
                     "_" + std::string(ToString(info.param.solver)) + "_" +
                     std::string(ToString(info.param.coordinates)) + "_" +
                     std::string(ToString(info.param.space));
  for (char& c : name) c = c == '-' ? '_' : c;
  return name;
}

inline std::vector<Case> AllCases() {
  std::vector<Case> cases;
  for (const harness::FormulationRow& row : harness::Formulations()) {
    if (row.is_peer()) continue;  // somebody else's program: tests/peers
    for (Enforcement enforcement : {Enforcement::kAcceleration, Enforcement::kVelocity,
                                    Enforcement::kPosition, Enforcement::kBaumgarte}) {
      if (!row.Has(enforcement)) continue;
      for (SolverKind solver : {SolverKind::kAsPublished, SolverKind::kRankRevealing}) {
        for (Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
          for (SpaceKind space : {SpaceKind::kPlanar, SpaceKind::kSpatial}) {
            cases.push_back({row.name, enforcement, solver, coordinates, space});
          }
        }
      }
    }
  }
  return cases;
}

/// All cases for which `is_meant` is true.
inline std::vector<Case> CasesThat(const auto& is_meant) {
  std::vector<Case> cases = AllCases();
  std::erase_if(cases, [&](const Case& c) { return !is_meant(c); });
  return cases;
}

/// A formulation on a sample, started.
template <class Space>
struct Bench {
  Bench(const Case& c, const MechanismDescription& description, std::uint64_t seed)
      : sample(description, seed),
        mechanism(sample.mechanism(c.coordinates)),
        state(sample.state(c.coordinates)),
        formulation(harness::MakeFormulation<Space>(c.formulation, mechanism,
                                                    {c.enforcement, c.solver, c.gains})) {
    EXPECT_EQ(formulation->Start(0.0, state.q, state.u), Outcome::kFinished);
    y.resize(formulation->state_size());
    ydot.resize(formulation->state_size());
    formulation->ToState(state.q, state.u, y);
  }
  Outcome Derivative(std::vector<double>& at) {
    return formulation->Derivative(0.0, std::span<const double>(at), std::span<double>(ydot));
  }
  Outcome Examine(std::vector<double>& at) {
    return formulation->Examine(0.0, std::span<const double>(at), std::span<double>(ydot));
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
