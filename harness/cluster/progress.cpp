#include "harness/cluster/progress.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <unordered_map>

#include "harness/store/finished_runs.h"
#include "harness/store/store_lock.h"

namespace loopbench::harness {

PartProgress ProgressOfPart(const ClusterRun& run, const std::filesystem::path& folder, int part,
                            double now) {
  PartProgress progress;
  progress.part = part;
  progress.cases = run.cases[static_cast<std::size_t>(part - 1)];
  const auto store = PartFolder(folder, part);
  std::unordered_map<std::string, bool> finished;
  std::size_t lines = 0;
  std::ifstream file(store / "results.jsonl", std::ios::binary);
  for (std::string line; std::getline(file, line);) {
    if (file.eof()) break;  // no line end: it is being written
    ++lines;
    if (TextUnder("\"kind\":\"", line) != "accuracy") continue;
    finished[std::string(TextUnder("\"id\":\"", line))] =
        TextUnder("\"outcome\":\"", line) == "finished";
  }
  for (const auto& [id, is_finished] : finished) ++(is_finished ? progress.done : progress.failed);
  std::ifstream began(store / "started");
  double start = 0.0;
  std::size_t lines_then = 0;
  const bool has_begun = static_cast<bool>(began >> start >> lines_then);
  progress.state = IsDone(folder, part)                ? "done"
                   : !has_begun                        ? "waiting"
                   : IsLocked(store / "results.jsonl") ? "running"
                                                       : "stopped";
  if (has_begun && now > start && lines > lines_then) {
    progress.rate = static_cast<double>(lines - lines_then) / (now - start);
  }
  return progress;
}

double SecondsLeft(const ClusterRun& run, const std::vector<PartProgress>& parts) {
  double left = static_cast<double>(run.all_cases), rate = 0.0, longest = 0.0;
  for (const PartProgress& part : parts) {
    const auto there = static_cast<double>(part.done + part.failed);
    left -= there;
    if (part.state != "running" || part.rate == 0.0) continue;
    rate += part.rate;
    if (std::isfinite(part.cases)) longest = std::max(longest, (part.cases - there) / part.rate);
  }
  if (left <= 0.0) return 0.0;
  return rate > 0.0 ? std::max(longest, left / rate) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace loopbench::harness
