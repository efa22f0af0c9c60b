// The graph of recorded operations, and its derivatives.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "mechanism/algebra/lanes.h"

namespace loopbench::generate {

// Sine and cosine of the angle of a planar pose, with the bits that Kinematics gives it.

inline void PoseSines(double angle, double* sine, double* cosine) {
  if (std::abs(angle) <= kLargestAngle) {
    SinCos(angle, *sine, *cosine);
  } else {
    *sine = std::sin(angle);
    *cosine = std::cos(angle);
  }
}

/// Does the same for kLanes angles.
inline void PoseLaneSines(const double* angles, double* sines, double* cosines) {
  const Lanes x = Load<Lanes>(angles);
  Lanes sine, cosine;
  SinCos(x, sine, cosine);
  Store(sine, sines);
  Store(cosine, cosines);
  if (!Any(~(Magnitude(x) <= kLargestAngle))) return;
  for (int lane = 0; lane < kLanes; ++lane) PoseSines(angles[lane], &sines[lane], &cosines[lane]);
}

// The operations of one evaluation as a graph: each node is an operation on earlier nodes.
//
// Simplifications are exact in IEEE arithmetic for finite numbers, except for the sign of zeros:
// constants are folded, x + 0, x * 1 and x / 1 are x, x * 0 is 0, negations move outwards, equal
// operations on equal operands are one node. No division becomes a multiplication and no sum is
// reordered. x - x stays: it tests whether x is finite.
//
// A graph that keeps its numbers folds constants only if they are 0, 1 or -1. Operations on other
// constants remain nodes, whose values are known at the recording. Rounding then decides no
// operation: mechanisms with other masses or lengths have the same graph with other numbers.

enum class Operation : std::uint8_t {
  kInput,
  kConstant,
  kNegate,
  kAbs,
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kSqrt,
  kSin,
  kCos,
  kPoseSin,  ///< sine of a pose's angle, by the library's own function (lanes.h)
  kPoseCos,  ///< its cosine, always the node behind its sine, which is its second operand
  kAsin,
  kAcos,
  kAtan2,
  kExp,
  kExpm1,
  kLog,
  kPow,
  kRound,
  kRemainder,
  kMin,
  kMax,
};

enum class Relation : std::uint8_t { kLess, kLessEqual, kEqual };

struct Node {
  Operation operation;
  int a = -1, b = -1;     ///< operands, earlier nodes; -1: none
  double value = 0.0;     ///< if known
  bool is_known = false;  ///< a constant, or an operation on known nodes
};

/// A comparison of nodes, with its recorded outcome.
struct Comparison {
  Relation relation;
  int a, b;
  bool outcome;

  friend bool operator==(const Comparison&, const Comparison&) = default;
};

/// Exact numbers of operations, without negations and absolute values, which change a sign bit.
struct OperationCounts {
  std::int64_t additions = 0;  ///< and subtractions
  std::int64_t multiplications = 0;
  std::int64_t divisions = 0;
  std::int64_t roots = 0;
  std::int64_t sines = 0;  ///< and cosines
  std::int64_t other = 0;  ///< other functions, roundings, minima and maxima

  void Add(Operation operation);
  /// Weighted sum, weights of F. McMahon, The Livermore Fortran Kernels, 1986: 1 for + - *, 4 for
  /// divisions and square roots, 8 for other functions.
  std::int64_t flops() const {
    return additions + multiplications + 4 * (divisions + roots) + 8 * (sines + other);
  }
  OperationCounts& operator+=(const OperationCounts& more);
  friend bool operator==(const OperationCounts&, const OperationCounts&) = default;
};

class Graph {
 public:
  explicit Graph(bool keeps_numbers = false) : keeps_numbers_(keeps_numbers) {}

  int Input();
  int Constant(double value);
  /// The node of an operation after simplification; `b` is -1 for functions of one operand.
  int Make(Operation operation, int a, int b = -1);
  void Compare(Relation relation, int a, int b, bool outcome);

  /// Returns true if the node's value is constant.
  bool IsConstant(int node) const { return nodes_[node].operation == Operation::kConstant; }
  /// Returns true if an operation on constants with this value among others is folded.
  bool Folds(double value) const { return !keeps_numbers_ || value == 0 || std::abs(value) == 1; }
  bool Is(int node, double value) const { return IsConstant(node) && nodes_[node].value == value; }

  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<Comparison>& comparisons() const { return comparisons_; }

  /// Nodes on which the outputs depend, or with `compared` the outputs and all comparisons.
  std::vector<bool> Live(const std::vector<int>& outputs, bool compared) const;
  OperationCounts Count(const std::vector<bool>& live) const;
  /// Operations on the longest path to one of the nodes, from inputs or `given` nodes on.
  int Depth(const std::vector<bool>& live, const std::vector<bool>& given = {}) const;

  /// Returns a digest of operations, comparisons and `outputs`, without the numbers of constants.
  /// Graphs of equal structure have one text of code (print_c.cpp) and the same Given() nodes.
  std::string Structure(const std::vector<int>& outputs) const;
  /// Known nodes that outputs, comparisons or nodes with unknown values use, ascending.
  std::vector<int> Given(const std::vector<int>& outputs) const;

  /// Forgets tests for exactly zero that found another number. Texts skip work or a division there.
  /// Without the test the result is equal except for rounding, or not finite.
  void ForgetZeroTests();

  /// Numbers of all nodes for these inputs, by the arithmetic of OperationTraits::value.
  std::vector<double> Values(const std::vector<double>& inputs) const;
  /// Returns true if all comparisons of these numbers have their recorded outcomes.
  bool Holds(const std::vector<double>& values) const;

  /// Operations that the recorded text executed, before any simplification.
  OperationCounts as_run;

 private:
  bool IsKnown(int node) const { return nodes_[node].is_known; }
  int Append(Operation operation, int a, int b);
  /// The node equal to this one, appended if there is none. Constants are equal by their bits.
  int FindOrAppend(const Node& node);

  bool keeps_numbers_;
  std::vector<Node> nodes_;
  std::vector<Comparison> comparisons_;
  std::vector<int> table_;  ///< nodes by their hash, at the next free place; -1: free
  std::unordered_map<std::uint64_t, std::array<std::uint8_t, 3>> compared_;  ///< outcome + 1
};

struct OperationTraits {
  std::int64_t OperationCounts::*counted_as;  ///< null: it does not count
  const char* in_c;                           ///< its operator or function in generated code
  /// Its value as the recorded text computes it; without a second operand, b has no effect.
  double (*value)(double a, double b);
};
const OperationTraits& TraitsOf(Operation operation);

// Derivatives of a graph's nodes with respect to its inputs, as further nodes of the graph.
//
// Forward mode: each node's derivative follows from the derivatives of its operands. Zeros fold
// away (graph.h), so a sparse Jacobian costs its nonzero entries only.

/// Nodes of d outputs[i] / d inputs[j] at [j * outputs.size() + i]: column after column.
/// `values` are numbers of all nodes at the point of recording; they decide which operand of a
/// minimum or maximum is differentiated, and these decisions become comparisons of the graph.
/// At |0| the derivative is not defined and becomes NaN.
std::vector<int> Differentiate(Graph& graph, const std::vector<int>& outputs,
                               const std::vector<int>& inputs, const std::vector<double>& values);

}  // namespace loopbench::generate
