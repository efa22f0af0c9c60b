// A history in a folder of its own, and what is added to it.
#pragma once

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/history/history.h"
#include "tests/harness/records.h"

namespace loopbench::harness::history_test {

namespace fs = std::filesystem;

inline Record Measured(const std::string& mechanism, double drift, std::int64_t steps,
                       const std::vector<double>& times = {}) {
  Record record = RecordOf("kind", "accuracy", "mechanism", mechanism, "outcome", "finished",
                           "steps", steps, "drift_position_max", drift);
  if (!times.empty()) record.Set("series.wall_s", times);
  record.Set("series.t", std::vector<double>{0.0, 1.0});
  record.Set("warnings", std::string());
  Stamp(record);
  return record;
}

inline std::string CommitName(int number) {
  std::string digits = std::to_string(number);
  return std::string(40 - digits.size(), '0') + digits;  // as long as git's
}
inline std::string Date(int number) {
  const auto two = [](int value) { return (value < 10 ? "0" : "") + std::to_string(value); };
  return "2026-" + two(1 + number / 28) + "-" + two(1 + number % 28) + "T12:00:00Z";
}

class HistoryOf : public testing::Test {
 protected:
  HistoryEntry Add(int number, const std::vector<Record>& records, bool replaces = false) {
    return AddToHistory(folder_, {.commit = CommitName(number), .date = Date(number)}, records,
                        replaces);
  }
  std::string Refusal(const HistoryEntry& entry, const std::vector<Record>& records) {
    const std::string message =
        MessageOf<std::exception>([&] { AddToHistory(folder_, entry, records, false); });
    return message.empty() ? "taken" : message;
  }

  const TemporaryFolder temporary_{"loopbench-history"};
  const fs::path folder_ = temporary_.path() / "history";
};

}  // namespace loopbench::harness::history_test
