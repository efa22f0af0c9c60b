#include <numeric>
#include <set>

#include "harness/base/store.h"
#include "harness/figures/report.h"
#include "harness/observers/reference.h"
#include "harness/observers/trajectory.h"
#include "harness/suite/suite.h"

namespace loopbench::harness {

std::vector<std::size_t> KeepExtremes(std::span<const double> values, std::size_t most) {
  const std::size_t n = values.size();
  most = std::max<std::size_t>(most, 4);
  std::vector<std::size_t> kept(std::min(n, most));
  std::iota(kept.begin(), kept.end(), 0);
  if (n <= most) return kept;
  kept = {0};
  const std::size_t inner = n - 2, buckets = (most - 2) / 2;
  for (std::size_t b = 0; b < buckets; ++b) {
    const std::size_t from = 1 + b * inner / buckets, to = 1 + (b + 1) * inner / buckets;
    std::size_t low = from, high = from;
    for (std::size_t i = from; i < to; ++i) {
      if (!std::isfinite(values[i])) continue;
      if (!std::isfinite(values[low]) || values[i] < values[low]) low = i;
      if (!std::isfinite(values[high]) || values[i] > values[high]) high = i;
    }
    kept.push_back(std::min(low, high));
    if (low != high) kept.push_back(std::max(low, high));
  }
  kept.push_back(n - 1);
  return kept;
}

std::vector<std::size_t> KeepEvenly(std::size_t count, std::size_t most) {
  most = std::max<std::size_t>(most, 2);
  std::vector<std::size_t> kept(std::min(count, most));
  for (std::size_t i = 0; i < kept.size(); ++i) {
    kept[i] = count <= most ? i : i * (count - 1) / (most - 1);
  }
  return kept;
}

namespace {

/// Maximum number of drawn problems of a report, of motions of a problem, and of body poses in all
/// motions of a page.
constexpr std::size_t kMaxProblems = 12, kMaxPaths = 60, kMaxPlaces = 120'000;

/// Reads the poses of at most `most` displayed rows of a trajectory with `rows` rows in its record;
/// memory does not grow with the file.
ReportPath PathOf(const std::filesystem::path& path, const MechanismDescription& user,
                  std::size_t rows, std::size_t most) {
  TrajectoryReader file(path);
  std::vector<PoseColumns> columns;
  for (std::size_t body = 1; body < user.bodies.size(); ++body) {
    const auto pose = FindPose(file.columns(), user.bodies[body].name);
    if (!pose) {
      throw std::runtime_error("it has no pose of body " + user.bodies[body].name +
                               " (\"bodies\" in \"output\" of the experiment)");
    }
    columns.push_back(*pose);
  }
  const std::vector<std::size_t> wanted = KeepEvenly(rows, most);
  ReportPath found;
  std::vector<double> row;
  auto next = wanted.begin();
  for (; file.Next(&row); ++found.stored) {
    if (next == wanted.end() || *next != found.stored) continue;
    ++next;
    Poses poses(user.bodies.size());
    bool is_known = true;
    for (std::size_t body = 1; body < poses.size(); ++body) {
      poses[body] = columns[body - 1].At(row.data());
      is_known = is_known && poses[body].p.allFinite() && poses[body].R.allFinite();
    }
    if (!is_known) continue;
    found.times.push_back(row[file.time()]);
    found.poses.push_back(std::move(poses));
  }
  return found;
}

ReportPath PathOf(const Reference& reference, std::size_t most) {
  ReportPath path;
  path.label = fmt::format("certified reference ({}, to {:.1g} m)", reference.scalar,
                           reference.Certified().position);
  path.stored = reference.NumTrusted();
  for (const std::size_t k : KeepEvenly(path.stored, most)) {
    Poses poses;
    for (const BodyState& body : reference.snapshots[k].bodies) poses.push_back(body.pose);
    path.times.push_back(reference.times[k]);
    path.poses.push_back(std::move(poses));
  }
  return path;
}

struct Work {
  const std::vector<Record>& records;
  const std::vector<std::string>& names;
  const std::filesystem::path& store_file;
  std::vector<std::size_t> rows;
  std::size_t most_places = 0;  ///< body poses in all motions of the problem
};

void AddPaths(const Work& work, const MechanismDescription& user, ReportProblem* problem,
              std::vector<std::string>* remarks, std::vector<std::string>* changed) {
  std::vector<std::size_t> with_file;
  std::vector<std::string> references;
  for (const std::size_t row : work.rows) {
    const Record& record = work.records[row];
    const auto path = TrajectoryOf(record, work.store_file);
    if (!path.empty() && std::filesystem::exists(path)) with_file.push_back(row);
    if (ReferenceOf(record, work.store_file).empty()) continue;
    AddOnce(references, record.Text("reference_file"));
  }
  if (with_file.size() > kMaxPaths) {
    remarks->push_back(fmt::format("{}: motions of the first {} of {} runs are in this page",
                                   problem->name, kMaxPaths, with_file.size()));
    with_file.resize(kMaxPaths);
  }
  const std::size_t paths = std::max<std::size_t>(1, with_file.size() + references.size());
  const std::size_t most = work.most_places / (paths * user.bodies.size());
  const auto add = [&](ReportPath path, const std::string& label) {
    if (path.times.size() < path.stored) {
      remarks->push_back(fmt::format("motion of {}, {}: {} of its {} times are in this page",
                                     problem->name, label, path.times.size(), path.stored));
    }
    if (path.times.size() > 1) problem->paths.push_back(std::move(path));
  };
  const auto fail = [&](const std::string& label, const std::exception& error) {
    remarks->push_back(fmt::format("{}, {}: no motion: {}", problem->name, label, error.what()));
  };
  for (const std::string& id : references) {
    try {
      const auto file = ReferencePath(work.store_file, id);
      const auto reference = ReadReference(file, id, user);
      if (!reference) throw std::runtime_error(file.string() + " is not there");
      add(PathOf(*reference, most), "reference");
    } catch (const std::runtime_error& error) {
      fail("reference", error);
    }
  }
  for (const std::size_t row : with_file) {
    try {
      const double count = work.records[row].Number("trajectory_rows");
      const auto file = TrajectoryOf(work.records[row], work.store_file);
      VerifyTrajectory(work.records[row], file);
      ReportPath path =
          PathOf(file, user, count > 0 ? static_cast<std::size_t>(count) : most, most);
      path.label = work.names[row];
      path.row = row;
      add(std::move(path), work.names[row]);
    } catch (const ChangedFile& error) {
      changed->emplace_back(error.what());
      fail(work.names[row], error);
    } catch (const std::runtime_error& error) {
      fail(work.names[row], error);
    }
  }
}

void Fill(const Work& work, ReportProblem* problem, std::vector<std::string>* remarks,
          std::vector<std::string>* changed) {
  const auto file = MechanismOf(work.records[work.rows.front()], work.store_file);
  if (file.empty() || !std::filesystem::exists(file)) {
    problem->missing =
        "The store keeps no motion of this problem: a run keeps one with \"output\": {\"step\": "
        "0.01} (each run) or \"reference\": {} (the certified motion) in the experiment.";
    return;
  }
  try {
    const MechanismDescription user = ReadKeptMechanism(file);
    problem->picture = MakePicture(user, "mechanisms/" + file.filename().string());
    problem->picture->motions.clear();  // only `view` shows degrees of freedom
    AddPaths(work, user, problem, remarks, changed);
  } catch (const ChangedFile& error) {
    changed->emplace_back(error.what());
    problem->missing = error.what();
    return;
  } catch (const std::exception& error) {
    problem->missing = error.what();
    return;
  }
  if (problem->paths.empty()) {
    problem->missing =
        "No motion of this problem could be read (omitted data are listed at the end of the "
        "page); with \"output\": {\"step\": 0.01} in the experiment a run keeps its own.";
  }
}

std::vector<ReportProblem> FindProblems(const ReportTable& table,
                                        const std::filesystem::path& store_file,
                                        std::vector<std::string>* remarks,
                                        std::vector<std::string>* changed) {
  std::vector<std::size_t> rows(table.rows.size());
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  const auto groups = GroupBy(rows, [&](std::size_t row) { return table.problems[row]; });
  const std::size_t shown = std::min(groups.size(), kMaxProblems);
  std::vector<ReportProblem> found;
  for (const auto& [name, members] : groups) {
    ReportProblem& problem = found.emplace_back(ReportProblem{.name = name});
    if (found.size() <= shown) {
      Fill({table.rows, table.names, store_file, members, kMaxPlaces / shown}, &problem, remarks,
           changed);
      continue;
    }
    problem.missing = fmt::format(
        "Pictures are of the first {} problems of a store; for this one "
        "make a store of its own (loopbench merge, --filter of run).",
        kMaxProblems);
  }
  return found;
}

std::string Typed(const std::vector<std::string>& words) {
  std::vector<const char*> pointers = {"loopbench"};
  for (const std::string& word : words) pointers.push_back(word.c_str());
  return CommandLine(static_cast<int>(pointers.size()), pointers.data());
}

/// Returns the table's columns and all other record keys with a heading.
std::vector<TableColumn> AllColumns(const Table& table) {
  std::vector<TableColumn> columns = table.columns;
  std::set<std::string> there;
  for (const TableColumn& column : columns) there.insert(column.key);
  for (const std::string& key : KeysOf(table.rows)) {
    if (key.starts_with("series.") || !there.insert(key).second) continue;
    if (auto column = KnownColumn(key)) columns.push_back(std::move(*column));
  }
  return columns;
}

// Returns the keys of problems: equal in all rows of a problem, but not in all rows.
std::vector<std::string> KeysOfProblems(const std::vector<Record>& rows,
                                        const std::vector<std::string>& telling) {
  const auto problems = GroupBy(
      rows, [](const Record& row) { return row.Text("problem_id") + " " + row.Text("horizon"); });
  std::vector<std::string> keys;
  for (const std::string& key : telling) {
    if (key == "mechanism" || key == "horizon" || key == "experiment") continue;
    const bool is_problems =
        problems.size() > 1 && std::ranges::all_of(problems, [&](const auto& problem) {
          return IsAlike(problem.second, key);
        });
    if (is_problems) keys.push_back(key);
  }
  return keys;
}

std::string ProblemName(const Record& row, const std::vector<std::string>& keys) {
  std::string name = row.Text("mechanism");
  if (!row.Text("horizon").empty()) name += fmt::format(", {} s", row.Text("horizon"));
  for (const std::string& key : keys) name += fmt::format(", {} {}", key, row.Text(key));
  return name;
}

void NameRows(ReportTable* table) {
  std::vector<std::string> telling = DistinguishingKeys(table->rows);
  const std::vector<std::string> of_problems = KeysOfProblems(table->rows, telling);
  std::erase_if(telling, [&](const std::string& key) {
    return key == "mechanism" || key == "horizon" || Contains(of_problems, key);
  });
  std::map<std::string, std::string> ids;  // ids of problems, by name
  for (const Record& row : table->rows) {
    std::string name = ProblemName(row, of_problems);
    const std::string id = row.Text("problem_id");
    if (ids.emplace(name, id).first->second != id) name += fmt::format(" ({})", id.substr(0, 6));
    table->problems.push_back(name);
    std::string own = NameOfRow(row, telling);
    if (own.empty() || telling.empty()) own = row.Text("formulation");
    table->names.push_back(own);
  }
}

std::vector<ReportTable> MakeTables(const std::vector<Record>& records, const std::string& store) {
  std::vector<ReportTable> tables;
  for (const auto& [kind, title] : {std::pair{"drift", "Accuracy runs"},
                                    {"precision", "Runs in several scalars"},
                                    {"timing", "Timings"}}) {
    Table full = MakeTable(records, {.kind = kind});
    if (full.rows.empty()) continue;
    ReportTable table{.kind = kind, .title = title};
    for (TableColumn& column : AllColumns(full)) {
      const auto is_blank = [&](const Record& row) { return Cell(row, column).empty(); };
      if (std::ranges::all_of(full.rows, is_blank)) continue;
      if (full.rows.size() > 1 && IsAlike(full.rows, column.key) && column.key != "outcome") {
        table.alike.push_back(column.header + ": " + Cell(full.rows.front(), column));
      } else {
        table.columns.push_back(std::move(column));
      }
    }
    table.rows = std::move(full.rows);
    table.command = Typed({"table", store, "--kind", kind, "--format", "csv"});
    NameRows(&table);
    tables.push_back(std::move(table));
  }
  return tables;
}

/// Returns a finding for each outcome other than "finished", and one for each warning note.
std::vector<ReportFinding> FindingsOf(const ReportTable& table,
                                      const std::vector<std::string>& warnings) {
  constexpr std::size_t kRowsNamed = 5;
  std::map<std::string, std::vector<std::size_t>> endings;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    if (HasFailed(table.rows[i])) endings[table.rows[i].Text("outcome")].push_back(i);
  }
  std::vector<ReportFinding> findings;
  for (const auto& [outcome, rows] : endings) {
    const std::vector<std::string> names = Mapped<std::string>(rows, [&](std::size_t i) {
      const Record& row = table.rows[i];
      std::string text = fmt::format("{}: {}", table.problems[i], table.names[i]);
      if (!row.Text("t_reached").empty()) {
        text += fmt::format(" at {:.4g} s", row.Number("t_reached"));
      }
      return text + (row.Text("message").empty() ? "" : " (" + row.Text("message") + ")");
    });
    findings.push_back({true,
                        fmt::format("{} of {} runs ended as {}: {}", rows.size(), table.rows.size(),
                                    outcome, FirstOf(names, kRowsNamed, "; ", "; and {} more")),
                        "outcome=" + outcome});
  }
  for (const std::string& note : warnings) {
    const std::string code = note.substr(0, note.find(':'));
    if (code.find(' ') == std::string::npos) findings.push_back({false, note, "warnings~" + code});
  }
  return findings;
}

std::vector<ReportCost> MakeCosts(const std::vector<Record>& records, const std::string& store,
                                  std::vector<std::string>* remarks) {
  std::vector<ReportCost> costs;
  for (const char* key : UsualErrors()) {
    const bool is_there = std::ranges::any_of(
        records, [&](const Record& record) { return std::isfinite(record.Number(key)); });
    if (!is_there) continue;
    WorkPrecisionOptions options{.error = key};
    if (Contains(CaseKeysOf(records), "config_hash")) options.per.push_back("config_hash");
    try {
      ReportCost cost{.work_precision = MakeWorkPrecision(records, options)};
      cost.error = ColumnOf(key, records).header;
      cost.cost = ColumnOf(cost.work_precision.cost, records).header;
      cost.fairness = FairnessStatement(cost.work_precision);
      cost.command = Typed({"work-precision", store, "--error-key", key});
      costs.push_back(std::move(cost));
    } catch (const ConfigError& error) {
      remarks->push_back(fmt::format("work and precision by {}: {}", key, error.what()));
    }
  }
  return costs;
}

/// Returns the origins of the records, with the number of records of each.
std::vector<std::string> OriginsOf(const std::vector<Record>& records) {
  std::map<std::string, std::size_t> counts;
  for (const Record& record : records) {
    const Origin origin = OriginOf(record);
    ++counts[fmt::format("experiment {}, commit {}, {}, {} {}", record.Text("experiment"),
                         origin.commit, origin.machine, origin.compiler, origin.flags)];
  }
  return Mapped<std::string>(counts, [](const auto& origin) {
    return WithCount(origin.second, "record") + ": " + origin.first;
  });
}

struct Quantity {
  const char *name, *title, *unit, *time_key, *key;
};
constexpr Quantity kQuantities[] = {
    {"drift", "Drift", "m", "series.drift_t", "series.drift"},
    {"energy", "Error of the energy balance", "J", "series.energy_t", "series.energy_error"},
    {"error", "True error of points", "m", "series.error_t", "series.error"}};

/// Returns curves of the rows that have them. All curves share at most `most` points evenly.
std::vector<ReportPlot> MakePlots(const std::vector<Record>& rows, std::size_t most) {
  std::vector<ReportPlot> plots;
  std::size_t curves = 0;
  for (const Quantity& quantity : kQuantities) {
    ReportPlot plot{.name = quantity.name, .title = quantity.title, .unit = quantity.unit};
    for (std::size_t row = 0; row < rows.size(); ++row) {
      const std::vector<double>& t = rows[row].Numbers(quantity.time_key);
      const std::vector<double>& y = rows[row].Numbers(quantity.key);
      const std::size_t n = std::min(t.size(), y.size());
      if (n == 0) continue;
      plot.points += n;
      plot.curves.push_back({row,
                             {t.begin(), t.begin() + static_cast<std::ptrdiff_t>(n)},
                             {y.begin(), y.begin() + static_cast<std::ptrdiff_t>(n)}});
    }
    curves += plot.curves.size();
    if (!plot.curves.empty()) plots.push_back(std::move(plot));
  }
  for (ReportPlot& plot : plots) {
    for (ReportCurve& curve : plot.curves) {
      ReportCurve kept{.row = curve.row};
      for (const std::size_t i : KeepExtremes(curve.y, most / curves)) {
        kept.t.push_back(curve.t[i]);
        kept.y.push_back(curve.y[i]);
      }
      plot.shown += kept.t.size();
      curve = std::move(kept);
    }
  }
  return plots;
}

}  // namespace

ReportData MakeReport(const std::vector<Record>& records, const ReportOptions& options) {
  const std::string store = options.store.string();
  ReportData data{.store = store, .tables = MakeTables(records, store)};
  data.origins = OriginsOf(records);
  data.warnings = NoiseWarnings(records);
  data.plot_command = Typed({"plot", store, "--out", "figures"});
  for (const ClaimRule& rule : options.claims) data.claims.push_back(Evaluate(rule, records));
  data.claims_command = Typed(
      {"check-claims", store, "--claims", options.claims_file.string(), "--out", "verdicts.md"});
  if (options.rules) data.map = MakeRobustnessMap(*options.rules, records);
  data.map_command = Typed({"robustness", store, "--rules", options.rules_file.string()});
  if (data.tables.empty() || data.tables.front().kind != "drift") return data;
  const ReportTable& runs = data.tables.front();
  data.runs = runs.rows.size();
  for (const Record& row : runs.rows) {
    data.failed += HasFailed(row);
    data.flagged += IsFlagged(row, "outcome");
  }
  data.warning_notes = WarningNotes(runs.rows, records);
  data.findings = FindingsOf(runs, data.warning_notes);
  data.plots = MakePlots(runs.rows, options.most_points);
  for (const ReportPlot& plot : data.plots) {
    if (plot.shown == plot.points) continue;
    data.remarks.push_back(fmt::format(
        "{} against time: {} of {} points of the store are in this page, of each of equal buckets "
        "of a curve the least and the largest",
        plot.title, plot.shown, plot.points));
  }
  data.costs = MakeCosts(records, store, &data.remarks);
  data.problems = FindProblems(runs, StoreFile(options.store), &data.remarks, &data.changed);
  return data;
}

}  // namespace loopbench::harness
