#include "harness/suite/runner.h"

#include <algorithm>
#include <limits>

#include "harness/isolation/shared_processes.h"
#include "harness/run/case_identity.h"
#include "harness/run/run_case.h"
#include "harness/suite/progress.h"
#include "harness/timing/yardstick.h"
#include "harness/trajectory/trajectory_writer.h"

namespace loopbench::harness {
namespace {

/// Pilots run only where somebody sees what they are for.
std::vector<Progress::Piece> Foreseen(const std::vector<Piece>& pieces, Estimate* estimate) {
  std::vector<Progress::Piece> foreseen;
  for (const Piece& piece : pieces) {
    foreseen.push_back({piece.label, Progress::IsSeen()
                                         ? piece.seconds(*estimate)
                                         : std::numeric_limits<double>::quiet_NaN()});
  }
  return foreseen;
}

}  // namespace

std::vector<Piece> Runner::NotAsked(std::vector<Piece> pieces) {
  // a case that two files share is one case
  std::erase_if(pieces, [this](const Piece& piece) {
    bool asked_before = true;
    for (const Record& owed : piece.owed) {
      const std::string id = RunId(owed);
      if (!asked_.insert(id).second) continue;
      asked_before = false;
      count.ids.push_back(id);
    }
    return asked_before;
  });
  return pieces;
}

bool Runner::Done(const Piece& piece, std::size_t* failed) {
  if (options_.rerun == Rerun::kAll) return false;
  if (!piece.product.empty() && !std::filesystem::exists(piece.product)) return false;
  std::size_t not_finished = 0;
  for (const Record& owed : piece.owed) {
    const std::optional<bool> finished = finished_.Find(RunId(owed));
    if (!finished || (!*finished && options_.rerun == Rerun::kFailed)) return false;
    not_finished += !*finished;
  }
  *failed += not_finished;
  return true;
}

std::size_t Runner::Run(const std::string& what, std::vector<Piece> all, int jobs, bool shared,
                        Estimate* estimate) {
  std::vector<Piece> pieces = NotAsked(std::move(all));
  std::ranges::stable_sort(pieces, std::greater<>(), &Piece::cost);
  std::size_t failed = 0;
  std::erase_if(pieces, [&](const Piece& piece) {
    if (!Done(piece, &failed)) return false;
    count.skipped += piece.owed.size();
    return true;
  });
  if (pieces.empty()) return failed;
  // jobs that no piece is left for share the ensembles
  const int free = std::max(1, jobs / static_cast<int>(pieces.size()));
  for (Piece& piece : pieces) piece.threads = free;
  Progress progress(what, Foreseen(pieces, estimate), jobs);
  const auto work = [&](std::size_t i) {
    store_.LeaveToParent();
    return AnswerOf(pieces[i]);
  };
  const auto limits = [&](std::size_t i) { return pieces[i].limits; };
  const auto keep = [&](const std::vector<TaskResult>& ended) {
    std::vector<Record> records;
    for (const auto& [i, result] : ended) {
      if (!pieces[i].trajectory.empty()) RemovePart(pieces[i].trajectory);
      for (Record& record : RecordsOf(pieces[i], result, options_.set)) {
        const bool is_finished = record.Text("outcome") == ToString(Outcome::kFinished);
        ++count.run;
        count.failed += !is_finished;
        failed += !is_finished;
        records.push_back(std::move(record));
      }
    }
    store_.Append(records);
    for (const TaskResult& one : ended) progress.Done(one.task);
  };
  const auto started = [&](std::size_t i) { progress.Start(i); };
  const auto waited = [&] { progress.Look(); };
  if (shared) {
    count.processes += RunInSharedProcesses(pieces.size(), jobs, work, limits, keep,
                                            {.started = started, .waited = waited});
  } else {
    count.processes += pieces.size();
    const auto before_fork = [&](std::size_t i) {
      YardstickNs();  // timings know by it how fast the machine has been
      return limits(i);
    };
    RunInProcesses(pieces.size(), jobs, work, before_fork,
                   [&](std::size_t i, const ProcessResult& result) {
                     keep({{i, result}});
                   },
                   {.started = started, .waited = waited});
  }
  count.pieces += pieces.size();
  return failed;
}

}  // namespace loopbench::harness
