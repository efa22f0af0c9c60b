#include "harness/generate/differentiate.h"

namespace loopbench::generate {

namespace {

/// Builds expressions in a graph; 0 and 1 are constants.
class Expressions {
 public:
  explicit Expressions(Graph& graph) : graph_(graph) {}

  int Number(double value) { return graph_.Constant(value); }
  int Add(int a, int b) { return graph_.Make(Operation::kAdd, a, b); }
  int Subtract(int a, int b) { return graph_.Make(Operation::kSubtract, a, b); }
  int Times(int a, int b) { return graph_.Make(Operation::kMultiply, a, b); }
  int Over(int a, int b) { return graph_.Make(Operation::kDivide, a, b); }
  int Negate(int a) { return graph_.Make(Operation::kNegate, a); }
  int Of(Operation function, int a, int b = -1) { return graph_.Make(function, a, b); }
  int Square(int a) { return Times(a, a); }
  bool IsZero(int a) const { return graph_.Is(a, 0.0); }

 private:
  Graph& graph_;
};

/// Derivative of `node` = `of`, whose operands have the derivatives da and db.
int DerivativeOf(Graph& graph, int node, const Node of, int da, int db,
                 const std::vector<double>& values) {
  Expressions e(graph);
  const int a = of.a, b = of.b;
  // 1 - a^2 without cancellation
  const auto one_minus_square = [&] {
    return e.Times(e.Subtract(e.Number(1.0), a), e.Add(e.Number(1.0), a));
  };
  switch (of.operation) {
    case Operation::kNegate:
      return e.Negate(da);
    case Operation::kAbs:
      return e.Times(da, e.Over(a, node));
    case Operation::kAdd:
      return e.Add(da, db);
    case Operation::kSubtract:
      return e.Subtract(da, db);
    case Operation::kMultiply:
      return e.Add(e.Times(da, b), e.Times(a, db));
    case Operation::kDivide:
      return e.Over(e.Subtract(da, e.Times(node, db)), b);
    case Operation::kSqrt:
      return e.Over(da, e.Add(node, node));
    case Operation::kSin:
      return e.Times(da, e.Of(Operation::kCos, a));
    case Operation::kCos:
      return e.Negate(e.Times(da, e.Of(Operation::kSin, a)));
    case Operation::kPoseSin:
      return e.Times(da, e.Of(Operation::kPoseCos, a, node));
    case Operation::kPoseCos:
      return e.Negate(e.Times(da, b));  // b is the sine
    case Operation::kAsin:
      return e.Over(da, e.Of(Operation::kSqrt, one_minus_square()));
    case Operation::kAcos:
      return e.Negate(e.Over(da, e.Of(Operation::kSqrt, one_minus_square())));
    case Operation::kAtan2:
      return e.Over(e.Subtract(e.Times(b, da), e.Times(a, db)), e.Add(e.Square(a), e.Square(b)));
    case Operation::kExp:
      return e.Times(da, node);
    case Operation::kExpm1:
      return e.Times(da, e.Add(node, e.Number(1.0)));
    case Operation::kLog:
      return e.Over(da, a);
    case Operation::kPow: {
      const int power = e.Of(Operation::kPow, a, e.Subtract(b, e.Number(1.0)));
      const int by_base = e.IsZero(da) ? da : e.Times(da, e.Times(b, power));
      const int by_exponent =
          e.IsZero(db) ? db : e.Times(db, e.Times(node, e.Of(Operation::kLog, a)));
      return e.Add(by_base, by_exponent);
    }
    case Operation::kRound:
      return e.Number(0.0);
    case Operation::kRemainder:  // a less a multiple of b, which is constant between its jumps
      return e.Subtract(da, e.Times(db, e.Of(Operation::kRound, e.Over(a, b))));
    case Operation::kMin:
    case Operation::kMax: {
      const bool first_is_less = values[a] < values[b];
      graph.Compare(Relation::kLess, a, b, first_is_less);
      return first_is_less == (of.operation == Operation::kMin) ? da : db;
    }
    case Operation::kInput:
    case Operation::kConstant:
      break;
  }
  return e.Number(0.0);
}

}  // namespace

std::vector<int> Differentiate(Graph& graph, const std::vector<int>& outputs,
                               const std::vector<int>& inputs, const std::vector<double>& values) {
  const std::vector<bool> live = graph.Live(outputs, false);
  const int zero = graph.Constant(0.0), one = graph.Constant(1.0);
  std::vector<int> jacobian;
  std::vector<int> derivative(live.size());
  for (const int input : inputs) {
    for (std::size_t node = 0; node < live.size(); ++node) {
      derivative[node] = zero;
      if (!live[node]) continue;
      const Node of = graph.nodes()[node];
      const int da = of.a >= 0 ? derivative[of.a] : zero;
      // a cosine names its sine beside its angle
      const int db = of.b >= 0 && of.operation != Operation::kPoseCos ? derivative[of.b] : zero;
      if (static_cast<int>(node) == input) {
        derivative[node] = one;
      } else if (da != zero || db != zero) {
        derivative[node] = DerivativeOf(graph, static_cast<int>(node), of, da, db, values);
      }
    }
    for (const int output : outputs) jacobian.push_back(derivative[output]);
  }
  return jacobian;
}

}  // namespace loopbench::generate
