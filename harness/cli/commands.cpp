#include "harness/cli/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <set>

#include "harness/analysis/doubts.h"
#include "harness/cli/long_table.h"
#include "harness/isolation/interruption.h"
#include "harness/judge/claims_reader.h"
#include "harness/judge/claims_report.h"
#include "harness/record/provenance.h"
#include "harness/reference/merge_references.h"
#include "harness/run/peers.h"
#include "harness/run/run_case.h"
#include "harness/store/contents.h"
#include "harness/store/merge_stores.h"
#include "harness/store/new_store.h"
#include "harness/store/result_store.h"
#include "harness/suite/kept_files.h"
#include "harness/suite/precision_cases.h"
#include "harness/suite/reference_cases.h"
#include "harness/tables/fit.h"
#include "harness/tables/table_view.h"
#include "harness/text/config_error.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"
#include "harness/timing/time_cases.h"
#include "harness/trajectory/store_files.h"

namespace loopbench::harness {

std::vector<Record> Prepared(std::vector<Record> records) {
  records = LatestRecords(records, CodeVersion());
  SortRows(&records);  // in the store they stand as they ended
  SetDoubts(&records);
  return records;
}

std::vector<Record> LoadRecords(const std::filesystem::path& store, const Selection& where,
                                const ReadWatch& watch) {
  const std::filesystem::path file = StoreFile(store);
  const Room room(store);
  if (IsLarge(file) && !ChoosesLines(where)) {
    room.Require("all its records", std::filesystem::file_size(file));
  }
  std::vector<std::string> warnings;
  const auto look = [&](std::size_t records, std::uint64_t bytes) {
    if (watch) watch(records, bytes);
    room.Require(fmt::format("{} records and more", records), bytes);
  };
  std::vector<Record> records = Prepared(ReadRecords(store, where, &warnings, look));
  for (const std::string& warning : warnings) PrintError("warning: {}\n", warning);
  return records;
}

namespace {

std::size_t CountLines(const std::filesystem::path& file) {
  std::ifstream lines(file, std::ios::binary);
  return static_cast<std::size_t>(
      std::count(std::istreambuf_iterator<char>(lines), std::istreambuf_iterator<char>(), '\n'));
}

/// The records of these cases, as they were asked for: what the store holds besides is another
/// command's.
std::vector<Record> RecordsOf(const std::vector<std::string>& ids,
                              const std::vector<Record>& records) {
  std::map<std::string, const Record*> last;
  for (const Record& record : records) last[record.Text("id")] = &record;
  std::vector<Record> asked;
  for (const std::string& id : ids) asked.push_back(*last.at(id));
  return WithContents(std::move(asked));
}

void PrintInterrupted(const RunCommand& command, const ResultStore& store) {
  PrintError(
      "interrupted: {} records are kept in {}, {} of them of this run; cases under way were "
      "stopped "
      "and left nothing, tables were not written\n",
      CountLines(store.file()), store.file().string(), store.appended());
  if (command.suite.rerun == Rerun::kAll) {
    PrintError("to go on, without those that were run again: the same command with --rerun none\n");
  } else {
    PrintError("to go on: {}\n", command.again);
  }
}

}  // namespace

int Run(const RunCommand& command, const std::string& typed) {
  // read everything first: a mistake in the last file must not cost the runs of the first
  Workload workload({command.experiments, command.settings, command.suite.filter, command.threads},
                    command.suite.shard);
  if (workload.is_long() && !command.gate.empty()) {
    throw ConfigError(fmt::format(
        "--gate {}: found a sweep of more than {} combinations, whose records are not held at "
        "once; judge parts of it: loopbench table STORE --where ... --gate {}",
        command.gate, kLongSweep, command.gate));
  }
  RequirePeers(workload.some());
  if (command.suite.precision) {
    for (const Experiment& experiment : workload.some()) RequireLadders(experiment);
  }
  if (command.suite.accuracy) {
    for (const Experiment& experiment : workload.some()) RequireReferences(experiment);
  }
  const std::filesystem::path out =
      command.out.empty() ? std::filesystem::path("results/runs") / FileName(workload.first().name)
                          : command.out;
  SuiteCount count;
  {
    ResultStore store(out, command.wait);
    FinishedRuns finished(out);
    try {
      count = RunSuite(workload, command.suite, finished, store);
    } catch (const Interrupted& interrupted) {
      PrintInterrupted(command, store);
      return interrupted.exit_code();
    }
    PrintError(
        "{} run now{}{}, {} were done before\n", count.run,
        count.failed > 0 ? fmt::format(" ({} not finished)", count.failed) : "",
        count.processes < count.pieces ? fmt::format(" in {} processes", count.processes) : "",
        count.skipped);
  }
  if (workload.is_long()) {
    Print(
        "results in {}\nNo tables were written: a long sweep's are chosen from it, as by\n"
        "  loopbench table {} --where mechanism={}\n",
        out.string(), out.string(), workload.first().scenes.front().name);
    return 0;
  }
  std::vector<Record> records = RecordsOf(count.ids, ReadRecords(out));
  SetDoubts(&records);
  WriteTables(records, out, typed);
  Print("results in {}\n", out.string());
  return command.gate.empty() ? 0 : DoubtGate(records);
}

int Merge(const MergeCommand& command) {
  NewStore target(command.out);
  const MergedStores merged(command.stores, command.order);
  if (!merged.missing().empty()) {
    PrintError(
        "{}: {} of {} cases are in no part, {} among them; nothing was merged. The experiment, its "
        "mechanisms or the program are not what they were when the parts ran\n",
        target.file().string(), merged.missing().size(), command.order.size(),
        merged.missing().front());
    return 1;
  }
  std::vector<std::filesystem::path> files;
  for (const auto& store : command.stores) files.push_back(StoreFile(store));
  // references that stand where the store will be are one more part
  std::vector<std::filesystem::path> with_target = files;
  with_target.push_back(target.file());
  const MergedReferences references = MergeReferences(with_target);
  std::set<std::string> scenes;
  for (std::size_t i = 0; i < merged.size(); ++i) {
    const Record record = merged[i];
    std::vector<std::filesystem::path> owners;
    for (const auto& store : merged.StoresOf(i)) owners.push_back(StoreFile(store));
    for (const std::string& name : CopyTrajectories({record}, owners, target.file())) {
      PrintError("warning: no store has trajectories/{} as the run that is kept wrote it\n", name);
    }
    if (scenes.insert(record.Text("scene_id")).second) {
      CopyMechanisms({record}, files, target.file());
    }
    target.Append(record);
  }
  WriteReferences(references, target.file());
  target.Commit();
  for (const std::string& note : references.notes) PrintError("{}\n", note);
  Print("{} records of {} stores are {} cases in {}\n", merged.read(), command.stores.size(),
        merged.size(), target.file().string());
  if (!references.texts.empty()) {
    Print("{} references beside it\n", references.texts.size());
  }
  return 0;
}

int PrintVerdicts(const VerdictCommand& command, const std::string& typed) {
  const std::vector<Record> records = LoadRecords(command.store);
  RequireOneContent(records, command.store, "verdict");
  std::vector<ClaimResult> results;
  for (const ClaimRule& rule : ReadClaims(command.claims)) {
    results.push_back(Evaluate(rule, records));
  }
  if (!command.out.empty()) {
    WriteFileAtomically(command.out, ClaimsMarkdown(results, Provenance(typed)));
  }
  Table verdicts = VerdictTable(results);
  verdicts.notes = Provenance(typed);
  PrintText(ToScreen(verdicts) + "\n");
  if (!command.out.empty()) Print("wrote {}\n", command.out.string());
  return 0;
}

}  // namespace loopbench::harness
