#include "harness/judge/fairness.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "harness/record/select.h"
#include "harness/tables/columns.h"
#include "harness/tables/table_view.h"

namespace loopbench::harness {
namespace {

/// What may differ between two runs, and where records say it.
struct Aspect {
  const char* words;
  const char* key;
  bool is_of_machine = false;  ///< what decides times: of the timing where there is one
  const char* standard = "";   ///< what a record means that does not say it
};

constexpr std::array kAspects = {
    Aspect{"mechanism and start", "scene_id"},
    Aspect{"horizon [s]", "horizon"},
    Aspect{"simplifications", "compiled", false, "none"},
    Aspect{"formulation", "formulation"},
    Aspect{"level", "enforcement"},
    Aspect{"coordinates", "coordinates"},
    Aspect{"solver", "solver"},
    Aspect{"integrator", "integrator"},
    Aspect{"Jacobians", "jacobian", false, "none"},
    Aspect{"tolerance", "rtol", false, "fixed step"},
    Aspect{"step [s]", "step", false, "by tolerance"},
    Aspect{"threads", "threads", false, "1"},
    Aspect{"execution", "execution", false, "library"},
    Aspect{"machine", "machine", true},
    Aspect{"compiler", "compiler", true},
    Aspect{"flags", "flags", true},
    Aspect{"mathematical library", "libm", true},
    Aspect{"commit", "commit", true},
    Aspect{"program", "version", true},
    Aspect{"CPU governor", "governor", true, "unknown"},
    Aspect{"repeats of timings", "repeats", true},
};

std::string ValueOf(const TradeoffRow& row, const Aspect& aspect) {
  const bool of_timing = aspect.is_of_machine && row.timing.Find(aspect.key) != nullptr;
  const std::string text = (of_timing ? row.timing : row.record).Text(aspect.key);
  return text.empty() ? aspect.standard : text;
}

/// What the compared rows of all problems say under one aspect.
struct Finding {
  bool is_equal = true;             ///< within each problem
  std::vector<std::string> values;  ///< in order of first appearance
  std::vector<int> rows;            ///< that have them
};

Finding FindValues(const Tradeoff& tradeoff, const Aspect& aspect) {
  Finding finding;
  for (const TradeoffProblem& problem : tradeoff.problems) {
    std::set<std::string> own;
    for (const TradeoffRow& row : problem.rows) {
      if (!row.reason.empty()) continue;
      const std::string value = ValueOf(row, aspect);
      own.insert(value);
      const auto place = std::ranges::find(finding.values, value);
      const auto index = static_cast<std::size_t>(place - finding.values.begin());
      if (place == finding.values.end()) {
        finding.values.push_back(value);
        finding.rows.push_back(0);
      }
      ++finding.rows[index];
    }
    finding.is_equal = finding.is_equal && own.size() <= 1;
  }
  return finding;
}

/// "integrator (ode45 40, verner 38)"; long lists are cut.
std::string Shares(const Aspect& aspect, const Finding& finding) {
  constexpr std::size_t kMostShown = 8;
  std::string text = fmt::format("{} (", aspect.words);
  for (std::size_t i = 0; i < std::min(finding.values.size(), kMostShown); ++i) {
    text += fmt::format("{}{} {}", i == 0 ? "" : ", ", finding.values[i], finding.rows[i]);
  }
  const std::size_t more = finding.values.size() - std::min(finding.values.size(), kMostShown);
  return text + (more > 0 ? fmt::format(" and {} more)", more) : ")");
}

std::string Joined(const std::vector<std::string>& parts) {
  return fmt::format("{}", fmt::join(parts, "; "));
}

/// Reasons without their numbers and how many rows have them: "singular 3, doubts: energy 2".
std::string CountReasons(const Tradeoff& tradeoff, std::size_t* left_out) {
  std::map<std::string, int> counts;
  for (const TradeoffProblem& problem : tradeoff.problems) {
    for (const TradeoffRow& row : problem.rows) {
      if (row.reason.empty()) continue;
      ++*left_out;
      ++counts[row.reason.substr(0, row.reason.find(" at "))];
    }
  }
  std::vector<std::string> parts;
  for (const auto& [reason, count] : counts) parts.push_back(fmt::format("{} {}", reason, count));
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::vector<Record> Timings(const Tradeoff& tradeoff) {
  std::vector<Record> timings;
  for (const TradeoffProblem& problem : tradeoff.problems) {
    for (const TradeoffRow& row : problem.rows) {
      if (!row.timing.items().empty()) timings.push_back(row.timing);
    }
  }
  return timings;
}

bool IsTime(const std::string& cost) {
  return cost.starts_with("wall_s") || cost.starts_with("rhs_ns") || cost == "cpu_s" ||
         cost == "ns_per_body" || cost == "step_us_median";
}

/// What the error is, what the references are certified to, and where that decides.
std::string ErrorLine(const Tradeoff& tradeoff) {
  double least = INFINITY, most = 0.0;
  int known = 0, bounds = 0, beyond = 0;
  for (const TradeoffProblem& problem : tradeoff.problems) {
    for (const TradeoffRow& row : problem.rows) {
      if (!row.reason.empty()) continue;
      const double certified = row.record.Number("reference_error");
      if (std::isfinite(certified)) {
        ++known;
        least = std::min(least, certified);
        most = std::max(most, certified);
      }
      bounds += row.is_bound ? 1 : 0;
      beyond += row.record.Number("trust_horizon") < row.record.Number("horizon") ? 1 : 0;
    }
  }
  std::string line = fmt::format("error: {}", tradeoff.error);
  if (known > 0 && tradeoff.error.starts_with("error_")) {
    line += fmt::format(", against references certified to {:.1e}", least);
    if (most > least) line += fmt::format(" to {:.1e}", most);
    line += " m";
  }
  if (bounds > 0) {
    line += fmt::format("; {} row{} no larger error than that: the bound stands in their place",
                        bounds, bounds == 1 ? " has" : "s have");
  }
  if (beyond > 0) {
    line += fmt::format("; {} row{} beyond the trust horizon of their problem", beyond,
                        beyond == 1 ? " goes" : "s go");
  }
  return line;
}

std::string CostLine(const Tradeoff& tradeoff) {
  if (tradeoff.cost == "wall_s_median") {
    return "cost: wall_s_median [s], simulations timed alone and unobserved, each case as it is";
  }
  const std::string unit = UnitOf(ColumnOf(tradeoff.cost, {}));
  std::string line =
      fmt::format("cost: {}{}", tradeoff.cost, unit.empty() ? "" : " [" + unit + "]");
  const bool is_count = tradeoff.cost.starts_with("rhs_e") || tradeoff.cost == "steps";
  const auto implicit = [](const TradeoffRow& row) {
    return row.reason.empty() && row.record.Number("newton_iterations") > 0;
  };
  const bool any = std::ranges::any_of(tradeoff.problems, [&](const TradeoffProblem& problem) {
    return std::ranges::any_of(problem.rows, implicit);
  });
  if (is_count && any) {
    line +=
        "; of implicit integrators it leaves out Jacobians and linear solves, so that they look "
        "cheaper than they are";
  }
  return line;
}

/// Whether formulations of compared rows run as the library's code, which is not alike for all.
bool ComparesLibraryCode(const Tradeoff& tradeoff) {
  std::set<std::string> formulations;
  for (const TradeoffProblem& problem : tradeoff.problems) {
    for (const TradeoffRow& row : problem.rows) {
      if (!row.reason.empty() || !row.record.Text("execution").empty()) continue;
      formulations.insert(row.record.Text("formulation"));
    }
  }
  return formulations.size() > 1 && formulations.contains("odca");
}

}  // namespace

std::vector<std::string> FairnessStatement(const Tradeoff& tradeoff) {
  std::vector<std::string> equal, unequal, unknown, lines;
  bool one_machine = true;
  for (const Aspect& aspect : kAspects) {
    const Finding finding = FindValues(tradeoff, aspect);
    if (finding.values.empty()) continue;
    const bool is_single = finding.values.size() == 1;
    if (is_single && finding.values.front().empty()) {
      unknown.push_back(aspect.words);
    } else if (is_single) {
      equal.push_back(fmt::format("{} {}", aspect.words, finding.values.front()));
    } else if (finding.is_equal) {
      equal.push_back(fmt::format("{} (in each problem)", aspect.words));
    } else {
      unequal.push_back(Shares(aspect, finding));
    }
    if (std::string_view(aspect.key) == "machine") one_machine = finding.is_equal;
  }
  lines.push_back(ErrorLine(tradeoff));
  lines.push_back(CostLine(tradeoff));
  if (!equal.empty()) lines.push_back("equal in all compared rows: " + Joined(equal));
  if (!unequal.empty()) lines.push_back("not equal (rows): " + Joined(unequal));
  if (!unknown.empty()) lines.push_back("not recorded: " + Joined(unknown));
  std::size_t all = 0, left_out = 0;
  for (const TradeoffProblem& problem : tradeoff.problems) all += problem.rows.size();
  const std::string reasons = CountReasons(tradeoff, &left_out);
  if (left_out > 0) {
    lines.push_back(fmt::format("{} of {} rows are not compared: {}", left_out, all, reasons));
  }
  if (!IsTime(tradeoff.cost)) return lines;
  if (ComparesLibraryCode(tradeoff)) {
    lines.emplace_back(
        "not equal: the library's code. O-DCA has special code, vector instructions and fused "
        "multiply-add; other formulations have none. Equal code: execution generated; counts: "
        "loopbench count");
  }
  if (!one_machine) {
    lines.push_back("warning: the costs are times of more than one machine, which do not compare");
  }
  for (std::string& line : NoiseWarnings(Timings(tradeoff))) lines.push_back(std::move(line));
  return lines;
}

}  // namespace loopbench::harness
