#include "harness/store/measurements.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "harness/store/files.h"
#include "harness/store/result_store.h"

namespace loopbench::harness {
namespace {

using RunJson = nlohmann::ordered_json;

/// What the library writes beside counters.
const std::set<std::string> kLibraryKeys = {"name",
                                            "family_index",
                                            "per_family_instance_index",
                                            "run_name",
                                            "run_type",
                                            "repetitions",
                                            "repetition_index",
                                            "threads",
                                            "iterations",
                                            "real_time",
                                            "cpu_time",
                                            "time_unit",
                                            "label",
                                            "error_occurred",
                                            "error_message"};

double NanosecondsPer(const std::string& unit) {
  if (unit == "us") return 1e3;
  if (unit == "ms") return 1e6;
  return unit == "s" ? 1e9 : 1.0;
}

double MedianOf(std::vector<double> sample) {
  std::ranges::sort(sample);
  const std::size_t n = sample.size();
  return n % 2 == 1 ? sample[n / 2] : 0.5 * (sample[n / 2 - 1] + sample[n / 2]);
}

/// All repetitions of one benchmark.
struct Repetitions {
  std::string name, error, label;
  std::vector<double> cpu_ns, real_ns;
  std::map<std::string, std::vector<double>> counters;

  void Add(const RunJson& run) {
    label = run.value("label", label);
    if (run.value("error_occurred", false)) {
      error = run.value("error_message", "an error without a message");
      return;
    }
    const double unit = NanosecondsPer(run.value("time_unit", "ns"));
    cpu_ns.push_back(run.at("cpu_time").get<double>() * unit);
    real_ns.push_back(run.at("real_time").get<double>() * unit);
    for (const auto& [key, value] : run.items()) {
      if (value.is_number() && !kLibraryKeys.contains(key)) {
        counters[key].push_back(value.get<double>());
      }
    }
  }

  Record ToRecord() const {
    Record record;
    record.Set("kind", std::string("benchmark"));
    record.Set("benchmark", name);
    record.Set("outcome", error.empty() ? std::string("finished") : error);
    if (!label.empty()) record.Set("start_hash", label);
    if (!error.empty() || cpu_ns.empty()) return record;
    record.Set("cpu_ns", MedianOf(cpu_ns));
    for (const auto& [key, values] : counters) record.Set(key, MedianOf(values));
    record.Set("series.cpu_ns", cpu_ns);
    record.Set("series.real_ns", real_ns);
    return record;
  }
};

/// The origin, and how busy the machine was when the program started.
void AddContext(const RunJson& context, Record& record) {
  if (!context.is_object()) return;
  for (const char* key : {"machine", "compiler", "flags", "libm", "commit"}) {
    if (context.contains(key) && context[key].is_string()) {
      record.Set(key, context[key].get<std::string>());
    }
  }
  if (context.contains("load_avg") && context["load_avg"].is_array() &&
      !context["load_avg"].empty() && context["load_avg"][0].is_number()) {
    record.Set("load_average", context["load_avg"][0].get<double>());
  }
}

}  // namespace

std::vector<Record> ParseBenchmarkJson(std::string_view text, const std::string& file) {
  const auto fail = [&file](const std::string& found) {
    throw std::runtime_error(
        fmt::format("{}: {}, expected the JSON of Google Benchmark", file, found));
  };
  RunJson document;
  try {
    document = RunJson::parse(text.begin(), text.end());
  } catch (const RunJson::exception& error) {
    fail(fmt::format("not JSON ({})", error.what()));
  }
  if (!document.is_object() || !document.contains("benchmarks") ||
      !document["benchmarks"].is_array()) {
    fail("no array \"benchmarks\"");
  }
  std::vector<Repetitions> all;
  std::map<std::string, std::size_t> place;
  std::size_t index = 0;
  for (const RunJson& run : document["benchmarks"]) {
    try {
      if (run.value("run_type", "iteration") == "iteration") {
        const std::string name = run.contains("run_name") ? run.at("run_name").get<std::string>()
                                                          : run.at("name").get<std::string>();
        const auto [at, is_new] = place.try_emplace(name, all.size());
        if (is_new) all.emplace_back().name = name;
        all[at->second].Add(run);
      }
    } catch (const RunJson::exception& error) {
      fail(fmt::format("/benchmarks/{}: {}", index, error.what()));
    }
    ++index;
  }
  const RunJson context = document.value("context", RunJson::object());
  std::vector<Record> records;
  for (const Repetitions& one : all) {
    Record record = one.ToRecord();
    AddContext(context, record);
    records.push_back(std::move(record));
  }
  return records;
}

std::vector<Record> ReadMeasurements(const std::filesystem::path& path,
                                     std::vector<std::string>* warnings) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error) || path.extension() == ".jsonl") {
    return LatestRecords(ReadRecords(path, warnings));
  }
  return ParseBenchmarkJson(ReadFile(path), path.string());
}

}  // namespace loopbench::harness
