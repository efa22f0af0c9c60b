// count: exact operation counts of right-hand sides.
#include <sstream>

#include "harness/cli/commands.h"
#include "harness/config/formulations.h"
#include "harness/generate/record.h"
#include "harness/run/run.h"

namespace loopbench::harness {
namespace {

struct CountCommand {
  std::vector<std::filesystem::path> mechanisms;
  std::string family;
  std::vector<int> sizes;
  /// Names to count; empty: every formulation, every recorded level, both coordinate sets.
  std::vector<std::string> formulations, levels, coordinates;
  std::vector<std::string> solvers = {"rank-revealing"};
  std::string format = "text";
  std::filesystem::path out;
  ProcessLimits limits = kFileLimits;

  std::vector<Option> Options() {
    return {{"mechanisms", "Mechanism files (JSON)", &mechanisms},
            {"--family",
             "Family of mechanisms of any size; also prints how counts grow with size, and which "
             "method is cheapest at which size",
             &family, OneOf(NamesOfSizedFamilies())},
            {"--sizes", "Sizes of the family's members: a,b", &sizes, kSplits, Needs("--family")},
            {"--formulation", "Formulations (default: all): a,b", &formulations,
             OneOf(FormulationNamesWithoutPeers()), kSplits},
            {"--enforcement", "Levels (default: all that are recorded): a,b", &levels,
             OneOf(LevelNames()), kSplits},
            {"--coordinates", "Coordinate sets (default: both): a,b", &coordinates,
             OneOf({"joint", "absolute"}), kSplits},
            {"--solver", "Solvers: a,b", &solvers, OneOf({"plain", "rank-revealing"}), kSplits},
            FormatOption(&format, {"text", "csv", "markdown", "json", "latex", "jsonl"}),
            OutOption(&out),
            WideOption(),
            CpuOption(&limits),
            MemoryOption(&limits)};
  }
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
  Put(row, "kinematics", counts.kinematics.flops(), "forces", counts.forces.flops(), "solve",
      counts.solve.flops(), "solve_depth", counts.solve_depth, "comparisons", counts.comparisons,
      "flops_compared", counts.compared.flops(), "flops_as_run", counts.as_run.flops());
  if (subject.options.enforcement == Enforcement::kPosition) {
    generate::RecordingSubject newton = subject;
    newton.quantity = generate::Quantity::kCorrection;
    row.Set("correction",
            generate::CountsOf(generate::RecordFunction(newton, start)).result.flops());
  }
  Put(row, "exact", counts == other ? "yes" : "no");
}

/// Adds a row per formulation, level and solver for one part of a mechanism.
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
        Put(row, "mechanism", part.name, "formulation", formulation, "enforcement", level,
            "coordinates", set, "solver", solver, "bodies", part.bodies.size() - 1);
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
          Put(row, "not_recorded", why.what());
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

/// Returns a sentence per level and solver.
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

constexpr const char* kColumns =
    "mechanism::2, formulation::2, enforcement::2, coordinates=coord.::2, solver::2, "
    "bodies:integer, flops:integer:2, flops_per_body=per body:fixed, exponent:exponent:2, "
    "kinematics:integer, forces:integer, solve:integer, additions=+ -:integer, "
    "multiplications=*:integer, divisions=/:integer, roots=sqrt:integer, sines=sin cos:integer, "
    "other:integer:-1, depth:integer:1, solve_depth=depth of solve:integer:1, "
    "correction=Newton step:integer, comparisons=compared:integer, "
    "flops_compared=flops with comparisons:integer:-2, flops_as_run=flops as run:integer:1, "
    "exact::-1, not_recorded=not recorded::2";
constexpr const char* kCounting =
    "flops: + - * count 1, / and sqrt 4, other functions 8 (McMahon 1986); depth: operations on "
    "the longest path; zeros and ones of the geometry exploited, as run: not exploited";

/// Returns 2 if no right-hand side was recorded.
int CountOperations(const CountCommand& command, const Typed& typed) {
  constexpr std::size_t kMaxOfFiles = 100'000, kMaxOfFamilies = 1'000'000;
  if (command.mechanisms.empty() && command.family.empty()) {
    throw ConfigError("count: found neither mechanisms nor --family, expected one of them");
  }
  // other processes read them
  for (const std::filesystem::path& path : command.mechanisms) NoteInput(path);
  if (!command.out.empty()) RequireOutput(command.out);
  std::vector<Record> rows;
  // counts in a child process; returns its exit code
  const auto add = [&](const std::string& name, const std::function<int()>& count) {
    std::string text;
    const int code = TextFromChild(name, command.limits, count, &text);
    std::istringstream lines(text);
    for (std::string line; code == 0 && std::getline(lines, line);) {
      rows.push_back(FromJsonLine(line));
    }
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
    if (command.sizes.empty()) {
      Reject("--family {}: found no --sizes, expected numbers from {} to {}", family.name,
             family.smallest, family.largest);
    }
    for (const int size : command.sizes) {
      if (size >= family.smallest && size <= family.largest) continue;
      Reject("--sizes: found {}, expected {} to {} of family {} ({})", size, family.smallest,
             family.largest, family.name, family.of_what);
    }
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
  Table table{.columns = Columns(kColumns), .rows = std::move(rows), .notes = crossovers};
  table.notes.insert(table.notes.begin(), kCounting);
  const bool on_terminal = command.format == "text" && command.out.empty();
  EraseEmptyColumns({"exponent", "flops_per_body", "correction"}, &table);
  if (on_terminal) EraseEmptyColumns({"not_recorded"}, &table);  // files keep it
  if (on_terminal) {
    PrintText(ToScreen(table));
    return code;
  }
  table = WithProvenance(std::move(table), typed.line);
  Deliver(text.empty() ? RenderKept(table, command.format) : text, command.out);
  if (command.out.empty()) return code;
  for (const std::string& sentence : crossovers) Print("{}\n", sentence);
  return code;
}

}  // namespace

void AddCount(Commands& commands) {
  commands.Add("count", "Count the operations of right-hand sides exactly", CountOperations);
}

}  // namespace loopbench::harness
