#include "harness/generate/graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <stdexcept>

namespace loopbench::generate {

using enum Operation;

namespace {

std::uint64_t Pair(int a, int b) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(a)) << 32) |
         static_cast<std::uint32_t>(b);
}

double NoValue(double, double) { throw std::logic_error("an input has no operands"); }

std::array<double, 2> PoseSineAndCosine(double angle) {
  std::array<double, 2> both;
  PoseSines(angle, &both[0], &both[1]);
  return both;
}

/// Node y of an operation on a and b, whose derivatives are da and db; builds expressions of them.
struct Rule {
  Graph& graph;
  const int y, a, b, da, db;
  const std::vector<double>& values;

  int Number(double value) const { return graph.Constant(value); }
  int Add(int one, int other) const { return graph.Make(kAdd, one, other); }
  int Subtract(int one, int other) const { return graph.Make(kSubtract, one, other); }
  int Times(int one, int other) const { return graph.Make(kMultiply, one, other); }
  int Over(int one, int other) const { return graph.Make(kDivide, one, other); }
  int Negate(int of) const { return graph.Make(kNegate, of); }
  int Of(Operation function, int of, int other = -1) const {
    return graph.Make(function, of, other);
  }
  /// sqrt(1 - a^2) without cancellation.
  int Cosine() const { return Of(kSqrt, Times(Subtract(Number(1.0), a), Add(Number(1.0), a))); }
  int Power() const {
    const int power = Of(kPow, a, Subtract(b, Number(1.0)));
    const int by_base = graph.Is(da, 0.0) ? da : Times(da, Times(b, power));
    const int by_exponent = graph.Is(db, 0.0) ? db : Times(db, Times(y, Of(kLog, a)));
    return Add(by_base, by_exponent);
  }
  /// The derivative of min(a, b) or max(a, b).
  int Extreme(bool is_least) const {
    const bool first_is_less = values[a] < values[b];
    graph.Compare(Relation::kLess, a, b, first_is_less);
    return first_is_less == is_least ? da : db;
  }
};

/// Returns the derivative of an operation.
int DerivativeOf(Operation operation, const Rule& rule) {
  constexpr int (*kRules[])(const Rule&) = {
      [](const Rule& x) { return x.Number(0.0); },  // an input
      [](const Rule& x) { return x.Number(0.0); },  // a constant
      [](const Rule& x) { return x.Negate(x.da); },
      [](const Rule& x) { return x.Times(x.da, x.Over(x.a, x.y)); },  // |a|
      [](const Rule& x) { return x.Add(x.da, x.db); },
      [](const Rule& x) { return x.Subtract(x.da, x.db); },
      [](const Rule& x) { return x.Add(x.Times(x.da, x.b), x.Times(x.a, x.db)); },
      [](const Rule& x) { return x.Over(x.Subtract(x.da, x.Times(x.y, x.db)), x.b); },
      [](const Rule& x) { return x.Over(x.da, x.Add(x.y, x.y)); },  // square root
      [](const Rule& x) { return x.Times(x.da, x.Of(kCos, x.a)); },
      [](const Rule& x) { return x.Negate(x.Times(x.da, x.Of(kSin, x.a))); },
      [](const Rule& x) { return x.Times(x.da, x.Of(kPoseCos, x.a, x.y)); },
      [](const Rule& x) { return x.Negate(x.Times(x.da, x.b)); },  // kPoseCos: b is the sine
      [](const Rule& x) { return x.Over(x.da, x.Cosine()); },      // asin
      [](const Rule& x) { return x.Negate(x.Over(x.da, x.Cosine())); },
      [](const Rule& x) {  // atan2
        return x.Over(x.Subtract(x.Times(x.b, x.da), x.Times(x.a, x.db)),
                      x.Add(x.Times(x.a, x.a), x.Times(x.b, x.b)));
      },
      [](const Rule& x) { return x.Times(x.da, x.y); },                        // exp
      [](const Rule& x) { return x.Times(x.da, x.Add(x.y, x.Number(1.0))); },  // expm1
      [](const Rule& x) { return x.Over(x.da, x.a); },                         // log
      [](const Rule& x) { return x.Power(); },
      [](const Rule& x) { return x.Number(0.0); },  // round
      // a remainder is a less a multiple of b, which is constant between its jumps
      [](const Rule& x) { return x.Subtract(x.da, x.Times(x.db, x.Of(kRound, x.Over(x.a, x.b)))); },
      [](const Rule& x) { return x.Extreme(true); },
      [](const Rule& x) { return x.Extreme(false); }};
  static_assert(std::size(kRules) == static_cast<std::size_t>(kMax) + 1);
  return kRules[static_cast<std::size_t>(operation)](rule);
}

}  // namespace

const OperationTraits& TraitsOf(Operation operation) {
  using Counted = OperationCounts;
  static constexpr OperationTraits kTraits[] = {
      {nullptr, "", &NoValue},  // an input
      {nullptr, "", &NoValue},  // a constant
      {nullptr, "-", [](double a, double) { return -a; }},
      {nullptr, "fabs", [](double a, double) { return std::abs(a); }},
      {&Counted::additions, "+", [](double a, double b) { return a + b; }},
      {&Counted::additions, "-", [](double a, double b) { return a - b; }},
      {&Counted::multiplications, "*", [](double a, double b) { return a * b; }},
      {&Counted::divisions, "/", [](double a, double b) { return a / b; }},
      {&Counted::roots, "sqrt", [](double a, double) { return std::sqrt(a); }},
      {&Counted::sines, "sin", [](double a, double) { return std::sin(a); }},
      {&Counted::sines, "cos", [](double a, double) { return std::cos(a); }},
      {&Counted::sines, "s", [](double a, double) { return PoseSineAndCosine(a)[0]; }},
      {&Counted::sines, "c", [](double a, double) { return PoseSineAndCosine(a)[1]; }},
      {&Counted::other, "asin", [](double a, double) { return std::asin(a); }},
      {&Counted::other, "acos", [](double a, double) { return std::acos(a); }},
      {&Counted::other, "atan2", [](double a, double b) { return std::atan2(a, b); }},
      {&Counted::other, "exp", [](double a, double) { return std::exp(a); }},
      {&Counted::other, "expm1", [](double a, double) { return std::expm1(a); }},
      {&Counted::other, "log", [](double a, double) { return std::log(a); }},
      {&Counted::other, "pow", [](double a, double b) { return std::pow(a, b); }},
      {&Counted::other, "round", [](double a, double) { return std::round(a); }},
      {&Counted::other, "remainder", [](double a, double b) { return std::remainder(a, b); }},
      {&Counted::other, "least", [](double a, double b) { return std::min(a, b); }},
      {&Counted::other, "most", [](double a, double b) { return std::max(a, b); }}};
  static_assert(std::size(kTraits) == static_cast<std::size_t>(kMax) + 1);
  return kTraits[static_cast<std::size_t>(operation)];
}

void OperationCounts::Add(Operation operation) {
  const auto counted_as = TraitsOf(operation).counted_as;
  if (counted_as != nullptr) ++(this->*counted_as);
}

OperationCounts& OperationCounts::operator+=(const OperationCounts& more) {
  for (const auto count :
       {&OperationCounts::additions, &OperationCounts::multiplications, &OperationCounts::divisions,
        &OperationCounts::roots, &OperationCounts::sines, &OperationCounts::other}) {
    this->*count += more.*count;
  }
  return *this;
}

int Graph::Input() {
  nodes_.push_back({kInput});
  return static_cast<int>(nodes_.size()) - 1;
}

int Graph::Constant(double value) { return FindOrAppend({kConstant, -1, -1, value, true}); }

int Graph::Append(Operation operation, int a, int b) {
  const bool commutes = operation == kAdd || operation == kMultiply;
  if (commutes && a > b) std::swap(a, b);
  const bool is_known = IsKnown(a) && (b < 0 || IsKnown(b));
  const double other = b < 0 ? 0.0 : nodes_[b].value;
  return FindOrAppend({operation, a, b,
                       is_known ? TraitsOf(operation).value(nodes_[a].value, other) : 0.0,
                       is_known});
}

int Graph::FindOrAppend(const Node& node) {
  const auto bits = [](const Node& of) {
    return of.operation == kConstant ? std::bit_cast<std::uint64_t>(of.value) : Pair(of.a, of.b);
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
      if (nodes_[i].operation != kInput) table_[place_of(nodes_[i])] = i;
    }
  }
  int& found = table_[place_of(node)];
  if (found >= 0) return found;
  nodes_.push_back(node);
  return found = static_cast<int>(nodes_.size()) - 1;
}

int Graph::Make(Operation operation, int a, int b) {
  const auto folds = [&](int node) { return IsConstant(node) && Folds(nodes_[node].value); };
  if (folds(a) && (b < 0 || folds(b) || operation == kPoseCos)) {
    return Constant(TraitsOf(operation).value(nodes_[a].value, b < 0 ? 0.0 : nodes_[b].value));
  }
  const auto negated = [&](int node) { return nodes_[node].operation == kNegate; };
  const auto inner = [&](int node) { return nodes_[node].a; };
  switch (operation) {
    case kNegate:
      if (negated(a)) return inner(a);
      break;
    case kAbs:
      if (negated(a)) return Make(operation, inner(a));
      break;
    case kAdd:
      if (Is(a, 0.0)) return b;
      if (Is(b, 0.0)) return a;
      if (negated(a) && negated(b)) return Make(kNegate, Append(operation, inner(a), inner(b)));
      if (negated(b)) return Make(kSubtract, a, inner(b));
      if (negated(a)) return Make(kSubtract, b, inner(a));
      break;
    case kSubtract:
      if (Is(b, 0.0)) return a;
      if (Is(a, 0.0)) return Make(kNegate, b);
      if (negated(a) && negated(b)) return Make(operation, inner(b), inner(a));
      if (negated(b)) return Make(kAdd, a, inner(b));
      if (negated(a)) return Make(kNegate, Make(kAdd, inner(a), b));
      break;
    case kMultiply:
      if (Is(a, 0.0) || Is(b, 0.0)) return Constant(0.0);
      if (Is(a, 1.0)) return b;
      if (Is(b, 1.0)) return a;
      if (Is(a, -1.0)) return Make(kNegate, b);
      if (Is(b, -1.0)) return Make(kNegate, a);
      if (negated(a)) return Make(kNegate, Make(operation, inner(a), b));
      if (negated(b)) return Make(kNegate, Make(operation, a, inner(b)));
      break;
    case kDivide:
      if (Is(a, 0.0)) return a;
      if (Is(b, 1.0)) return a;
      if (Is(b, -1.0)) return Make(kNegate, a);
      if (negated(a)) return Make(kNegate, Make(operation, inner(a), b));
      if (negated(b)) return Make(kNegate, Make(operation, a, inner(b)));
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
        std::max(a >= 0 ? depth[a] : 0, b >= 0 && operation != kPoseCos ? depth[b] : 0);
    const bool is_given = node < given.size() && given[node];
    depth[node] = is_given ? 0 : before + (TraitsOf(operation).counted_as != nullptr ? 1 : 0);
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
    if (operation == kInput) {
      values[node] = inputs[input++];
    } else if (is_known) {
      values[node] = value;
    } else {
      values[node] = TraitsOf(operation).value(values[a], b >= 0 ? values[b] : 0.0);
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
      const int db = of.b >= 0 && of.operation != kPoseCos ? derivative[of.b] : zero;
      if (static_cast<int>(node) == input) {
        derivative[node] = one;
      } else if (da != zero || db != zero) {
        derivative[node] =
            DerivativeOf(of.operation, {graph, static_cast<int>(node), of.a, of.b, da, db, values});
      }
    }
    for (const int output : outputs) jacobian.push_back(derivative[output]);
  }
  return jacobian;
}

}  // namespace loopbench::generate
