// count: exact operation counts of right-hand sides.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "harness/cli/command_line.h"
#include "harness/cli/commands.h"
#include "harness/config/benchmarks.h"
#include "harness/config/formulations.h"
#include "harness/config/mechanism_reader.h"
#include "harness/generate/record.h"
#include "harness/isolation/processes.h"
#include "harness/record/record.h"
#include "harness/run/case_identity.h"
#include "harness/run/run_case.h"
#include "harness/tables/fit.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"
#include "harness/timing/subject.h"

namespace loopbench::harness {
namespace {

struct CountCommand {
  std::vector<std::filesystem::path> mechanisms;
  std::string family;  ///< family of mechanisms of any size (benchmarks.h), in addition to files
  std::vector<int> sizes;  ///< sizes of the family
  /// Names to count; empty: every formulation, every recorded level, both coordinate sets.
  std::vector<std::string> formulations, levels, coordinates;
  std::vector<std::string> solvers = {"rank-revealing"};
  std::string format = "text";  ///< text, csv, markdown, json or latex
  std::filesystem::path out;    ///< standard output if empty
  ProcessLimits limits = kFileLimits;
};

// baumgarte gains: other values give the same counts, only zero gains would omit the feedback
constexpr BaumgarteGains kGains = {.alpha = 5.0, .beta = 5.0};

template <class Enum>
std::vector<Enum> ParseAll(const std::vector<std::string>& names, std::vector<Enum> all) {
  if (names.empty()) return all;
  all.clear();
  for (const std::string& name : names) all.push_back(*Parse<Enum>(name));
  return all;
}

/// Sets the counts of one right-hand side. They are exact unless a change at round-off level, as by
/// another library or processor, leads to other branches.
void SetCounts(const generate::RecordingSubject& subject, const generate::RecordingStart& start,
               Record& row) {
  constexpr double kRounding = 1e-12;
  generate::RecordingStart rounded = start;
  rounded.q.array() += kRounding;
  rounded.u.array() -= kRounding;
  const auto counts = generate::CountsOf(generate::RecordFunction(subject, start));
  const auto other = generate::CountsOf(generate::RecordFunction(subject, rounded));
  SetOperations(counts, row);
  row.Set("kinematics", counts.kinematics.flops());
  row.Set("forces", counts.forces.flops());
  row.Set("solve", counts.solve.flops());
  row.Set("solve_depth", std::int64_t{counts.solve_depth});
  row.Set("comparisons", counts.comparisons);
  row.Set("flops_compared", counts.compared.flops());
  row.Set("flops_as_run", counts.as_run.flops());
  if (subject.options.enforcement == Enforcement::kPosition) {
    generate::RecordingSubject newton = subject;
    newton.quantity = generate::Quantity::kCorrection;
    row.Set("correction",
            generate::CountsOf(generate::RecordFunction(newton, start)).result.flops());
  }
  row.Set("exact", std::string(counts == other ? "yes" : "no"));
}

/// Counts one part of a mechanism in one coordinate set: a row per formulation, level and solver.
void CountPart(const CountCommand& command, const MechanismDescription& part, Coordinates set,
               std::size_t most_nodes, std::vector<Record>& rows) {
  const BenchmarkState state = ComputeState(part, set);
  const std::vector<std::string> formulations =
      command.formulations.empty() ? FormulationNamesWithoutPeers() : command.formulations;
  for (const std::string& formulation : formulations) {
    for (const Enforcement level : ParseAll<Enforcement>(
             command.levels,
             {Enforcement::kAcceleration, Enforcement::kVelocity, Enforcement::kBaumgarte})) {
      for (const SolverKind solver : ParseAll<SolverKind>(command.solvers, {})) {
        Record& row = rows.emplace_back();
        row.Set("mechanism", part.name);
        row.Set("formulation", formulation);
        row.Set("enforcement", std::string(ToString(level)));
        row.Set("coordinates", std::string(ToString(set)));
        row.Set("solver", std::string(ToString(solver)));
        row.Set("bodies", static_cast<std::int64_t>(part.bodies.size() - 1));
        try {
          if (state.outcome != Outcome::kFinished) {
            throw generate::NotCovered(std::string(ToString(state.outcome)) + ": " + state.message);
          }
          SetCounts({.description = part,
                     .coordinates = set,
                     .formulation = formulation,
                     .options = {.enforcement = level, .solver = solver, .gains = kGains},
                     .most_nodes = most_nodes},
                    {.q = state.q, .u = state.u}, row);
        } catch (const std::exception& why) {
          row.Set("not_recorded", std::string(why.what()));
        }
      }
    }
  }
}

/// Runs in a child process and writes rows as lines of JSON.
int CountHere(const CountCommand& command, const MechanismDescription& description,
              const ObservedQuantities& observe, std::size_t most_nodes) {
  const SimplifiedProblem problem = SimplifyProblem(description, observe, {});
  std::vector<Record> rows;
  for (const auto& part : problem.compiled.parts) {
    for (const Coordinates set : ParseAll<Coordinates>(
             command.coordinates, {Coordinates::kJoint, Coordinates::kAbsolute})) {
      CountPart(command, part.description, set, most_nodes, rows);
    }
  }
  for (const Record& row : rows) PrintText(ToJsonObject(row) + "\n");
  return 0;
}

/// Returns rows counted in a child process; nothing if it fails, with its exit code in `code`.
std::vector<Record> RowsOf(const std::string& name, const ProcessLimits& limits,
                           const std::function<int()>& count, int* code) {
  std::string text;
  *code = TextFromChild(name, limits, count, &text);
  std::vector<Record> rows;
  std::istringstream lines(text);
  for (std::string line; *code == 0 && std::getline(lines, line);) {
    rows.push_back(FromJsonLine(line));
  }
  return rows;
}

void RequireSizes(const SizedFamily& family, const std::vector<int>& sizes) {
  if (sizes.empty()) {
    throw ConfigError(fmt::format("--family {}: found no --sizes, expected numbers from {} to {}",
                                  family.name, family.smallest, family.largest));
  }
  for (const int size : sizes) {
    if (size >= family.smallest && size <= family.largest) continue;
    throw ConfigError(fmt::format("--sizes: found {}, expected {} to {} of family {} ({})", size,
                                  family.smallest, family.largest, family.name, family.of_what));
  }
}

bool HasCounts(const Record& row) { return row.Find("flops") != nullptr; }

std::string MethodOf(const Record& row) {
  return row.Text("formulation") + ", " + row.Text("coordinates");
}

/// Sets flops / bodies and, except in the first row of a method, d log(flops) / d log(bodies) from
/// the previous row.
void AddGrowth(std::span<Record> rows) {
  std::map<std::string, const Record*> last;
  for (Record& row : rows) {
    if (!HasCounts(row)) continue;
    const Record*& before = last[MethodOf(row) + row.Text("enforcement") + row.Text("solver")];
    if (before != nullptr && row.Number("bodies") > before->Number("bodies")) {
      const auto ratio = [&](const char* key) {
        return std::log(row.Number(key) / before->Number(key));
      };
      row.Set("exponent", ratio("flops") / ratio("bodies"));
    }
    row.Set("flops_per_body", row.Number("flops") / row.Number("bodies"));
    before = &row;
  }
}

/// Returns a sentence per level and solver: the method with the fewest operations at each size.
std::vector<std::string> Crossovers(std::span<const Record> rows) {
  std::map<std::string, std::map<double, const Record*>> cheapest;
  for (const Record& row : rows) {
    if (!HasCounts(row)) continue;
    const Record*& best =
        cheapest[row.Text("enforcement") + ", " + row.Text("solver")][row.Number("bodies")];
    if (best == nullptr || row.Number("flops") < best->Number("flops")) best = &row;
  }
  std::vector<std::string> sentences;
  for (const auto& [level, sizes] : cheapest) {
    std::string sentence = "fewest operations at level " + level + ":";
    std::string method;
    for (const auto& [bodies, row] : sizes) {
      if (MethodOf(*row) == method) continue;
      sentence +=
          fmt::format("{} from {} bodies {}", method.empty() ? "" : ";", bodies, MethodOf(*row));
      method = MethodOf(*row);
    }
    sentences.push_back(sentence + fmt::format(" (to {})", sizes.rbegin()->first));
  }
  return sentences;
}

Table CountTable(std::vector<Record> rows) {
  Table table{.rows = std::move(rows)};
  table.columns = {{"mechanism", "mechanism"},
                   {"formulation", "formulation"},
                   {"enforcement", "enforcement"},
                   {"coordinates", "coord."},
                   {"solver", "solver"},
                   {"bodies", "bodies", Format::kInteger},
                   {"flops", "flops", Format::kInteger, {}, 2},
                   {"flops_per_body", "per body", Format::kFixed},
                   {"exponent", "exponent", Format::kExponent, {}, 2},
                   {"kinematics", "kinematics", Format::kInteger},
                   {"forces", "forces", Format::kInteger},
                   {"solve", "solve", Format::kInteger},
                   {"additions", "+ -", Format::kInteger},
                   {"multiplications", "*", Format::kInteger},
                   {"divisions", "/", Format::kInteger},
                   {"roots", "sqrt", Format::kInteger},
                   {"sines", "sin cos", Format::kInteger},
                   {"other", "other", Format::kInteger, {}, -1},
                   {"depth", "depth", Format::kInteger, {}, 1},
                   {"solve_depth", "depth of solve", Format::kInteger, {}, 1},
                   {"correction", "Newton step", Format::kInteger},
                   {"comparisons", "compared", Format::kInteger},
                   {"flops_compared", "flops with comparisons", Format::kInteger, {}, -2},
                   {"flops_as_run", "flops as run", Format::kInteger, {}, 1},
                   {"exact", "exact", Format::kText, {}, -1},
                   {"not_recorded", "not recorded", Format::kText, {}, 2}};
  table.notes = {
      "flops: + - * count 1, / and sqrt 4, other functions 8 (McMahon 1986); depth: operations on "
      "the longest path; zeros and ones of the geometry exploited, as run: not exploited"};
  return table;
}

/// Prints one row per right-hand side. Returns 2 if none was recorded.
int CountOperations(const CountCommand& command, const std::string& typed) {
  constexpr std::size_t kMaxOfFiles = 100'000, kMaxOfFamilies = 1'000'000;
  if (command.mechanisms.empty() && command.family.empty()) {
    throw ConfigError("count: found neither mechanisms nor --family, expected one of them");
  }
  // other processes read them
  for (const std::filesystem::path& path : command.mechanisms) NoteInput(path);
  if (!command.out.empty()) RequireOutput(command.out);
  std::vector<Record> rows;
  const auto add = [&](const std::string& name, const std::function<int()>& count) {
    int code = 0;
    const std::vector<Record> more = RowsOf(name, command.limits, count, &code);
    rows.insert(rows.end(), more.begin(), more.end());
    return code;
  };
  for (const std::filesystem::path& path : command.mechanisms) {
    const int code = add(path.string(), [&] {
      const MechanismFile file = ReadMechanism(path);
      return CountHere(command, file.description, file.observe, kMaxOfFiles);
    });
    if (code != 0) return code;
  }
  const std::size_t num_files = rows.size();
  std::vector<std::string> crossovers;
  if (!command.family.empty()) {
    const SizedFamily& family = SizedFamilyOf(command.family);
    RequireSizes(family, command.sizes);
    for (const int size : command.sizes) {
      const int code = add(fmt::format("{} {}", family.name, size), [&] {
        MechanismDescription description = family.make(size);
        description.name = family.name;
        return CountHere(command, description, {}, kMaxOfFamilies);
      });
      if (code != 0) return code;
    }
    AddGrowth(std::span(rows).subspan(num_files));
    crossovers = Crossovers(std::span(rows).subspan(num_files));
  }
  const int code = std::ranges::any_of(rows, HasCounts) ? 0 : 2;
  std::string text;
  if (command.format == "jsonl") {
    for (const Record& row : rows) text += ToJsonObject(row) + "\n";
  }
  Table table = CountTable(std::move(rows));
  table.notes.insert(table.notes.end(), crossovers.begin(), crossovers.end());
  const bool on_terminal = command.format == "text" && command.out.empty();
  // drop columns of only some rows; files keep the reasons of missing counts
  std::erase_if(table.columns, [&](const TableColumn& column) {
    const bool is_optional = column.key == "exponent" || column.key == "flops_per_body" ||
                             column.key == "correction" ||
                             (column.key == "not_recorded" && on_terminal);
    return is_optional && std::ranges::none_of(table.rows, [&](const Record& row) {
             return row.Find(column.key) != nullptr;
           });
  });
  if (on_terminal) {
    PrintText(ToScreen(table));
    return code;
  }
  AppendProvenance(table, typed);
  Deliver(text.empty() ? RenderKept(table, command.format) : text, command.out);
  if (command.out.empty()) return code;
  for (const std::string& sentence : crossovers) Print("{}\n", sentence);
  return code;
}

}  // namespace

void AddCount(Commands& commands) {
  auto& command = commands.Keep<CountCommand>();
  commands.Add(
      "count", "Count the operations of right-hand sides exactly",
      [&](const Typed& typed) { return CountOperations(command, typed.line); },
      {{"mechanisms", "Mechanism files (JSON)", &command.mechanisms},
       {"--family",
        "Family of mechanisms of any size; also prints how counts grow with size, and which "
        "method is cheapest at which size",
        &command.family, OneOf(NamesOfSizedFamilies())},
       {"--sizes", "Sizes of the family's members: a,b", &command.sizes, kSplits,
        Needs("--family")},
       {"--formulation", "Formulations (default: all): a,b", &command.formulations,
        OneOf(FormulationNamesWithoutPeers()), kSplits},
       {"--enforcement", "Levels (default: all that are recorded): a,b", &command.levels,
        OneOf(LevelNames()), kSplits},
       {"--coordinates", "Coordinate sets (default: both): a,b", &command.coordinates,
        OneOf({"joint", "absolute"}), kSplits},
       {"--solver", "Solvers: a,b", &command.solvers, OneOf({"plain", "rank-revealing"}), kSplits},
       FormatOption(&command.format, {"text", "csv", "markdown", "json", "latex", "jsonl"}),
       OutOption(&command.out),
       WideOption(),
       CpuOption(&command.limits),
       MemoryOption(&command.limits)});
}

}  // namespace loopbench::harness
