// The graph of operations: exact simplifications, shared nodes, comparisons, counts, text, and
// derivatives: rules one by one, and Jacobians of right-hand sides against differences.
#include "harness/generate/graph.h"

#include "harness/generate/recorded.h"
//
#include "harness/config/mechanism_reader.h"
#include "harness/generate/generated.h"
#include "harness/generate/record.h"
#include "harness/run/run.h"
#include "harness/run/timing.h"
#include "mechanism/algebra/lanes.h"
#include "tests/standard.h"

namespace loopbench::generate {
namespace {

/// A graph of this thread's recorded numbers with two inputs.
struct GraphTest : ::testing::Test {
  Graph graph;
  Recording recording{graph, CastsAs::kNumber};
  Recorded x = Recorded::Input(3.0), y = Recorded::Input(-2.0);
  const Recorded zero = 0.0, one = 1.0;

  OperationCounts CountOf(const Recorded& result) {
    return graph.Count(graph.Live({result.node}, false));
  }
};

TEST_F(GraphTest, ConstantsZerosAndOnesLeaveNoOperation) {
  EXPECT_EQ((x + zero).node, x.node);
  EXPECT_EQ((zero + x).node, x.node);
  EXPECT_EQ((x - zero).node, x.node);
  EXPECT_EQ((x * one).node, x.node);
  EXPECT_EQ((x / one).node, x.node);
  EXPECT_EQ((-(-x)).node, x.node);
  EXPECT_EQ((x * zero).node, -1);
  EXPECT_EQ((x * zero).number, 0.0);
  EXPECT_EQ((Recorded(2.0) * Recorded(3.0)).node, -1);
}

TEST_F(GraphTest, EqualOperationsAreOneNode) {
  EXPECT_EQ((x + y).node, (y + x).node);
  EXPECT_EQ((x * y).node, (y * x).node);
  EXPECT_NE((x - y).node, (y - x).node);
  EXPECT_EQ((x + (-y)).node, (x - y).node);
  EXPECT_EQ(((-x) * y).node, (-(x * y)).node);
  EXPECT_EQ((x - (-y)).node, (x + y).node);
}

TEST_F(GraphTest, WhatIsNotExactStays) {
  EXPECT_NE((x - x).node, -1);  // 0 for finite numbers alone
  const Recorded third = x / Recorded(3.0);
  EXPECT_EQ(CountOf(third).divisions, 1);  // not x * (1/3)
  const Recorded left = (x + y) + Recorded(1.0), right = x + (y + Recorded(1.0));
  EXPECT_NE(left.node, right.node);
}

TEST_F(GraphTest, CountsAndDepthAreThoseOfLiveNodes) {
  [[maybe_unused]] const Recorded dead = x * x * x;
  const Recorded result = sqrt(x * x + y * y) / (x + y);
  const OperationCounts counts = CountOf(result);
  EXPECT_EQ(counts.additions, 2);
  EXPECT_EQ(counts.multiplications, 2);
  EXPECT_EQ(counts.roots, 1);
  EXPECT_EQ(counts.divisions, 1);
  EXPECT_EQ(counts.flops(), 2 + 2 + 4 + 4);
  EXPECT_EQ(graph.Depth(graph.Live({result.node}, false)), 4);  // *, +, sqrt, /
  EXPECT_EQ(graph.as_run.multiplications, 4);                   // dead ones too
}

TEST_F(GraphTest, ComparisonsOfNodesAreRecordedOnceWithTheirOutcome) {
  EXPECT_TRUE(y < x);
  EXPECT_TRUE(x > y);
  EXPECT_FALSE(x == y);
  EXPECT_TRUE(Recorded(1.0) < Recorded(2.0));
  const std::vector<Comparison> expected = {{Relation::kLess, y.node, x.node, true},
                                            {Relation::kEqual, x.node, y.node, false}};
  EXPECT_EQ(graph.comparisons(), expected);
  EXPECT_TRUE(isfinite(x));  // (x - x) == (x - x)
  EXPECT_EQ(graph.comparisons().size(), 3u);
}

TEST_F(GraphTest, MinimaAndMagnitudesAreOperationsNotBranches) {
  EXPECT_EQ(min(x, y).number, -2.0);
  EXPECT_EQ(max(x, y).number, 3.0);
  EXPECT_EQ(abs(y).number, 2.0);
  EXPECT_TRUE(graph.comparisons().empty());
}

TEST_F(GraphTest, ACastShowsWhatTheRecordingSays) {
  EXPECT_EQ(static_cast<double>(x), 3.0);
  {
    Graph other;
    const Recording infinite(other, CastsAs::kInfinity);
    EXPECT_EQ(static_cast<double>(Recorded::Input(1.0)), std::numeric_limits<double>::infinity());
    EXPECT_EQ(static_cast<double>(Recorded(1.0)), 1.0);  // a constant decides nothing
  }
}

TEST(PrintCTest, TheTextOfASmallGraphIsThis) {
  RecordedFunction recorded;
  {
    const Recording recording(recorded.graph, CastsAs::kNumber);
    const Recorded t = Recorded::Input(0.0), x = Recorded::Input(1.0);
    const Recorded rate = -(x * Recorded(0.5)) + t;
    EXPECT_TRUE(x > t);
    recorded.outputs = {rate.node, recorded.graph.Constant(0.0)};
  }
  int room = -1;
  EXPECT_EQ(PrintFunction(recorded, "rates", &room),
            R"(static int rates_part0(const double* x, double* y, double* w) {
  int ok = 1;
  (void)x, (void)y, (void)w;
  ok &= (x[0] < x[1]);
  const double v3 = x[1] * 0x1p-1;
  const double v5 = x[0] - v3;
  y[0] = v5;
  y[1] = 0x0p+0;
  return ok;
}
static int rates(const double* x, double* y, double* w) {
  return rates_part0(x, y, w);
}
)");
  EXPECT_EQ(room, 0);
}

/// Every operation, with a number that other mechanisms have otherwise.
RecordedFunction EveryOperation(double number) {
  RecordedFunction recorded;
  recorded.graph = Graph(true);
  const Recording recording(recorded.graph, CastsAs::kNumber);
  const Recorded a = Recorded::Input(0.5), b = Recorded::Input(0.25), c(number);
  Recorded sine, cosine;
  SinesOfPose(a * Recorded(1e3), sine, cosine);
  EXPECT_TRUE(b < a);
  EXPECT_FALSE(a < c * b);
  for (const Recorded& value : {sqrt(a),
                                abs(b),
                                sin(a),
                                cos(a),
                                asin(b),
                                acos(b),
                                atan2(c, a),
                                atan2(a, c),
                                exp(a),
                                expm1(b),
                                log(a),
                                pow(a, c),
                                round(b * Recorded(3.0)),
                                remainder(a, b),
                                min(a, c),
                                max(c, b),
                                sine,
                                cosine,
                                cos(b),
                                -a / b,
                                c - a,
                                c / b,
                                c * Recorded(-0.75)}) {
    recorded.outputs.push_back(value.node);
  }
  return recorded;
}

/// Lanes with two mechanisms, and states whose comparisons come out otherwise in some of them.
TEST(LanesTest, EachLaneHasTheBitsOfItsGraph) {
  const RecordedFunction graphs[] = {EveryOperation(0.375), EveryOperation(0.3125)};
  ASSERT_EQ(graphs[0].graph.Structure(graphs[0].outputs),
            graphs[1].graph.Structure(graphs[1].outputs));
  std::vector<Lanes> constants(ConstantsOf(graphs[0]).size());
  for (int lane = 0; lane < kLanes; ++lane) {
    const std::vector<double> own = ConstantsOf(graphs[lane % 2]);
    for (std::size_t i = 0; i < own.size(); ++i) constants[i][lane] = own[i];
  }
  for (const bool own_sines : {false, true}) {
    const CompiledBranch lanes =
        CompileBranch(own_sines ? "own sines in lanes" : "operations in lanes",
                      [&] { return PrintLanes(graphs[0], kLanes, own_sines); });
    std::mt19937 numbers(1);
    std::uniform_real_distribution<double> unit(0.1, 0.9);
    std::vector<Lanes> x(2), y(graphs[0].outputs.size()), w(static_cast<std::size_t>(lanes.room));
    int others = 0;
    for (int round = 0; round < 20; ++round) {
      for (int lane = 0; lane < kLanes; ++lane)
        x[0][lane] = unit(numbers), x[1][lane] = unit(numbers);
      if (round == 3) x[0][0] = 4e4;  // angles beyond the quick sines
      const int held =
          lanes.function(reinterpret_cast<const double*>(x.data()),
                         reinterpret_cast<const double*>(constants.data()),
                         reinterpret_cast<double*>(y.data()), reinterpret_cast<double*>(w.data()));
      for (int lane = 0; lane < kLanes; ++lane) {
        const Graph& graph = graphs[lane % 2].graph;
        const std::vector<int>& outputs = graphs[lane % 2].outputs;
        const std::vector<double> expected = graph.Values({x[0][lane], x[1][lane]});
        const bool holds = graph.Holds(expected);
        EXPECT_EQ((held >> lane & 1) != 0, holds);
        others += holds ? 0 : 1;
        for (std::size_t i = 0; i < y.size(); ++i) {
          const Operation operation = graph.nodes()[outputs[i]].operation;
          const bool is_sine = operation == Operation::kSin || operation == Operation::kCos;
          // both functions are within 1.1 units in the last place, which is at most eps
          const double allowed = own_sines && is_sine ? 2.2 * kEps : 0.0;
          const double value = expected[outputs[i]];  // some are infinite
          EXPECT_TRUE(y[i][lane] == value || std::abs(y[i][lane] - value) <= allowed) << i;
        }
      }
    }
    EXPECT_GT(others, 0);
  }
}

TEST(PrintCTest, ConstantsThatAreNoFiniteNumbersStayAsTheyAre) {
  RecordedFunction recorded;
  recorded.graph = Graph(true);
  {
    const Recording recording(recorded.graph, CastsAs::kNumber);
    const Recorded x = Recorded::Input(1.0);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(x < Recorded(nan));
    recorded.outputs = {(x * Recorded(nan)).node, (x + Recorded(infinity)).node,
                        (x - Recorded(infinity)).node};
  }
  const std::vector<double> constants = ConstantsOf(recorded);
  const CompiledBranch branch = CompileBranch("no numbers", [&] { return PrintLibrary(recorded); });
  const double x = 2.0, infinity = std::numeric_limits<double>::infinity();
  double y[3], w[16];
  ASSERT_LE(branch.room, 16);
  EXPECT_EQ(branch.function(&x, constants.data(), y, w), 1);
  EXPECT_TRUE(std::isnan(y[0]));
  EXPECT_EQ(y[1], infinity);
  EXPECT_EQ(y[2], -infinity);
}

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
    const double eps = kEps;
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
