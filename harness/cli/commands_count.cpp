#include "harness/cli/commands_count.h"

#include <sstream>

#include "harness/cli/report.h"
#include "harness/config/formulations.h"
#include "harness/config/mechanism_reader.h"
#include "harness/generate/record.h"
#include "harness/isolation/print_from_child.h"
#include "harness/record/record_json.h"
#include "harness/run/compiled_scene.h"
#include "harness/tables/fit.h"
#include "harness/text/config_error.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"
#include "harness/timing/subject.h"

namespace loopbench::harness {
namespace {

// of counts at level baumgarte: other gains give the same counts, none would leave the feedback out
constexpr BaumgarteGains kGains = {.alpha = 5.0, .beta = 5.0};

template <class Enum>
std::vector<Enum> ParseAll(const std::vector<std::string>& names, std::vector<Enum> all) {
  if (names.empty()) return all;
  all.clear();
  for (const std::string& name : names) all.push_back(*Parse<Enum>(name));
  return all;
}

std::vector<std::string> FormulationsOf(const CountCommand& command) {
  if (!command.formulations.empty()) return command.formulations;
  std::vector<std::string> names;
  for (const FormulationRow& row : Formulations()) {
    if (!row.is_peer()) names.push_back(row.name);
  }
  return names;
}

/// Counts of one right-hand side. They are exact unless a change far below any digit that is
/// meant, as other libraries and processors make it, leads to others.
void SetCounts(const generate::RecordingSubject& subject, const generate::RecordingStart& start,
               Record& row) {
  constexpr double kRounding = 1e-12;
  generate::RecordingStart rounded = start;
  rounded.q.array() += kRounding;
  rounded.u.array() -= kRounding;
  const auto counts = generate::CountsOf(generate::RecordDerivative(subject, start));
  const auto other = generate::CountsOf(generate::RecordDerivative(subject, rounded));
  const generate::OperationCounts& of = counts.result;
  row.Set("flops", of.flops());
  row.Set("additions", of.additions);
  row.Set("multiplications", of.multiplications);
  row.Set("divisions", of.divisions);
  row.Set("roots", of.roots);
  row.Set("sines", of.sines);
  row.Set("other", of.other);
  row.Set("depth", std::int64_t{counts.depth});
  row.Set("comparisons", counts.comparisons);
  row.Set("flops_compared", counts.compared.flops());
  row.Set("flops_as_run", counts.as_run.flops());
  row.Set("exact", std::string(counts == other ? "yes" : "no"));
}

/// One part of a mechanism in one coordinate set: a row per formulation, level and solver.
void CountPart(const CountCommand& command, const MechanismDescription& part, Coordinates set,
               std::vector<Record>& rows) {
  const BenchmarkState state = ComputeState(part, set);
  for (const std::string& formulation : FormulationsOf(command)) {
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
                     .options = {.enforcement = level, .solver = solver, .gains = kGains}},
                    {.q = state.q, .u = state.u}, row);
        } catch (const std::exception& why) {
          row.Set("not_recorded", std::string(why.what()));
        }
      }
    }
  }
}

/// In a child process: rows as lines of JSON.
int CountHere(const CountCommand& command, const std::filesystem::path& path) {
  const MechanismFile file = ReadMechanism(path);
  const CompiledScene scene = CompileScene(file.description, file.observe, {});
  std::vector<Record> rows;
  for (const auto& part : scene.compiled.parts) {
    for (const Coordinates set : ParseAll<Coordinates>(
             command.coordinates, {Coordinates::kJoint, Coordinates::kAbsolute})) {
      CountPart(command, part.description, set, rows);
    }
  }
  for (const Record& row : rows) PrintText(ToJsonObject(row) + "\n");
  return 0;
}

Table CountTable(std::vector<Record> rows) {
  Table table{.rows = std::move(rows)};
  table.columns = {{"mechanism", "mechanism"},
                   {"formulation", "formulation"},
                   {"enforcement", "level"},
                   {"coordinates", "coord."},
                   {"solver", "solver"},
                   {"bodies", "bodies", Format::kInteger},
                   {"flops", "flops", Format::kInteger, {}, 2},
                   {"additions", "+ -", Format::kInteger},
                   {"multiplications", "*", Format::kInteger},
                   {"divisions", "/", Format::kInteger},
                   {"roots", "sqrt", Format::kInteger},
                   {"sines", "sin cos", Format::kInteger},
                   {"other", "other", Format::kInteger, {}, -1},
                   {"depth", "depth", Format::kInteger, {}, 1},
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

}  // namespace

int CountOperations(const CountCommand& command, const std::string& typed) {
  std::vector<Record> rows;
  for (const std::filesystem::path& path : command.mechanisms) {
    std::string text;
    const int code = TextFromChild(
        path.string(), command.limits, [&] { return CountHere(command, path); }, &text);
    if (code != 0) return code;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) rows.push_back(FromJsonLine(line));
  }
  const bool any =
      std::ranges::any_of(rows, [](const Record& row) { return row.Find("flops") != nullptr; });
  const bool all = std::ranges::all_of(
      rows, [](const Record& row) { return row.Find("not_recorded") == nullptr; });
  Table table = CountTable(std::move(rows));
  const bool on_terminal = command.format == "text" && command.out.empty();
  if (on_terminal && all) table.columns.pop_back();
  if (!on_terminal) AppendProvenance(table, typed);
  if (on_terminal) {
    PrintText(ToScreen(table));
  } else if (command.out.empty()) {
    PrintText(RenderKept(table, command.format));
  } else {
    WriteFileAtomically(command.out, RenderKept(table, command.format));
    Print("wrote {}\n", command.out.string());
  }
  return any ? 0 : 2;
}

}  // namespace loopbench::harness
