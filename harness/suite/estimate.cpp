#include <cmath>
#include <cstring>
#include <exception>
#include <numeric>
#include <set>
#include <sstream>

#include "harness/base/text.h"
#include "harness/judge/analysis.h"
#include "harness/run/run.h"
#include "harness/suite/suite.h"
#include "mechanism/start/assembly.h"

#ifdef LOOPBENCH_PRECISIONS
#include "harness/precision/make_reference.h"
#endif

namespace loopbench::harness {

/// Result of a pilot.
struct PilotCost {
  double all_s = 0.0, running_s = 0.0;  ///< CPU time, total and proportional to the horizon
  double reached = 1.0;                 ///< part reached [of the horizon]
  double members_s = 0.0;               ///< CPU time of the ensemble members in addition
  double member = 1.0;                  ///< as in Rate
  bool failed = false;                  ///< true: it stopped here, and the piece will too
  double most_s = std::numeric_limits<double>::infinity();  ///< CPU time at the step limit
};

namespace {

constexpr double kFirst = 0.02, kGrowth = 3.0;  ///< first part of the horizon, and its growth
constexpr double kMinSlope = 0.2;               ///< minimum slope, relative to the mean
constexpr std::size_t kCombinations = 8;        ///< pilots of a sweep; others use the nearest
constexpr double kNearlyAll = 0.999;            ///< part reached by a reference without certificate
constexpr int kMembers = 16;                    ///< pilot members of an ensemble
constexpr double kShort_s = 0.1;                ///< too short for a pilot at each tolerance
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kClear = "\r\033[K";  // clears the present line

double Longest(const Experiment& experiment, std::size_t problem) {
  return std::ranges::max(experiment.problems[problem].horizons);
}

double NumberOfRuns(const Case& one) { return static_cast<double>(RunsOf(one)); }

Rate Next(const Rate& before, const PilotCost& spent) {
  const double reached = std::max(spent.reached, 1e-9), mean = spent.running_s / reached;
  const double grown = reached - before.reached;
  // clocks are coarse, and a single step matters in a short run
  const double slope = grown > 0.0 ? (spent.running_s - before.running_s) / grown : mean;
  return {.fixed_s = std::max(0.0, spent.all_s - spent.running_s),
          .member = spent.member,
          .running_s = spent.running_s,
          .reached = reached,
          .slope_s = std::clamp(slope, kMinSlope * mean, mean / kMinSlope),
          .ends_at = spent.failed ? reached : 1.0,
          .most_s = spent.most_s};
}

/// Prefix of a fault in an answer; other answers are lines of warnings.
constexpr char kFault = '!';

template <class Space>
std::string AnswerIn(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  if (start.outcome == Outcome::kInconsistentStart) return kFault + start.message;
  std::string lines;
  for (const auto& find : {FindGuessWarnings, FindForceWarnings}) {
    for (const std::string& warning : find(description, start.q)) lines += warning + '\n';
  }
  return lines;
}

/// Returns faults and warnings of a start. A locked start is assembled: immobility is a result.
std::string Answer(const MechanismDescription& description) {
  return description.space == SpaceKind::kPlanar ? AnswerIn<Planar>(description)
                                                 : AnswerIn<Spatial>(description);
}

std::string AnswerOfProblem(const Experiment& experiment, const MechanismFile& file) {
  const SimplifiedProblem problem =
      SimplifyProblem(file.description, file.observe, experiment.compile);
  std::string lines;
  for (const CompiledPart& part : problem.compiled.parts) {
    std::string answer = Answer(part.description);
    if (answer.starts_with(kFault)) return answer;
    lines += answer;
  }
  return lines;
}

StartReport ReportOf(const ProcessLimits& limits, const std::function<std::string()>& answer) {
  StartReport report;
  const ProcessResult result = RunInProcess(limits, answer);
  if (result.ending != ProcessEnding::kAnswered) {
    report.faults = {
        fmt::format("its start was not assembled ({}): {}", OutcomeOf(result.ending), result.text)};
  } else if (result.text.starts_with(kFault)) {
    report.faults = {
        fmt::format("found a start that cannot be assembled ({}), expected one from which every "
                    "loop closes",
                    result.text.substr(1))};
  } else {
    std::istringstream lines(result.text);
    for (std::string line; std::getline(lines, line);) report.warnings.push_back(line);
  }
  return report;
}

}  // namespace

std::size_t Estimate::Nearest(std::size_t experiment) const {
  const std::size_t count = experiments_.size();
  if (count <= kCombinations) return experiment;
  const double step = static_cast<double>(count - 1) / (kCombinations - 1);
  return static_cast<std::size_t>(
      std::round(std::round(static_cast<double>(experiment) / step) * step));
}

/// Returns the finest and loosest tolerance of the cases that pass the filter; {1, 0} without any.
const std::pair<double, double>& Estimate::Tolerances(std::size_t experiment) {
  const auto [known, is_new] = tolerances_.try_emplace(experiment, 1.0, 0.0);
  if (!is_new) return known->second;
  auto& [fine, loose] = known->second;
  for (const Case& one : Expand(experiments_[experiment])) {
    if (one.step > 0.0 || !Matches(one.keys, filter_)) continue;
    fine = std::min(fine, one.rtol);
    loose = std::max(loose, one.rtol);
  }
  return known->second;
}

/// @param times  number of repetitions of the pilot's work in the piece
const Rate* Estimate::Known(const std::string& key, const std::string& name,
                            const ProcessLimits& limits, double times,
                            const std::function<PilotCost(double fraction)>& work) {
  if (const auto known = rates_.find(key); known != rates_.end()) return &known->second;
  if (spent_s_ >= budget_.all_s) return nullptr;
  // later pilots are shorter: hundreds of them then take a minute or two in total
  const double shorter = budget_.usual_s / (budget_.usual_s + spent_s_);
  const double most_s = std::max(budget_.least_s, budget_.most_s * shorter * shorter);
  const auto pilot = [&] {
    Rate rate = {.running_s = 0.0, .reached = 0.0};
    double worked = 0.0;
    for (double fraction = kFirst;; fraction = std::min(1.0, kGrowth * fraction)) {
      const PilotCost spent = work(fraction);
      rate = Next(rate, spent);
      worked += spent.all_s + spent.members_s;
      const double enough = std::clamp(budget_.share * times * (rate.fixed_s + rate.Running(1.0)),
                                       budget_.least_s, most_s);
      if (spent.failed || fraction >= 1.0 || spent.all_s >= enough) {
        rate.process_s = worked;
        return std::string(reinterpret_cast<const char*>(&rate), sizeof(Rate));
      }
    }
  };
  Rate& rate = rates_[key];
  const double before = ThreadCpuSeconds();
  const ProcessResult result = RunInProcess(limits, pilot);
  spent_s_ += result.wall_s;
  if (result.ending == ProcessEnding::kAnswered && result.text.size() == sizeof(Rate)) {
    static_assert(std::is_trivially_copyable_v<Rate>);
    std::memcpy(&rate, result.text.data(), sizeof(Rate));
    // starting a process costs CPU time of its parent and of itself
    rate.process_s = std::max(0.0, result.cpu_s - rate.process_s) + ThreadCpuSeconds() - before;
  } else {
    rate = {.fixed_s = result.cpu_s};
    cut_off_.push_back(fmt::format("{}: {}, {}", name, OutcomeOf(result.ending), result.text));
  }
  return &rate;
}

/// Returns a folder, or "" on errors: an estimate without output costs is better than none.
std::filesystem::path Estimate::PlaceForRows() {
  try {
    if (written_ == nullptr) written_ = std::make_shared<TemporaryFolder>("loopbench-plan");
    return written_->path() / "rows.csv";
  } catch (const std::exception&) {
    return {};
  }
}

/// @param rtol  0 for fixed steps, where the longest step is used
const Rate* Estimate::RateOfCase(std::size_t experiment, const Case& one, double rtol) {
  const Experiment& like = experiments_[experiment];
  const std::size_t problem =
      std::min(one.problem, like.problems.size() - 1);  // a sweep's may differ
  const std::string method = ToString(one.method);
  const auto rows = like.output ? PlaceForRows() : std::filesystem::path();
  const auto run = [&](double fraction) {
    Case pilot = one;
    pilot.problem = problem;
    pilot.ensemble = 1;
    if (rtol > 0.0 && pilot.atol == pilot.rtol) pilot.atol = rtol;
    if (rtol > 0.0) pilot.rtol = rtol;
    if (pilot.step > 0.0) pilot.step = std::ranges::max(like.fixed_steps);
    pilot.horizon = fraction * Longest(like, problem);
    pilot.limits.cpu_s = std::min(budget_.most_s, one.limits.cpu_s);
    const double begin_s = ThreadCpuSeconds();
    const Record record = RunCase(like, pilot, nullptr, rows);
    const double reached = record.Number("t_reached"), running = record.Number("cpu_s");
    const bool ended = record.Text("outcome") != ToString(Outcome::kFinished);
    PilotCost spent = {.all_s = ThreadCpuSeconds() - begin_s,
                       .running_s = std::isnan(running) ? 0.0 : running};
    // rows at a fixed distance and second runs grow with the horizon, a fixed number of rows not
    const bool is_refined = record.Find("refinement_difference") != nullptr;
    if (is_refined || (like.output && like.output->number == 0)) spent.running_s = spent.all_s;
    spent.reached = std::isnan(reached) ? 0.0 : fraction * reached / pilot.horizon;
    const double steps = record.Number("steps");
    if (steps > 0.0) {
      spent.most_s = spent.running_s * static_cast<double>(pilot.limits.steps) / steps;
    }
    spent.failed = ended && record.Text("outcome") != ToString(Outcome::kTimeLimit);
    if (one.ensemble > 1) {
      pilot.ensemble = std::min(one.ensemble, kMembers);
      const double members_begin_s = ThreadCpuSeconds();
      RunCase(like, pilot);
      spent.members_s = ThreadCpuSeconds() - members_begin_s;
      const double each_s = (spent.members_s - spent.all_s) / pilot.ensemble;
      spent.member = std::clamp(each_s / spent.all_s, 0.0, 1.0);
    }
    return spent;
  };
  return Known(fmt::format("case/{}/{}/{}/{}/{}/{}/{}", experiment, problem, method, one.integrator,
                           rtol, one.step > 0.0, one.ensemble > 1),
               fmt::format("{} {}", like.problems[problem].name, method),
               LimitsOfRuns(one.limits, one.method.threads), NumberOfRuns(one), run);
}

double Estimate::OfCase(std::size_t experiment, const Case& one, double simulations) {
  const std::size_t near = Nearest(experiment);
  const Experiment& like = experiments_[near];
  const double part = one.horizon / Longest(like, std::min(one.problem, like.problems.size() - 1));
  const auto total = [&](const Rate& rate, double scale) {
    const double running = rate.Running(part) * scale;
    if (simulations > 0.0) return rate.fixed_s + simulations * std::min(running, one.limits.cpu_s);
    const double runs = 1.0 + (NumberOfRuns(one) - 1.0) * rate.member;
    return rate.process_s + runs * (rate.fixed_s + std::min(running, one.limits.cpu_s));
  };
  if (one.step > 0.0) {
    const Rate* rate = RateOfCase(near, one, 0.0);
    return rate == nullptr ? kUnknown : total(*rate, std::ranges::max(like.fixed_steps) / one.step);
  }
  const auto& range = Tolerances(near);
  const auto [fine, loose] = range.first > range.second  // otherwise the tolerance of the timings
                                 ? std::pair(one.rtol, one.rtol)
                                 : range;
  const Rate* at_loose = RateOfCase(near, one, loose);
  if (at_loose == nullptr) return kUnknown;
  const double usual = std::pow(one.rtol / loose, -0.2);  // for methods of order 5
  if (NumberOfRuns(one) * at_loose->Running(1.0) * std::pow(fine / loose, -0.2) < kShort_s) {
    return total(*at_loose, usual);
  }
  const Rate* at_fine = RateOfCase(near, one, fine);
  if (at_fine == nullptr) return total(*at_loose, usual);
  // the nearer tolerance determines where a run fails
  const double share = fine < loose ? std::log(one.rtol / loose) / std::log(fine / loose) : 0.0;
  const Rate& rate = share < 0.5 ? *at_loose : *at_fine;
  const double ratio = at_fine->Running(part) / at_loose->Running(part);
  const bool known = ratio > 0.0 && std::isfinite(ratio);
  return total(rate, known ? std::pow(ratio, share < 0.5 ? share : share - 1.0) : 1.0);
}

/// Estimates a reference. The cheapest method is tried over the whole horizon if that is short
/// work; if it is not certified to the end, the furthest-reaching method is tried over a part.
double Estimate::OfReference(std::size_t experiment, const ReferenceCase& one) {
  const Experiment& own = experiments_[experiment];
  if (!own.reference) return 0.0;  // a published series is only read
#ifdef LOOPBENCH_PRECISIONS
  const MechanismDescription& user = own.problems[one.problem].mechanism.description;
  const auto known = [&](WaysTried tried, const char* name, double times) {
    const auto run = [&, tried](double fraction) -> PilotCost {
      ReferenceOptions options = *own.reference;
      options.points = std::max(2, static_cast<int>(fraction * options.points));
      const double horizon = fraction * one.horizon;
      const double begin_s = ThreadCpuSeconds();
      const Reference reference = MakeReference(user, horizon, LinkLength(user), options, tried);
      return {.all_s = ThreadCpuSeconds() - begin_s,
              .running_s = reference.cpu_s,
              .reached = fraction * (reference.trust_horizon < horizon ? kNearlyAll : 1.0),
              .failed = reference.trust_horizon < horizon};
    };
    return Known(std::string(name) + one.id, one.keys.Text("mechanism"),
                 {.cpu_s = 4.0 * own.reference->cpu_s, .memory_mb = own.limits.memory_mb}, times,
                 run);
  };
  const auto total = [&](const Rate& rate) {
    return rate.fixed_s + std::min(rate.Running(1.0), kWitnesses * own.reference->cpu_s);
  };
  const Rate* cheapest = known(WaysTried::kCheapest, "cheapest/", 1.0 / budget_.share);
  if (cheapest == nullptr) return kUnknown;
  if (cheapest->ends_at >= 1.0) return total(*cheapest);
  const Rate* furthest = known(WaysTried::kFurthest, "furthest/", 1.0);
  return furthest == nullptr ? kUnknown : total(*cheapest) + total(*furthest);
#else
  return 0.0;
#endif
}

double Estimate::OfLadder(std::size_t experiment, const LadderGroup& group) {
  const Experiment& own = experiments_[experiment];
  const auto run = [&](double fraction) -> PilotCost {
    LadderGroup part = group;
    part.task.horizon *= fraction;
    const double begin_s = ThreadCpuSeconds();
    ClimbTogether(own, part);
    const double all_s = ThreadCpuSeconds() - begin_s;
    return {.all_s = all_s, .running_s = all_s, .reached = fraction};
  };
  const double runs = group.runs();
  const Rate* rate =
      Known("ladder/" + group.keys.front().Text("case_id"), group.keys.front().Text("mechanism"),
            LimitsOfRuns(own.limits, runs), 1.0, run);
  return rate == nullptr ? kUnknown
                         : rate->fixed_s + std::min(rate->Running(1.0), runs * own.limits.cpu_s);
}

/// Simulations take as long as accuracy runs; right-hand sides of families have pilots.
double Estimate::OfTiming(std::size_t experiment, const TimingGroup& group) {
  const Experiment& own = experiments_[experiment];
  const auto sum = [](const auto& rows, const auto& seconds) {
    double all = seconds(rows.front());  // the first method is timed twice (record.h)
    for (const auto& row : rows) all += seconds(row);
    return all;
  };
  if (group.simulate) {
    return sum(group.cases, [&](const Case& one) {
      const double runs = own.timing.repeats + 1.0;  // plus the warm-up run
      return OfCase(experiment, one, runs) + kBatches * kBatchSeconds;
    });
  }
  const auto run = [&](double) -> PilotCost {
    const double begin_s = ThreadCpuSeconds();
    const std::vector<Record> records = TimeTogether(own, group, 1);
    return {.all_s = ThreadCpuSeconds() - begin_s,
            .running_s = sum(records,
                             [](const Record& record) {
                               const double rhs_s = 1e-9 * record.Number("rhs_ns_median");
                               return kBatches *
                                      (rhs_s > 0.0 ? std::max(kBatchSeconds, 4.0 * rhs_s) : 0.0);
                             }),
            .failed = true};
  };
  const Rate* rate =
      Known("timing/" + group.cases.front().keys.Text("case_id"), group.name,
            LimitsOfRuns(own.limits, 2.0 * static_cast<double>(group.cases.size() + 1)), 1.0, run);
  return rate == nullptr ? kUnknown : rate->fixed_s + rate->Running(1.0);
}

StartReport CheckStart(const MechanismDescription& description, const ProcessLimits& limits) {
  return ReportOf(limits, [&] { return Answer(description); });
}

StartReport CheckStarts(const std::vector<Experiment>& experiments) {
  StartReport all;
  std::set<std::string> seen;
  for (std::size_t i = 0; i < experiments.size() && all.faults.empty(); ++i) {
    const Experiment& experiment = experiments[i];
    for (const ExperimentProblem& problem : experiment.problems) {
      const MechanismFile& file = problem.mechanism;
      if (!seen.insert(ToString(experiment.compile) + "\n" + file.canonical).second) continue;
      const StartReport report = ReportOf(LimitsOfRuns(experiment.limits, 1),
                                          [&] { return AnswerOfProblem(experiment, file); });
      std::string values = experiment.parameters.Described();
      if (!values.empty()) values = " (at " + values + ")";
      for (const std::string& fault : report.faults) {
        all.faults.push_back(fmt::format("problem \"{}\": {}{}", problem.name, fault, values));
      }
      for (const std::string& warning : report.warnings) {
        all.warnings.push_back(fmt::format("problem \"{}\": {}{}", problem.name, warning, values));
      }
    }
  }
  return all;
}

void RequireFreedom(const MechanismFile& file, const ProcessLimits& limits) {
  if (!file.observe.expected) return;
  const ProcessResult result = RunInProcess(limits, [&] {
    return FreedomFault(file.description, file.observe, AnalyseStructure(file.description));
  });
  if (result.ending != ProcessEnding::kAnswered) {
    throw ConfigError(fmt::format("{}: degrees of freedom were not counted ({}): {}",
                                  file.observe.expected->place, OutcomeOf(result.ending),
                                  result.text));
  }
  if (!result.text.empty()) throw ConfigError(result.text);
}

void RequireFreedom(const std::vector<Experiment>& experiments) {
  std::set<std::string> seen;
  for (const Experiment& experiment : experiments) {
    for (const ExperimentProblem& problem : experiment.problems) {
      if (!seen.insert(problem.mechanism.canonical).second) continue;
      RequireFreedom(problem.mechanism, LimitsOfRuns(experiment.limits, 1));
    }
  }
}

Progress::Progress(std::string what, std::vector<Piece> pieces, int jobs)
    : what_(std::move(what)), pieces_(std::move(pieces)), jobs_(jobs), is_seen_(IsSeen()) {
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
  running_.push_back({piece, WallSeconds()});
  waiting_s_ -= pieces_[piece].estimate_s;
  Draw();
}

void Progress::Done(std::size_t piece) {
  const auto at = std::ranges::find(running_, piece, &Running::piece);
  ++done_;
  taken_s_ += WallSeconds() - at->begin;
  foreseen_s_ += pieces_[piece].estimate_s;
  running_.erase(at);
  Draw();
}

void Progress::Look() {
  if (is_seen_ && WallSeconds() - drawn_ >= 1.0) Draw();
}

double Progress::SecondsToGo() const {
  if (foreseen_s_ + waiting_s_ + (running_.empty() ? 0.0 : pieces_[running_[0].piece].estimate_s) <=
      0.0) {
    // without estimates all pieces are assumed equal
    if (done_ == 0) return -1.0;
    return (WallSeconds() - begin_) * static_cast<double>(pieces_.size() - done_) /
           static_cast<double>(done_);
  }
  const double factor = foreseen_s_ > 0.0 ? taken_s_ / foreseen_s_ : 1.0;
  double left = factor * waiting_s_;
  for (const Running& running : running_) {
    left +=
        std::max(0.0, factor * pieces_[running.piece].estimate_s - (WallSeconds() - running.begin));
  }
  return left / std::min<double>(jobs_, static_cast<double>(pieces_.size() - done_));
}

void Progress::Draw() {
  if (!is_seen_ || done_ == pieces_.size()) return;
  drawn_ = WallSeconds();
  const double left = SecondsToGo();
  std::string line = fmt::format("{} {}/{}  elapsed {:.0f} s", what_, done_, pieces_.size(),
                                 WallSeconds() - begin_);
  if (left >= 0.0) line += fmt::format(", about {:.0f} s left", std::ceil(left));
  if (!running_.empty()) {
    const Running& oldest = running_.front();
    line += fmt::format("  now {} ({:.0f} s)", pieces_[oldest.piece].label,
                        WallSeconds() - oldest.begin);
    if (running_.size() > 1) line += fmt::format(" and {} more", running_.size() - 1);
  }
  // one line; some terminals begin a new line after writing the last cell
  const std::size_t room = std::max<std::size_t>(ErrorScreen().width, 3) - 1;
  PrintErrorText(kClear + std::string(Beginning(EscapeTerminal(line), room)));
}

}  // namespace loopbench::harness
