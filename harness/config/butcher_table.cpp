#include "harness/config/butcher_table.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>

#include "harness/text/words.h"

namespace loopbench::harness {
namespace {

/// Rooted tree t: its order condition is sum_i b_i weights_i = 1 / density.
struct Tree {
  std::string name = "";  ///< "t" is the single vertex, "[t,t]" has two branches
  int order = 1;
  double density = 1.0;
  std::vector<double> weights;     ///< by stage
  std::vector<double> below = {};  ///< A weights: the factor of this tree as a branch
};

/// Calls `visit` for every rooted tree up to `order`, in order of the trees' orders, until it
/// returns false.
void VisitTrees(const ButcherTable& table, int order,
                const std::function<bool(const Tree&)>& visit) {
  const std::size_t stages = table.b.size();
  std::vector<Tree> trees;
  bool go_on = true;
  for (int size = 1; size <= order && go_on; ++size) {
    const std::size_t smaller = trees.size();
    // a multiset of smaller trees, in the order of `trees`, with `left` vertices to come
    const std::function<void(std::size_t, int, Tree)> grow = [&](std::size_t first, int left,
                                                                 Tree tree) {
      if (!go_on) return;
      if (left > 0) {
        for (std::size_t k = first; k < smaller; ++k) {
          const Tree& branch = trees[k];
          if (branch.order > left) break;
          Tree larger = tree;
          larger.name += (larger.name.empty() ? "" : ",") + branch.name;
          larger.density *= branch.density;
          for (std::size_t i = 0; i < stages; ++i) larger.weights[i] *= branch.below[i];
          grow(k, left - branch.order, std::move(larger));
        }
        return;
      }
      tree.name = size == 1 ? "t" : "[" + tree.name + "]";
      tree.order = size;
      tree.density *= size;
      for (const std::vector<double>& row : table.A) {
        double sum = 0.0;
        for (std::size_t j = 0; j < stages; ++j) sum += row[j] * tree.weights[j];
        tree.below.push_back(sum);
      }
      go_on = visit(tree);
      trees.push_back(std::move(tree));
    };
    grow(0, size - 1, {.weights = std::vector<double>(stages, 1.0)});
  }
}

std::optional<TableFault> FaultOfOrder(const ButcherTable& table, const std::vector<double>& b,
                                       int order, const std::string& key) {
  std::optional<TableFault> fault;
  VisitTrees(table, order, [&](const Tree& tree) {
    double sum = 0.0;
    for (std::size_t i = 0; i < b.size(); ++i) sum += b[i] * tree.weights[i];
    if (std::abs(sum * tree.density - 1.0) <= kOrderTolerance) return true;
    fault = {key,
             fmt::format("coefficients of order {}: the condition of tree {} has the sum {:.12g}",
                         tree.order - 1, tree.name, sum),
             fmt::format("order {} as claimed, with the sum {:.12g}", order, 1.0 / tree.density)};
    return false;
  });
  return fault;
}

std::optional<TableFault> FaultOfShape(const ButcherTable& table) {
  const std::size_t stages = table.b.size();
  const auto wrong_size = [&](const char* key, std::size_t size) {
    return TableFault{key, WithCount(size, "number"),
                      fmt::format("{}, the number of stages in \"b\"", stages)};
  };
  if (stages == 0 || stages > kMaxStages) {
    return TableFault{"b", fmt::format("{} stages", stages), fmt::format("1 to {}", kMaxStages)};
  }
  if (table.A.size() != stages) {
    return TableFault{"A", WithCount(table.A.size(), "row"),
                      fmt::format("{}, the number of stages in \"b\"", stages)};
  }
  if (table.c.size() != stages) return wrong_size("c", table.c.size());
  if (!table.b_embedded.empty() && table.b_embedded.size() != stages) {
    return wrong_size("b_embedded", table.b_embedded.size());
  }
  for (std::size_t i = 0; i < stages; ++i) {
    if (table.A[i].size() != stages) {
      return TableFault{
          "A", fmt::format("row {} with {}", i + 1, WithCount(table.A[i].size(), "number")),
          fmt::format("{}, the number of stages", stages)};
    }
    double sum = 0.0;
    for (std::size_t j = 0; j < stages; ++j) {
      sum += table.A[i][j];
      if (j <= i || table.A[i][j] == 0.0) continue;
      return TableFault{"A",
                        fmt::format("{:.12g} in row {}, column {}", table.A[i][j], i + 1, j + 1),
                        "0 above the diagonal: an explicit or diagonally implicit table"};
    }
    if (!(std::abs(sum - table.c[i]) <= kOrderTolerance)) {
      return TableFault{"c", fmt::format("{:.12g} in place {}", table.c[i], i + 1),
                        fmt::format("{:.12g}, the sum of row {} of \"A\"", sum, i + 1)};
    }
  }
  return std::nullopt;
}

}  // namespace

bool ButcherTable::is_implicit() const {
  for (std::size_t i = 0; i < A.size(); ++i) {
    if (A[i][i] != 0.0) return true;
  }
  return false;
}

std::string ToString(const ButcherTable& table) {
  std::string text = fmt::format("{} {} {} b {} c {} e {}", table.name, table.order,
                                 table.embedded_order, fmt::join(table.b, " "),
                                 fmt::join(table.c, " "), fmt::join(table.b_embedded, " "));
  for (const std::vector<double>& row : table.A) text += fmt::format(" A {}", fmt::join(row, " "));
  return text;
}

std::optional<TableFault> FaultOf(const ButcherTable& table) {
  if (auto fault = FaultOfShape(table)) return fault;
  const auto out_of_range = [](const char* key, int order) {
    return TableFault{key, fmt::format("{}", order),
                      fmt::format("an order from 1 to {}", kMaxOrder)};
  };
  if (table.order < 1 || table.order > kMaxOrder) return out_of_range("order", table.order);
  if (auto fault = FaultOfOrder(table, table.b, table.order, "order")) return fault;
  if (table.b_embedded.empty() && table.embedded_order == 0) return std::nullopt;
  if (table.b_embedded.empty())
    return TableFault{"b_embedded", "none", "weights beside \"embedded_order\""};
  if (table.embedded_order < 1 || table.embedded_order > kMaxOrder) {
    return out_of_range("embedded_order", table.embedded_order);
  }
  if (table.b_embedded == table.b) {
    return TableFault{"b_embedded", "the weights of \"b\"",
                      "others: the difference estimates the error"};
  }
  return FaultOfOrder(table, table.b_embedded, table.embedded_order, "embedded_order");
}

}  // namespace loopbench::harness
