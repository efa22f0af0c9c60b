#include "harness/generate/graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

namespace loopbench::generate {

namespace {

std::uint64_t Pair(int a, int b) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(a)) << 32) |
         static_cast<std::uint32_t>(b);
}

}  // namespace

bool Counts(Operation operation) { return operation > Operation::kAbs; }

void OperationCounts::Add(Operation operation) {
  switch (operation) {
    case Operation::kInput:
    case Operation::kConstant:
    case Operation::kNegate:
    case Operation::kAbs:
      return;
    case Operation::kAdd:
    case Operation::kSubtract:
      ++additions;
      return;
    case Operation::kMultiply:
      ++multiplications;
      return;
    case Operation::kDivide:
      ++divisions;
      return;
    case Operation::kSqrt:
      ++roots;
      return;
    case Operation::kSin:
    case Operation::kCos:
    case Operation::kPoseSin:
    case Operation::kPoseCos:
      ++sines;
      return;
    default:
      ++other;
  }
}

OperationCounts& OperationCounts::operator+=(const OperationCounts& more) {
  additions += more.additions;
  multiplications += more.multiplications;
  divisions += more.divisions;
  roots += more.roots;
  sines += more.sines;
  other += more.other;
  return *this;
}

double Value(Operation operation, double a, double b) {
  double sine, cosine;
  switch (operation) {
    case Operation::kNegate:
      return -a;
    case Operation::kAbs:
      return std::abs(a);
    case Operation::kAdd:
      return a + b;
    case Operation::kSubtract:
      return a - b;
    case Operation::kMultiply:
      return a * b;
    case Operation::kDivide:
      return a / b;
    case Operation::kSqrt:
      return std::sqrt(a);
    case Operation::kSin:
      return std::sin(a);
    case Operation::kCos:
      return std::cos(a);
    case Operation::kPoseSin:
      PoseSines(a, &sine, &cosine);
      return sine;
    case Operation::kPoseCos:
      PoseSines(a, &sine, &cosine);
      return cosine;
    case Operation::kAsin:
      return std::asin(a);
    case Operation::kAcos:
      return std::acos(a);
    case Operation::kAtan2:
      return std::atan2(a, b);
    case Operation::kExp:
      return std::exp(a);
    case Operation::kExpm1:
      return std::expm1(a);
    case Operation::kLog:
      return std::log(a);
    case Operation::kPow:
      return std::pow(a, b);
    case Operation::kRound:
      return std::round(a);
    case Operation::kRemainder:
      return std::remainder(a, b);
    case Operation::kMin:
      return std::min(a, b);
    case Operation::kMax:
      return std::max(a, b);
    case Operation::kInput:
    case Operation::kConstant:
      break;
  }
  throw std::logic_error("an input has no operands");
}

int Graph::Input() {
  nodes_.push_back({Operation::kInput});
  return static_cast<int>(nodes_.size()) - 1;
}

int Graph::Constant(double value) {
  return FindOrAppend({Operation::kConstant, -1, -1, value, true});
}

int Graph::Append(Operation operation, int a, int b) {
  const bool commutes = operation == Operation::kAdd || operation == Operation::kMultiply;
  if (commutes && a > b) std::swap(a, b);
  const bool is_known = IsKnown(a) && (b < 0 || IsKnown(b));
  const double other = b < 0 ? 0.0 : nodes_[b].value;
  return FindOrAppend(
      {operation, a, b, is_known ? Value(operation, nodes_[a].value, other) : 0.0, is_known});
}

int Graph::FindOrAppend(const Node& node) {
  const auto bits = [](const Node& of) {
    return of.operation == Operation::kConstant ? std::bit_cast<std::uint64_t>(of.value)
                                                : Pair(of.a, of.b);
  };
  const auto place_of = [&](const Node& of) {
    std::uint64_t hash =
        (bits(of) + static_cast<std::uint64_t>(of.operation)) * 0x9e3779b97f4a7c15u;
    hash = (hash ^ hash >> 32) * 0xd6e8feb86659fd93u;
    std::size_t place = hash >> 32;
    for (;; ++place) {
      const int found = table_[place &= table_.size() - 1];
      if (found < 0) return place;
      const Node& other = nodes_[found];
      if (other.operation == of.operation && bits(other) == bits(of)) return place;
    }
  };
  if (2 * nodes_.size() >= table_.size()) {
    table_.assign(std::max<std::size_t>(1024, 2 * table_.size()), -1);
    for (int i = 0; i < std::ssize(nodes_); ++i) {
      if (nodes_[i].operation != Operation::kInput) table_[place_of(nodes_[i])] = i;
    }
  }
  int& found = table_[place_of(node)];
  if (found >= 0) return found;
  nodes_.push_back(node);
  return found = static_cast<int>(nodes_.size()) - 1;
}

int Graph::Make(Operation operation, int a, int b) {
  const auto folds = [&](int node) { return IsConstant(node) && Folds(nodes_[node].value); };
  if (folds(a) && (b < 0 || folds(b) || operation == Operation::kPoseCos)) {
    return Constant(Value(operation, nodes_[a].value, b < 0 ? 0.0 : nodes_[b].value));
  }
  const auto negated = [&](int node) { return nodes_[node].operation == Operation::kNegate; };
  const auto inner = [&](int node) { return nodes_[node].a; };
  switch (operation) {
    case Operation::kNegate:
      if (negated(a)) return inner(a);
      break;
    case Operation::kAbs:
      if (negated(a)) return Make(operation, inner(a));
      break;
    case Operation::kAdd:
      if (Is(a, 0.0)) return b;
      if (Is(b, 0.0)) return a;
      if (negated(a) && negated(b))
        return Make(Operation::kNegate, Append(operation, inner(a), inner(b)));
      if (negated(b)) return Make(Operation::kSubtract, a, inner(b));
      if (negated(a)) return Make(Operation::kSubtract, b, inner(a));
      break;
    case Operation::kSubtract:
      if (Is(b, 0.0)) return a;
      if (Is(a, 0.0)) return Make(Operation::kNegate, b);
      if (negated(a) && negated(b)) return Make(operation, inner(b), inner(a));
      if (negated(b)) return Make(Operation::kAdd, a, inner(b));
      if (negated(a)) return Make(Operation::kNegate, Make(Operation::kAdd, inner(a), b));
      break;
    case Operation::kMultiply:
      if (Is(a, 0.0) || Is(b, 0.0)) return Constant(0.0);
      if (Is(a, 1.0)) return b;
      if (Is(b, 1.0)) return a;
      if (Is(a, -1.0)) return Make(Operation::kNegate, b);
      if (Is(b, -1.0)) return Make(Operation::kNegate, a);
      if (negated(a)) return Make(Operation::kNegate, Make(operation, inner(a), b));
      if (negated(b)) return Make(Operation::kNegate, Make(operation, a, inner(b)));
      break;
    case Operation::kDivide:
      if (Is(a, 0.0)) return a;
      if (Is(b, 1.0)) return a;
      if (Is(b, -1.0)) return Make(Operation::kNegate, a);
      if (negated(a)) return Make(Operation::kNegate, Make(operation, inner(a), b));
      if (negated(b)) return Make(Operation::kNegate, Make(operation, a, inner(b)));
      break;
    default:
      break;
  }
  return Append(operation, a, b);
}

void Graph::Compare(Relation relation, int a, int b, bool outcome) {
  if (IsKnown(a) && IsKnown(b)) return;
  if (a == b && relation == Relation::kLess) return;  // false of any number
  std::uint8_t& known = compared_[Pair(a, b)][static_cast<std::size_t>(relation)];
  if (known != 0) return;  // recorded before
  known = 1;
  comparisons_.push_back({relation, a, b, outcome});
}

std::vector<bool> Graph::Live(const std::vector<int>& outputs, bool compared) const {
  std::vector<bool> live(nodes_.size());
  for (const int node : outputs) live[node] = true;
  if (compared) {
    for (const Comparison& comparison : comparisons_)
      live[comparison.a] = live[comparison.b] = true;
  }
  for (int node = static_cast<int>(nodes_.size()) - 1; node >= 0; --node) {
    if (!live[node]) continue;
    if (nodes_[node].a >= 0) live[nodes_[node].a] = true;
    if (nodes_[node].b >= 0) live[nodes_[node].b] = true;
  }
  return live;
}

OperationCounts Graph::Count(const std::vector<bool>& live) const {
  OperationCounts counts;
  for (std::size_t node = 0; node < nodes_.size(); ++node) {
    if (live[node]) counts.Add(nodes_[node].operation);
  }
  return counts;
}

int Graph::Depth(const std::vector<bool>& live, const std::vector<bool>& given) const {
  std::vector<int> depth(nodes_.size());
  int deepest = 0;
  for (std::size_t node = 0; node < nodes_.size(); ++node) {
    const auto& [operation, a, b, value, is_known] = nodes_[node];
    // a cosine waits for the angle, not for the paired sine
    const int before =
        std::max(a >= 0 ? depth[a] : 0, b >= 0 && operation != Operation::kPoseCos ? depth[b] : 0);
    const bool is_given = node < given.size() && given[node];
    depth[node] = is_given ? 0 : before + (Counts(operation) ? 1 : 0);
    if (live[node]) deepest = std::max(deepest, depth[node]);
  }
  return deepest;
}

std::string Graph::Structure(const std::vector<int>& outputs) const {
  std::uint64_t first = 1, second = 2;
  const auto add = [&](int a, int b) {
    first = std::rotl(first ^ Pair(a, b), 31) * 0x9e3779b97f4a7c15u;
    second = std::rotl(second ^ Pair(a, b), 27) * 0xc2b2ae3d27d4eb4fu;
  };
  for (const Node& node : nodes_) {
    add(node.a, node.b);
    add(static_cast<int>(node.operation), 0);
  }
  for (const auto& [relation, a, b, outcome] : comparisons_) {
    add(a, b);
    add(static_cast<int>(relation), outcome ? 1 : 0);
  }
  for (const int output : outputs) add(output, -1);
  return fmt::format("{:016x}{:016x}", first, second);
}

std::vector<int> Graph::Given(const std::vector<int>& outputs) const {
  std::vector<bool> used(nodes_.size());
  for (const int node : outputs) used[node] = true;
  for (const Comparison& comparison : comparisons_) used[comparison.a] = used[comparison.b] = true;
  for (const Node& node : nodes_) {
    if (node.is_known) continue;
    if (node.a >= 0) used[node.a] = true;
    if (node.b >= 0) used[node.b] = true;
  }
  std::vector<int> given;
  for (int node = 0; node < std::ssize(nodes_); ++node) {
    if (used[node] && IsKnown(node)) given.push_back(node);
  }
  return given;
}

void Graph::ForgetZeroTests() {
  std::erase_if(comparisons_, [this](const Comparison& comparison) {
    return comparison.relation == Relation::kEqual && !comparison.outcome &&
           (Is(comparison.a, 0.0) || Is(comparison.b, 0.0));
  });
}

std::vector<double> Graph::Values(const std::vector<double>& inputs) const {
  std::vector<double> values(nodes_.size());
  std::size_t input = 0;
  for (std::size_t node = 0; node < nodes_.size(); ++node) {
    const auto& [operation, a, b, value, is_known] = nodes_[node];
    if (operation == Operation::kInput) {
      values[node] = inputs[input++];
    } else if (is_known) {
      values[node] = value;
    } else {
      values[node] = Value(operation, values[a], b >= 0 ? values[b] : 0.0);
    }
  }
  return values;
}

bool Graph::Holds(const std::vector<double>& values) const {
  return std::ranges::all_of(comparisons_, [&](const Comparison& comparison) {
    const double a = values[comparison.a], b = values[comparison.b];
    const bool outcome = comparison.relation == Relation::kLess        ? a < b
                         : comparison.relation == Relation::kLessEqual ? a <= b
                                                                       : a == b;
    return outcome == comparison.outcome;
  });
}

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
      // a cosine names its sine next to its angle
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
