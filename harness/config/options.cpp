#include "harness/config/options.h"

#include <array>
#include <cmath>

#include "harness/base/text.h"
#include "mechanism/description/registration.h"

namespace loopbench::harness {
namespace {

// ode45's values; the repeated-failure factor is MATLAB's halving.
constexpr Controller kMatlab{.proportional = false,
                             .uses_method_order = true,
                             .safety = 0.8,
                             .bias = 1,
                             .growth = 5,
                             .first_growth = 5,
                             .reduction = 0.1,
                             .repeated_failure = 0.5,
                             .keep_below = 1};
// The defaults of ERKStep 6.4.1.
constexpr Controller kArkode{.proportional = true,
                             .uses_method_order = false,
                             .safety = 0.99,
                             .bias = 1.2,
                             .growth = 25,
                             .first_growth = 1e4,
                             .reduction = 0.1,
                             .repeated_failure = 0.3,
                             .keep_below = 1.5};

struct NamedProfile {
  const char *name, *table;  ///< ARKODE's name of the Runge-Kutta pair
};
constexpr std::array<NamedProfile, 12> kNamed{{
    {"ode45", "ARKODE_DORMAND_PRINCE_7_4_5"},
    {"dormand-prince", "ARKODE_DORMAND_PRINCE_7_4_5"},
    {"bogacki-shampine", "ARKODE_BOGACKI_SHAMPINE_4_2_3"},
    {"cash-karp", "ARKODE_CASH_KARP_6_4_5"},
    {"fehlberg", "ARKODE_FEHLBERG_6_4_5"},
    {"verner", "ARKODE_VERNER_8_5_6"},
    {"fehlberg-78", "ARKODE_FEHLBERG_13_7_8"},
    {"trbdf2", "ARKODE_TRBDF2_3_3_2"},
    {"kennedy-carpenter-32", "ARKODE_ESDIRK324L2SA_4_2_3"},
    {"kennedy-carpenter-43", "ARKODE_ESDIRK436L2SA_6_3_4"},
    {"kvaerno-54", "ARKODE_KVAERNO_7_4_5"},
    {"kennedy-carpenter-54", "ARKODE_ESDIRK547L2SA_7_4_5"},
}};

Profile MakeProfile(std::string name, ButcherTable table, bool is_own = false) {
  const bool is_ode45 = name == kNamed.front().name;
  const bool ends_at_one =
      std::abs(table.c.back() - 1) <= kOrderTolerance && table.A.back() != table.b;
  const bool is_implicit = table.is_implicit();
  return {std::move(name), std::move(table), is_ode45 ? kMatlab : kArkode, is_ode45, is_own,
          is_implicit,     ends_at_one};
}

std::deque<Profile> BuiltIn() {
  const std::vector<ButcherTable> tables = ArkodeTables();
  std::deque<Profile> profiles;
  for (const auto& [name, table] : kNamed) {
    profiles.push_back(MakeProfile(name, *std::ranges::find(tables, table, &ButcherTable::name)));
  }
  for (const ButcherTable& table : tables) profiles.push_back(MakeProfile(table.name, table));
  return profiles;
}

std::deque<Profile>& Rows() {
  static std::deque<Profile> rows = BuiltIn();
  return rows;
}

/// Rooted tree t: its order condition is sum_i b_i weights_i = 1 / density.
struct Tree {
  std::string name = "";  ///< "t" is the single vertex, "[t,t]" has two branches
  int order = 1;
  double density = 1.0;
  std::vector<double> weights;     ///< by stage
  std::vector<double> below = {};  ///< A weights: the factor of this tree as a branch
};

/// Calls `visit` for every rooted tree up to `order`, smaller ones first, until it returns false.
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

const std::deque<Profile>& Profiles() { return Rows(); }

const Profile* FindProfile(std::string_view name) {
  const auto found = std::ranges::find(Rows(), name, &Profile::name);
  return found == Rows().end() ? nullptr : &*found;
}

std::vector<std::string> ProfileNames() { return Mapped<std::string>(kNamed, &NamedProfile::name); }

std::vector<std::string> IntegratorNames() { return Mapped<std::string>(Rows(), &Profile::name); }

std::optional<TableFault> FaultOfIntegrator(const ButcherTable& table) {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz0123456789_-";
  if (table.name.empty() || table.name.front() == '-' ||
      table.name.find_first_not_of(kLetters) != std::string::npos) {
    return TableFault{"name", fmt::format("\"{}\"", table.name), "a word of a-z, 0-9, '-' and '_'"};
  }
  const Profile* taken = FindProfile(table.name);
  if (taken != nullptr && !(taken->is_own && taken->table == table)) {
    return TableFault{"name", fmt::format("\"{}\", the name of another integrator", table.name),
                      "a name of its own"};
  }
  return FaultOf(table);
}

void RegisterIntegrator(const ButcherTable& table) {
  if (const auto fault = FaultOfIntegrator(table)) {
    RefuseRow("integrator", table.name, fmt::format("in {} {}", fault->key, fault->found),
              fault->expected);
  }
  if (FindProfile(table.name) == nullptr) Rows().push_back(MakeProfile(table.name, table, true));
}

std::string Validate(const IntegratorOptions& options) {
  // Negated comparisons, so that NaN is rejected too.
  const Profile* profile = FindProfile(options.profile);
  if (profile == nullptr) {
    return fmt::format("profile is \"{}\"; accepted: {}, and tables of ARKODE by their names",
                       options.profile, fmt::join(ProfileNames(), ", "));
  }
  if (!profile->has_embedding() && !(options.fixed_step > 0)) {
    return fmt::format("profile is \"{}\", which has no embedding; it needs a fixed_step",
                       options.profile);
  }
  std::string fault;
  const auto require = [&fault](bool is_valid, std::string_view key, const auto& value,
                                std::string_view rule) {
    if (!is_valid && fault.empty()) fault = fmt::format("{} {}; {}", key, value, rule);
  };
  const auto is_tolerance = [](double atol) {
    return atol > 0 && atol <= std::numeric_limits<double>::max();
  };
  constexpr std::string_view kNoNegative = "it must not be negative";
  require(options.rtol > kMinTolerance && options.rtol < 1, "rtol is", options.rtol,
          fmt::format("it must lie between {:.2g} and 1", kMinTolerance));
  require(is_tolerance(options.atol), "atol is", options.atol, "it must be positive and finite");
  for (const double atol : options.atols) {
    require(is_tolerance(atol), "atols contain", atol, "they must be positive and finite");
  }
  require(options.step_limit >= 1, "step_limit is", options.step_limit, "it must be at least 1");
  require(options.time_limit_s > 0, "time_limit_s is", std::to_string(options.time_limit_s),
          "it must be positive");
  require(options.max_step >= 0, "max_step is", std::to_string(options.max_step), kNoNegative);
  require(options.initial_step >= 0, "initial_step is", options.initial_step, kNoNegative);
  require(options.max_newton_iterations >= 0, "max_newton_iterations is",
          options.max_newton_iterations, kNoNegative);
  require(options.newton_coefficient > 0 && options.newton_coefficient <= 1,
          "newton_coefficient is", options.newton_coefficient, "it must lie between 0 and 1");
  require(options.fixed_step >= 0, "fixed_step is", std::to_string(options.fixed_step),
          kNoNegative);
  for (std::size_t i = 0; i < options.stop_times.size(); ++i) {
    const double t = options.stop_times[i];
    require(std::isfinite(t) && (i == 0 || !(t < options.stop_times[i - 1])),
            fmt::format("stop_times[{}] is", i), std::to_string(t),
            "stop times must be finite and in order");
  }
  return fault;
}

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
