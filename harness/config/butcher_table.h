// Butcher tables of Runge-Kutta methods, and the check of their order.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace loopbench::harness {

/// Coefficients of an explicit or diagonally implicit Runge-Kutta method:
///   Y_i = y + h sum_j A_ij f(t + c_j h, Y_j),  y_new = y + h sum_i b_i f(t + c_i h, Y_i).
/// The embedded solution has the weights b_embedded; their difference estimates the error.
struct ButcherTable {
  std::string name;
  std::vector<std::vector<double>> A = {};
  std::vector<double> b, c;
  std::vector<double> b_embedded = {};  ///< empty: no error estimate, so fixed steps only
  int order = 0, embedded_order = 0;    ///< as claimed; 0: no embedding

  int stages() const { return static_cast<int>(b.size()); }
  bool is_implicit() const;  ///< a coefficient on the diagonal is not zero

  friend bool operator==(const ButcherTable&, const ButcherTable&) = default;
};

inline constexpr int kMaxOrder = 10;   ///< 1205 conditions
inline constexpr int kMaxStages = 64;  ///< more than any published method

/// Largest relative error of an order condition and absolute error of a row sum. Coefficients
/// published with twelve digits satisfy it; an error in one of the first eight digits does not.
inline constexpr double kOrderTolerance = 1e-9;

/// Violated property of a table.
struct TableFault {
  std::string key;  ///< of the file: "A", "b", "c", "b_embedded", "order" or "embedded_order"
  std::string found, expected;
};

/// Returns the first violated property, or nothing: sizes, finite coefficients, no coefficient
/// above the diagonal, c the row sums of A, and all order conditions up to the orders claimed
/// (rooted trees: E. Hairer, S. Norsett, G. Wanner, Solving Ordinary Differential Equations I,
/// section II.2).
std::optional<TableFault> FaultOf(const ButcherTable& table);

/// Returns all data of the table, for the identity of cases.
std::string ToString(const ButcherTable& table);

/// Returns the tables of the installed ARKODE, explicit ones first, by ARKODE's names.
std::vector<ButcherTable> ArkodeTables();

}  // namespace loopbench::harness
