// The size of each module and of all production code, held to budgets.
//
// A module of less than 95 % of its budget gets a lower budget. A larger budget needs a reason in
// the commit that sets it.
#include "tests/harness/include_arrows.h"
#include "tests/harness/places.h"

namespace loopbench::architecture::budgets_test {

namespace fs = std::filesystem;
using harness::kRoot;

struct Size {
  int lines = 0, files = 0;
  int arrows = 0;  ///< other modules that files of this one include
};

struct Budget {
  std::string_view module;  ///< its folder; "": all of them
  Size allowed;
  int goal;  ///< lines that the features of the module need; all modules: 380 files, 65 arrows
};

// clang-format off
constexpr Budget kBudgets[] = {
    // module                   lines, files, arrows   goal [lines]
    {"mechanism/algebra",       { 2323,  25,   0},  1900},
    {"mechanism/description",   { 2102,  21,   1},  1750},
    {"mechanism/model",         { 2947,  10,   2},  2300},
    {"mechanism/loops",         { 3701,  21,   2},  1900},
    {"mechanism/start",         { 1984,  12,   4},   700},
    {"mechanism/formulation",   { 2608,  17,   4},  1500},
    {"mechanism/simplify",      { 3345,  15,   5},  2600},
    {"odca",                    { 6689,  21,   5},  3900},
    {"lagrange",                {  374,   3,   3},   350},
    {"reduction",               { 1546,  10,   3},  1350},
    {"harness/base",            { 6410,  25,   1},  4700},
    {"harness/config",          { 5831,  24,   9},  4000},
    {"harness/judge",           { 7121,  17,   8},  5400},
    {"harness/generate",        { 2238,   9,   7},  1230},
    {"harness/integrator",      { 1172,   4,   5},   900},
    {"harness/observers",       { 4377,  15,   9},  3550},
    {"harness/run",             { 3588,  16,  11},  3540},
    {"harness/precision",       { 1405,  10,  10},  1400},
    {"harness/suite",           { 3185,   9,  11},  2570},
    {"harness/figures",         { 5931,  14,  10},  5050},
    {"harness/exchange",        { 8335,  29,   8},  5000},
    {"harness/history",         { 1916,   6,   3},  1500},
    {"harness/cli",             { 7291,  24,  17},  3600},
    {"peers",                   {  664,   6,   4},   650},
    {"",                        {87083, 363, 142}, 62000}
};
// clang-format on

/// "" where `found` keeps the budget.
std::string Overrun(const Budget& budget, const Size& found) {
  std::string over;
  const auto compare = [&over](const char* what, int is, int allowed) {
    if (is > allowed) over += fmt::format(", {} {} (allowed {})", is, what, allowed);
  };
  compare("lines", found.lines, budget.allowed.lines);
  compare("files", found.files, budget.allowed.files);
  compare("include arrows", found.arrows, budget.allowed.arrows);
  if (over.empty()) return "";
  return fmt::format("{}: found{}; the goal is {} lines",
                     budget.module.empty() ? "all modules" : budget.module, over.substr(1),
                     budget.goal);
}

/// The module of a file named from the root, "" outside all.
std::string ModuleOf(std::string_view path) {
  for (const Budget& budget : kBudgets) {
    const std::string_view name = budget.module;
    if (!name.empty() && path.starts_with(name) && path.substr(name.size()).starts_with('/')) {
      return std::string(name);
    }
  }
  return "";
}

/// By module; under "" the sum.
std::map<std::string, Size> Sizes() {
  std::map<std::string, Size> sizes;
  std::map<std::string, std::set<std::string>> included;
  for (const char* top : {"mechanism", "odca", "lagrange", "reduction", "harness", "peers"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kRoot / top)) {
      const std::string ending = entry.path().extension().string();
      if (ending != ".h" && ending != ".cpp" && ending != ".inc") continue;
      const std::string text = harness::ReadFile(entry.path());
      const std::string path = entry.path().lexically_relative(kRoot).generic_string();
      const std::string module = ModuleOf(path);
      EXPECT_NE(module, "") << path << ": no module of kBudgets";
      for (const std::string& name : {module, std::string()}) {
        sizes[name].lines += static_cast<int>(std::ranges::count(text, '\n'));
        ++sizes[name].files;
      }
      for (const std::string& header : Includes(text)) {
        const std::string other = ModuleOf(header.substr(1));
        if (other != module && !other.empty()) included[module].insert(other);
      }
    }
  }
  for (const auto& [module, others] : included) {
    sizes[module].arrows = static_cast<int>(others.size());
    sizes[""].arrows += sizes[module].arrows;
  }
  return sizes;
}

TEST(Budgets, OfModulesAreKept) {
  std::map<std::string, Size> sizes = Sizes();
  for (const Budget& budget : kBudgets) {
    const Size found = sizes[std::string(budget.module)];
    EXPECT_GT(found.files, 0) << budget.module;
    EXPECT_EQ(Overrun(budget, found), "");
    // what is far below its budget has a lower one
    EXPECT_GT(100 * found.lines, 95 * budget.allowed.lines)
        << budget.module << ": " << found.lines << " lines, lower its budget";
  }
}

TEST(Budgets, NameWhatIsOver) {
  const Budget budget = {"harness/base", {.lines = 100, .files = 5, .arrows = 2}, 80};
  EXPECT_EQ(Overrun(budget, {100, 5, 2}), "");
  EXPECT_EQ(Overrun(budget, {101, 5, 2}),
            "harness/base: found 101 lines (allowed 100); the goal is 80 lines");
  EXPECT_EQ(Overrun(budget, {7, 6, 3}),
            "harness/base: found 6 files (allowed 5), 3 include arrows (allowed 2); the goal is 80 "
            "lines");
}

}  // namespace loopbench::architecture::budgets_test
