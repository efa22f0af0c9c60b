// Derivatives of graphs: rules one by one, and Jacobians of right-hand sides against differences.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>

#include "harness/config/mechanism_reader.h"
#include "harness/generate/graph.h"
#include "harness/generate/record.h"
#include "harness/generate/recorded.h"
#include "harness/run/run.h"
#include "harness/run/timing.h"

namespace loopbench::generate {
namespace {

struct Rule {
  const char* name;
  std::function<Recorded(const Recorded&, const Recorded&)> function;
  std::function<double(double, double)> by_x, by_y;
};

/// Derivatives by hand at (x, y) = (0.4, 1.3). Each is one or two operations, hence 4 eps.
TEST(DifferentiateTest, EachOperationHasTheDerivativeOfTextbooks) {
  const Rule rules[] = {
      {"-", [](auto& x, auto&) { return -x; }, [](double, double) { return -1.0; },
       [](double, double) { return 0.0; }},
      {"abs", [](auto& x, auto& y) { return abs(x - y); }, [](double, double) { return -1.0; },
       [](double, double) { return 1.0; }},
      {"*", [](auto& x, auto& y) { return x * y; }, [](double, double y) { return y; },
       [](double x, double) { return x; }},
      {"/", [](auto& x, auto& y) { return x / y; }, [](double, double y) { return 1 / y; },
       [](double x, double y) { return -x / (y * y); }},
      {"sqrt", [](auto& x, auto&) { return sqrt(x); },
       [](double x, double) { return 0.5 / std::sqrt(x); }, [](double, double) { return 0.0; }},
      {"sin", [](auto& x, auto& y) { return sin(x) * y; },
       [](double x, double y) { return std::cos(x) * y; },
       [](double x, double) { return std::sin(x); }},
      {"cos", [](auto& x, auto&) { return cos(x); }, [](double x, double) { return -std::sin(x); },
       [](double, double) { return 0.0; }},
      {"asin", [](auto& x, auto&) { return asin(x); },
       [](double x, double) { return 1 / std::sqrt(1 - x * x); },
       [](double, double) { return 0.0; }},
      {"acos", [](auto& x, auto&) { return acos(x); },
       [](double x, double) { return -1 / std::sqrt(1 - x * x); },
       [](double, double) { return 0.0; }},
      {"atan2", [](auto& x, auto& y) { return atan2(x, y); },
       [](double x, double y) { return y / (x * x + y * y); },
       [](double x, double y) { return -x / (x * x + y * y); }},
      {"exp", [](auto& x, auto&) { return exp(x); }, [](double x, double) { return std::exp(x); },
       [](double, double) { return 0.0; }},
      {"expm1", [](auto& x, auto&) { return expm1(x); },
       [](double x, double) { return std::exp(x); }, [](double, double) { return 0.0; }},
      {"log", [](auto& x, auto&) { return log(x); }, [](double x, double) { return 1 / x; },
       [](double, double) { return 0.0; }},
      {"pow", [](auto& x, auto& y) { return pow(x, y); },
       [](double x, double y) { return y * std::pow(x, y - 1); },
       [](double x, double y) { return std::pow(x, y) * std::log(x); }},
      {"round", [](auto& x, auto&) { return round(x) + x; }, [](double, double) { return 1.0; },
       [](double, double) { return 0.0; }},
      {"remainder", [](auto& x, auto& y) { return remainder(y, x); },
       [](double, double) { return -3.0; }, [](double, double) { return 1.0; }},
      {"min", [](auto& x, auto& y) { return min(x, y); }, [](double, double) { return 1.0; },
       [](double, double) { return 0.0; }},
      {"max", [](auto& x, auto& y) { return max(x, y); }, [](double, double) { return 0.0; },
       [](double, double) { return 1.0; }}};
  for (const auto& [name, function, by_x, by_y] : rules) {
    Graph graph;
    std::vector<int> jacobian;
    {
      const Recording recording(graph, CastsAs::kNumber);
      const Recorded x = Recorded::Input(0.4), y = Recorded::Input(1.3);
      const Recorded result = function(x, y);
      jacobian = Differentiate(graph, {result.node}, {x.node, y.node}, graph.Values({0.4, 1.3}));
    }
    const std::vector<double> values = graph.Values({0.4, 1.3});
    EXPECT_TRUE(graph.Holds(values)) << name;
    const double eps = std::numeric_limits<double>::epsilon();
    const double expected[] = {by_x(0.4, 1.3), by_y(0.4, 1.3)};
    for (const std::size_t i : {0, 1}) {
      EXPECT_NEAR(values[static_cast<std::size_t>(jacobian[i])], expected[i],
                  4 * eps * (1.0 + std::abs(expected[i])))
          << name << " by "
          << "xy"[i];
    }
  }
}

/// Central differences with step h have errors of h^2 and eps / h: 1e-10 each for h = 1e-5, times
/// the size of the third derivatives and of the values.
TEST(DifferentiateTest, JacobiansOfShippedMechanismsAreThoseOfDifferences) {
  constexpr double kStep = 1e-5, kTolerance = 1e-6;
  const std::filesystem::path folder =
      std::filesystem::path(LOOPBENCH_SOURCE_DIR) / "configs/mechanisms";
  for (const char* name : {"four-bar", "slider-crank", "andrews-squeezer", "bennett",
                           "spatial-four-bar", "double-wishbone", "elastic-crank"}) {
    const auto file = harness::ReadMechanism(folder / (std::string(name) + ".json"));
    const auto problem = harness::SimplifyProblem(file.description, file.observe, {});
    const MechanismDescription& description = problem.compiled.parts.front().description;
    const auto state = harness::ComputeState(description, Coordinates::kJoint);
    for (const char* formulation : {"odca", "lagrange", "reduction"}) {
      SCOPED_TRACE(std::string(name) + " " + formulation);
      RecordedFunction recorded = RecordFunction(
          {.description = description, .formulation = formulation}, {.q = state.q, .u = state.u});
      const std::size_t n = recorded.outputs.size();
      // where it was recorded: next to the state, in the order of the inputs
      std::vector<double> x = {0.0};
      x.insert(x.end(), state.q.begin(), state.q.end());
      for (const int i : recorded.carried_speeds) x.push_back(state.u[i]);
      const std::vector<int> outputs = recorded.outputs;
      const std::vector<int> jacobian = Differentiate(
          recorded.graph, outputs, {recorded.inputs.begin() + 1, recorded.inputs.end()},
          recorded.graph.Values(x));
      const std::vector<double> exact = recorded.graph.Values(x);
      double scale = 0.0;
      for (const int node : jacobian) scale = std::max(scale, std::abs(exact[node]));
      EXPECT_GT(scale, 0.0);
      for (std::size_t j = 0; j < n; ++j) {
        std::vector<double> above = x, below = x;
        above[j + 1] += kStep;
        below[j + 1] -= kStep;
        const auto high = recorded.graph.Values(above), low = recorded.graph.Values(below);
        for (std::size_t i = 0; i < n; ++i) {
          const double difference = (high[outputs[i]] - low[outputs[i]]) / (2 * kStep);
          EXPECT_NEAR(exact[jacobian[j * n + i]], difference, kTolerance * scale)
              << i << " by " << j;
        }
      }
    }
  }
}

}  // namespace
}  // namespace loopbench::generate
