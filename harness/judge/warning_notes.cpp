#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "harness/config/published_series.h"
#include "harness/judge/analysis.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

constexpr std::size_t kRowsNamed = 3, kProblemsNamed = 6;

// Meaning of a warning code, and its number in a row.
struct Reason {
  const char* code;
  const char* sentence;
  std::string (*number)(const Record& row);
};

const Reason kReasons[] = {
    {kEnergyWarning,
     "error of the energy balance above 1 % of the exchanged energy, or larger than steps and "
     "tolerance explain",
     [](const Record& row) {
       return fmt::format("{:.2g} %, at most {:.2g} % expected", 100 * EnergyErrorShare(row),
                          100 * ExpectedEnergyShare(row));
     }},
    {kSingularWarning,
     "crosses singular configurations, where this level does not determine the branch",
     [](const Record& row) {
       return fmt::format("distance {:.1g} at {:.4g} s", row.Number("singularity_distance_min"),
                          row.Number("singularity_distance_min_t"));
     }},
    {kRegularizedWarning, "constraints were regularized away from singular configurations",
     [](const Record& row) {
       return fmt::format("{} of {} evaluations, distance {:.1g}",
                          row.Text("regularized_evaluations"), row.Text("rhs_evaluations"),
                          row.Number("singularity_distance_min"));
     }},
    {kDriftWarning, "drift is larger than steps and tolerance explain at this level",
     [](const Record& row) {
       return fmt::format("{:.1e} of a link or rad, at most {:.1e} expected", DriftShare(row),
                          ExpectedDriftShare(row));
     }},
    {kErrorWarning,
     "distance from the reference above 1000 tolerances, or with fixed steps above 1 % of a link",
     [](const Record& row) {
       const bool only_points = row.Text("reference") != kPublished;
       return fmt::format("{:.1e} of a link{}", TrueErrorShare(row), only_points ? "" : " or rad");
     }},
    {kRefinementWarning, "finer tolerances do not converge to one final state",
     [](const Record& row) {
       if (row.Find("refinement_difference") != nullptr) {
         return fmt::format(
             "{:.1e} of a link or rad from the run at {}", row.Number("refinement_difference"),
             row.Number("step") > 0.0 ? "half its step" : "a tenth of its tolerance");
       }
       return fmt::format("{} steps, state {}", row.Text("steps"), row.Text("state_hash"));
     }},
    {kDriveWarning, "steps longer than half a period of the fastest drive",
     [](const Record& row) { return fmt::format("{:.2g} periods a step", PeriodsPerStep(row)); }},
    {kStepsWarning, "step control at its shortest step, or more than half of the steps rejected",
     [](const Record& row) {
       return fmt::format("{} rejected of {}, shortest {:.1e} s", row.Text("rejected"),
                          row.Number("steps") + row.Number("rejected"),
                          row.Number("step_shortest"));
     }},
    {kMembersWarning, "members of the ensemble failed",
     [](const Record& row) {
       return row.Text("ensemble_failed") + " of " + row.Text("ensemble_size");
     }},
    {kExponentWarning, "the ensemble does not resolve the requested exponent",
     [](const Record& row) {
       return fmt::format("{:.2f} +- {:.2g}", row.Number("growth_exponent"),
                          row.Number("growth_spread"));
     }},
};

std::string NoteOf(const Reason& reason, std::span<const Record> rows,
                   const std::vector<std::string>& keys) {
  std::string names;
  std::size_t count = 0;
  for (const Record& row : rows) {
    if (!HasWarning(row, reason.code) || ++count > kRowsNamed) continue;
    names += fmt::format("{}{} ({})", names.empty() ? "" : "; ", NameOfRow(row, keys),
                         reason.number(row));
  }
  if (count == 0) return "";
  if (count > kRowsNamed) names += fmt::format("; and {} more", count - kRowsNamed);
  return fmt::format("{}: {}: {}", reason.code, reason.sentence, names);
}

// Runs of one problem, horizon and tolerance.
using ProblemKey = std::pair<std::string, std::pair<double, double>>;

ProblemKey ProblemOf(const Record& record) {
  return {record.Text("problem_id"), {record.Number("horizon"), record.Number("rtol")}};
}

/// Returns a name with the parameters in which the store's `records` differ.
std::string NameOfProblem(const Record& record, std::span<const Record> records) {
  std::vector<std::string> keys = {"rtol", "horizon"};
  const std::vector<std::string> telling = DistinguishingKeys(records);
  for (const TableColumn& parameter : WithParameters({}, records)) {
    if (std::ranges::find(telling, parameter.key) != telling.end()) keys.push_back(parameter.key);
  }
  return fmt::format("{}: {} {}", kDisagreementWarning, record.Text("mechanism"),
                     NameOfRow(record, keys));
}

// Describes the runs that decide if runs end differently (harness/judge/analysis.h).
std::string Deciding(const std::vector<Record>& runs) {
  const bool one_integrator = std::ranges::all_of(runs, [&](const Record& run) {
    return run.Text("integrator") == runs.front().Text("integrator");
  });
  return one_integrator ? "finer tolerances"
                        : "finer tolerances or an integrator all of whose runs agree";
}

// Names the runs that agree with each other; each of `runs` has a cluster.
std::string NoteOfProblem(const std::vector<Record>& runs, std::span<const Record> records) {
  const std::string deciding = Deciding(runs);
  const std::vector<std::string> keys = DistinguishingKeys(runs);
  std::map<std::int64_t, std::vector<Record>> clusters;
  for (const Record& run : runs) {
    clusters[static_cast<std::int64_t>(run.Number("agreement"))].push_back(run);
  }
  std::string text, alone;
  for (const auto& [number, members] : clusters) {
    std::vector<std::string> names;
    for (const Record& run : members) names.push_back(NameOfRow(run, keys));
    const bool cleared = !HasWarning(members.front(), kDisagreementWarning);
    if (members.size() > 1) {
      text += fmt::format("; {} agree{}", fmt::join(names, ", "),
                          cleared ? ", also with " + deciding : "");
    } else {
      alone += (alone.empty() ? "; no agreement: " : ", ") + names.front() +
               (cleared ? " (agrees with " + deciding + ")" : "");
    }
  }
  text += alone;
  const std::string problem = NameOfProblem(runs.front(), records);
  if (clusters.size() == 1) return problem + ": another final state than with " + deciding + text;
  const PoseDifference worst = LargestDifference(runs);
  return fmt::format(
      "{}: final states differ by {:.2g} links or rad ({}), more than {:.0f} tolerances{}", problem,
      worst.largest, worst.body, kMaxTolerances, text);
}

}  // namespace

std::vector<std::string> DistinguishingKeys(std::span<const Record> rows) {
  std::vector<std::string> keys;
  for (const std::string& key : CaseKeysOf(rows)) {
    if (key == "atol" && AtolFollowsRtol(rows)) continue;
    const bool differs = std::ranges::any_of(
        rows, [&](const Record& row) { return row.Text(key) != rows.front().Text(key); });
    if (differs) keys.push_back(key);
  }
  return keys;
}

std::string NameOfRow(const Record& row, const std::vector<std::string>& keys) {
  std::string words, numbers;
  for (const std::string& key : keys) {
    const std::string text = Cell(row, {.key = key, .header = "", .format = Format::kShortest});
    if (text.empty()) continue;
    if (std::holds_alternative<std::string>(*row.Find(key))) {
      words += (words.empty() ? "" : "/") + text;
    } else {
      numbers += fmt::format("{}{} {}", numbers.empty() ? "" : " ", key, text);
    }
  }
  const std::string name = words + (words.empty() || numbers.empty() ? "" : " ") + numbers;
  return name.empty() ? row.Text("mechanism") : name;
}

std::vector<std::pair<std::string, std::string>> MeaningsOfWarnings() {
  std::vector<std::pair<std::string, std::string>> meanings;
  for (const Reason& reason : kReasons) meanings.emplace_back(reason.code, reason.sentence);
  meanings.emplace_back(kDisagreementWarning, "other runs of the problem have other final states");
  return meanings;
}

std::vector<std::string> WarningNotes(std::span<const Record> rows,
                                      std::span<const Record> records) {
  if (std::ranges::none_of(rows, [](const Record& row) { return HasWarning(row); })) return {};
  std::vector<std::string> notes = {
      "warnings of flagged runs (docs/reference/outcomes-and-warnings.md):"};
  const std::vector<std::string> keys = DistinguishingKeys(rows);
  for (const Reason& reason : kReasons) {
    if (const std::string note = NoteOf(reason, rows, keys); !note.empty()) notes.push_back(note);
  }
  std::vector<ProblemKey> problems;
  for (const Record& row : rows) {
    if (!HasWarning(row, kDisagreementWarning)) continue;
    if (std::ranges::find(problems, ProblemOf(row)) == problems.end())
      problems.push_back(ProblemOf(row));
  }
  for (std::size_t i = 0; i < std::min(problems.size(), kProblemsNamed); ++i) {
    std::vector<Record> runs;
    std::ranges::copy_if(records, std::back_inserter(runs), [&](const Record& record) {
      return record.Find("agreement") != nullptr && ProblemOf(record) == problems[i];
    });
    // no other run at this tolerance: no cluster
    if (!runs.empty()) {
      notes.push_back(NoteOfProblem(runs, records));
      continue;
    }
    const auto alone = std::ranges::find_if(
        rows, [&](const Record& row) { return ProblemOf(row) == problems[i]; });
    notes.push_back(NameOfProblem(*alone, records) +
                    ": another final state than with finer tolerances");
  }
  if (problems.size() > kProblemsNamed) {
    notes.push_back(fmt::format("{}: {} problems more; column agreement numbers the agreeing sets",
                                kDisagreementWarning, problems.size() - kProblemsNamed));
  }
  return notes;
}

}  // namespace loopbench::harness
