#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/observers/trajectory.h"
#include "harness/run/processes.h"
#include "harness/run/run.h"
#include "harness/run/timing.h"
#include "harness/suite/suite.h"
#include "mechanism/algebra/lanes.h"

namespace loopbench::harness {

namespace {

constexpr const char* kClear = "\r\033[K";  // clears the present line

double SecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

Progress::Progress(std::string what, std::vector<Piece> pieces, int jobs)
    : what_(std::move(what)),
      pieces_(std::move(pieces)),
      jobs_(jobs),
      is_seen_(IsSeen()),
      begin_(Clock::now()) {
  double known = 0.0;
  std::size_t count = 0;
  for (const Piece& piece : pieces_) {
    if (std::isnan(piece.estimate_s)) continue;
    known += piece.estimate_s;
    ++count;
  }
  for (Piece& piece : pieces_) {
    if (!std::isnan(piece.estimate_s)) continue;
    piece.estimate_s = count > 0 ? known / static_cast<double>(count) : 0.0;
  }
  waiting_s_ =
      std::accumulate(pieces_.begin(), pieces_.end(), 0.0,
                      [](double sum, const Piece& piece) { return sum + piece.estimate_s; });
  Draw();
}

Progress::~Progress() {
  if (is_seen_) PrintErrorText(kClear);
}

bool Progress::IsSeen() { return ErrorScreen().width > 0; }

void Progress::Start(std::size_t piece) {
  running_.push_back({piece, Clock::now()});
  waiting_s_ -= pieces_[piece].estimate_s;
  Draw();
}

void Progress::Done(std::size_t piece) {
  const auto at = std::ranges::find(running_, piece, &Running::piece);
  ++done_;
  taken_s_ += SecondsSince(at->begin);
  foreseen_s_ += pieces_[piece].estimate_s;
  running_.erase(at);
  Draw();
}

void Progress::Look() {
  if (is_seen_ && SecondsSince(drawn_) >= 1.0) Draw();
}

double Progress::SecondsToGo() const {
  if (foreseen_s_ + waiting_s_ + (running_.empty() ? 0.0 : pieces_[running_[0].piece].estimate_s) <=
      0.0) {
    // without estimates all pieces are assumed equal
    if (done_ == 0) return -1.0;
    return SecondsSince(begin_) * static_cast<double>(pieces_.size() - done_) /
           static_cast<double>(done_);
  }
  const double factor = foreseen_s_ > 0.0 ? taken_s_ / foreseen_s_ : 1.0;
  double left = factor * waiting_s_;
  for (const Running& running : running_) {
    left += std::max(0.0, factor * pieces_[running.piece].estimate_s - SecondsSince(running.begin));
  }
  return left / std::min<double>(jobs_, static_cast<double>(pieces_.size() - done_));
}

void Progress::Draw() {
  if (!is_seen_ || done_ == pieces_.size()) return;
  drawn_ = Clock::now();
  const double left = SecondsToGo();
  std::string line =
      fmt::format("{} {}/{}  elapsed {:.0f} s", what_, done_, pieces_.size(), SecondsSince(begin_));
  if (left >= 0.0) line += fmt::format(", about {:.0f} s left", std::ceil(left));
  if (!running_.empty()) {
    const Running& oldest = running_.front();
    line +=
        fmt::format("  now {} ({:.0f} s)", pieces_[oldest.piece].label, SecondsSince(oldest.begin));
    if (running_.size() > 1) line += fmt::format(" and {} more", running_.size() - 1);
  }
  // one line; some terminals begin a new line after writing the last cell
  const std::size_t room = std::max<std::size_t>(ErrorScreen().width, 3) - 1;
  PrintErrorText(kClear + std::string(Beginning(EscapeTerminal(line), room)));
}
namespace {

/// Returns the expected cost: expensive cases run first, so that none runs alone at the end.
double CostOf(const Case& entry) { return entry.ensemble * ExpectedSteps(entry); }

constexpr double kPatience = 2.0, kGrace_s = 2.0;  ///< LimitsOfRuns
constexpr double kRecording_s = 30.0;              ///< for recordings, which no run counts

}  // namespace

ProcessLimits LimitsOfRuns(const Limits& limits, double runs) {
  return {.cpu_s = kPatience * runs * limits.cpu_s + kGrace_s, .memory_mb = limits.memory_mb};
}

Piece AccuracyPiece(const Experiment& experiment, const Case& entry,
                    const std::filesystem::path& store) {
  const int runs = entry.ensemble > 1 ? entry.ensemble + 1 : 1;
  std::filesystem::path trajectory;
  if (experiment.output) trajectory = TrajectoryPath(store, RunId(entry.keys));
  const auto work = [&experiment, entry, store, trajectory](int threads, SideBySide* beside) {
    const std::optional<Reference> reference = FindReference(experiment, entry, store);
    Record record =
        RunCase(experiment, entry, reference ? &*reference : nullptr, trajectory, threads, beside);
    if (reference && !reference->snapshots.empty()) {
      record.Set("reference_file", ReferenceOf(experiment, entry, store).id);
    }
    return std::vector<Record>{std::move(record)};
  };
  ProcessLimits limits = LimitsOfRuns(entry.limits, runs * entry.method.threads);
  if (IsGenerated(entry.method.execution)) limits.cpu_s += kRecording_s;
  // of an ensemble the members share calls; fused code may have other bits in lanes than alone
  const bool has_lanes = entry.method.execution == Execution::kGenerated && runs == 1;
  return {
      .owed = {entry.keys},
      .work = work,
      .limits = limits,
      .label = fmt::format("{} {} {}", entry.mechanism, ToString(entry.method), SettingOf(entry)),
      .cost = CostOf(entry),
      .lanes = has_lanes ? fmt::format("{} {} {}", entry.mechanism, ToString(entry.method),
                                       entry.integrator)
                         : "",
      .trajectory = trajectory};
}

Piece ReferencePiece(const Experiment& experiment, const ReferenceCase& reference) {
  Limits limits = experiment.limits;
  if (experiment.reference) limits.cpu_s = experiment.reference->cpu_s;
  constexpr double kWitnesses = 3.0;
  return {
      .owed = {reference.keys},
      .work = [&experiment, reference](
                  int, SideBySide*) { return std::vector<Record>{MakeOne(experiment, reference)}; },
      .limits = LimitsOfRuns(limits, kWitnesses),
      .label = fmt::format("{} {} s", reference.keys.Text("mechanism"), reference.horizon),
      .cost = reference.horizon,
      .product = reference.file};
}

Piece TimingPiece(const Experiment& experiment, const TimingGroup& group) {
  Piece piece;
  for (const Case& entry : group.cases) piece.owed.push_back(entry.keys);
  // the first method is timed twice (record.h)
  const int methods = static_cast<int>(group.cases.size()) + 1;
  int threads = 1;
  for (const Case& entry : group.cases) threads = std::max(threads, entry.method.threads);
  const int runs = methods * (experiment.timing.repeats + 1) * threads;
  // right-hand sides have no limit; a minute per method is ample
  constexpr double kDerivatives_s = 60.0;
  piece.limits = {kPatience * runs * experiment.limits.cpu_s + kDerivatives_s * methods * threads,
                  experiment.limits.memory_mb};
  piece.work = [&experiment, &group](int, SideBySide*) { return TimeTogether(experiment, group); };
  piece.label = group.name;
  return piece;
}

Piece LadderPiece(const Experiment& experiment, const LadderGroup& group) {
  const auto runs = static_cast<double>(group.keys.size() + 1);  // there are two references
  return {
      .owed = group.keys,
      .work = [&experiment, &group](int, SideBySide*) { return ClimbTogether(experiment, group); },
      .limits = LimitsOfRuns(experiment.limits, runs),
      .label =
          fmt::format("{} {}", group.keys.front().Text("mechanism"), ToString(group.task.method))};
}

std::vector<Record> RecordsOf(const Piece& piece, const ProcessResult& result,
                              const std::string& set) {
  std::vector<Record> records;
  std::string outcome(OutcomeOf(result.ending)), message = result.text;
  if (result.ending == ProcessEnding::kThrew) message = "threw: " + message;
  if (result.ending == ProcessEnding::kAnswered) {
    outcome = "invalid-result";
    message = "the output of its process is not a record of this case";
    try {
      for (std::size_t start = 0; start < result.text.size();) {
        const std::size_t end = std::min(result.text.find('\n', start), result.text.size());
        records.push_back(FromJsonLine(std::string_view(result.text).substr(start, end - start)));
        start = end + 1;
      }
    } catch (const std::runtime_error&) {
      records.clear();
    }
  }
  const auto same_case = [](const Record& a, const Record& b) {
    return a.Text("case_id") == b.Text("case_id");
  };
  const bool good = std::ranges::equal(records, piece.owed, same_case);
  if (!good) records = piece.owed;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!good) {
      records[i].Set("outcome", outcome);
      records[i].Set("message", message);
      records[i].Set("wall_s", result.wall_s);
      records[i].Set("cpu_s", result.cpu_s);
    }
    records[i].Set("id", RunId(piece.owed[i]));
    records[i].Set("version", CodeVersion());
    if (!set.empty()) records[i].Set("set", set);
    records[i].Set("experiment_index", piece.experiment);
    Stamp(records[i]);
  }
  return records;
}
namespace {

/// Estimates run times only if a progress display is visible.
std::vector<Progress::Piece> EstimatedTasks(const std::vector<Piece>& pieces, Estimate* estimate) {
  std::vector<Progress::Piece> foreseen;
  for (const Piece& piece : pieces) {
    foreseen.push_back({piece.label, Progress::IsSeen()
                                         ? piece.seconds(*estimate)
                                         : std::numeric_limits<double>::quiet_NaN()});
  }
  return foreseen;
}

/// Returns all records, one per line (child process).
std::string AnswerOf(const Piece& piece, SideBySide* beside) {
  if (const auto garbage = PlantedFault(piece.owed.front())) return *garbage;
  std::string text;
  for (const Record& record : piece.work(piece.threads, beside)) text += ToJsonLine(record) + '\n';
  return text;
}

/// Returns the answers of pieces, side by side where they share calls (child process).
std::vector<std::string> AnswersOf(const std::vector<Piece>& pieces,
                                   const std::vector<std::size_t>& asked) {
  std::vector<std::string> answers(asked.size());
  const auto has_lanes = [&](std::size_t i) { return !pieces[i].lanes.empty(); };
  const auto answer = [&](int k, SideBySide* beside) {
    const Piece& piece = pieces[asked[static_cast<std::size_t>(k)]];
    answers[static_cast<std::size_t>(k)] = AnswerOf(piece, piece.lanes.empty() ? nullptr : beside);
  };
  const int count = static_cast<int>(asked.size());
  if (count > 1 && std::ranges::any_of(asked, has_lanes)) {
    RunSideBySide(count, 1, [&](int k, SideBySide& beside) { answer(k, &beside); });
  } else {
    for (int k = 0; k < count; ++k) answer(k, nullptr);
  }
  return answers;
}

}  // namespace

std::vector<Piece> Runner::NotAsked(std::vector<Piece> pieces) {
  // a case of two files runs once
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
  std::ranges::stable_sort(pieces, [](const Piece& a, const Piece& b) {
    return std::pair(-a.cost, std::string_view(a.lanes)) <
           std::pair(-b.cost, std::string_view(b.lanes));
  });
  std::size_t failed = 0;
  std::erase_if(pieces, [&](const Piece& piece) {
    if (!Done(piece, &failed)) return false;
    count.skipped += piece.owed.size();
    return true;
  });
  if (pieces.empty()) return failed;
  // spare jobs become threads of the ensembles
  const int free = std::max(1, jobs / static_cast<int>(pieces.size()));
  for (Piece& piece : pieces) piece.threads = free;
  Progress progress(what, EstimatedTasks(pieces, estimate), jobs);
  const auto work = [&](const std::vector<std::size_t>& asked) {
    store_.LeaveToParent();
    return AnswersOf(pieces, asked);
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
    for (const TaskResult& result : ended) progress.Done(result.task);
  };
  const auto together = [&](std::size_t first) -> std::size_t {
    const std::string& lanes = pieces[first].lanes;
    std::size_t last = first + 1;
    const std::size_t most =
        std::min(pieces.size(), first + static_cast<std::size_t>(kLanes * jobs));
    while (!lanes.empty() && last < most && pieces[last].lanes == lanes) ++last;
    return (last - first - 1) / static_cast<std::size_t>(jobs) + 1;
  };
  const auto started = [&](std::size_t i) { progress.Start(i); };
  const auto waited = [&] { progress.Look(); };
  if (shared) {
    count.processes +=
        RunInSharedProcesses(pieces.size(), jobs, work, limits, keep, {together, started, waited});
  } else {
    count.processes += pieces.size();
    const auto before_fork = [&](std::size_t i) {
      CalibrationNs();  // calibrates the machine speed for timings
      return limits(i);
    };
    RunInProcesses(
        pieces.size(), jobs, [&](std::size_t i) { return work({i}).front(); }, before_fork,
        [&](std::size_t i, const ProcessResult& result) {
          keep({{i, result}});
        },
        {.started = started, .waited = waited});
  }
  count.pieces += pieces.size();
  return failed;
}

}  // namespace loopbench::harness
