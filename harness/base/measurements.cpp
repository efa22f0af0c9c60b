#include <array>
#include <set>

#include "harness/base/json_reader.h"
#include "harness/base/store.h"
#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

/// Keys that the library writes in addition to counters.
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
                                            "error_message",
                                            "skipped",
                                            "skip_message"};

/// Keys of benchmark records in addition to counters.
const std::set<std::string> kTakenKeys = {
    "kind",    "benchmark", "outcome", "start_hash", "cpu_ns", "series.cpu_ns", "series.real_ns",
    "machine", "compiler",  "flags",   "libm",       "commit", "load_average"};

double MedianOf(std::vector<double> sample) {
  std::ranges::sort(sample);
  const std::size_t n = sample.size();
  return n % 2 == 1 ? sample[n / 2] : 0.5 * (sample[n / 2 - 1] + sample[n / 2]);
}

/// Returns a string that may be absent or empty.
std::string AnyText(const JsonNode& owner, const std::string& key) {
  const std::optional<JsonNode> node = owner.Optional(key);
  if (!node || node->value() == "") return "";
  return node->Text();
}

bool IsTrue(const JsonNode& owner, const std::string& key) {
  const std::optional<JsonNode> node = owner.Optional(key);
  return node && node->Bool();
}

/// Times in any unit: sums and squares of their nanoseconds are finite.
constexpr Range kTimes = {.min = 0.0, .max = 1e100};

/// Returns one of the times of a run [ns].
double Time(const JsonNode& run, const std::string& key) {
  const std::array<double, 4> nanoseconds = {1.0, 1e3, 1e6, 1e9};
  const std::optional<JsonNode> unit = run.Optional("time_unit");
  const std::optional<int> index =
      unit ? unit->Choice({"ns", "us", "ms", "s"}, "a unit of time") : std::optional<int>(0);
  const std::optional<JsonNode> time = run.Required(key, "a time");
  return index && time ? time->Number(kTimes) * nanoseconds[*index] : 0.0;
}

/// All repetitions of one benchmark.
struct Repetitions {
  std::string name, error, label;
  std::vector<double> cpu_ns, real_ns;
  std::map<std::string, std::vector<double>> counters;

  void Add(const JsonNode& run) {
    if (const std::string text = AnyText(run, "label"); !text.empty()) label = text;
    for (const auto& [flag, words] :
         {std::pair{"error_occurred", "error_message"}, {"skipped", "skip_message"}}) {
      if (!IsTrue(run, flag)) continue;
      error = AnyText(run, words);
      if (error.empty()) error = "an error without a message";
      return;
    }
    cpu_ns.push_back(Time(run, "cpu_time"));
    real_ns.push_back(Time(run, "real_time"));
    for (const auto& [key, node] : run.Members()) {
      // other library versions may add words and flags; all other values are counters
      if (kLibraryKeys.contains(key) || node.value().is_string() || node.value().is_boolean()) {
        continue;
      }
      if (kTakenKeys.contains(key)) node.FailAs("a counter", "a name that records do not use");
      counters[key].push_back(node.Number());
    }
  }

  Record ToRecord() const {
    Record record;
    record.Set("kind", std::string("benchmark"));
    record.Set("benchmark", name);
    record.Set("outcome", error.empty() ? std::string("finished") : error);
    if (!label.empty()) record.Set("start_hash", label);
    if (!error.empty() || cpu_ns.empty()) return record;
    // CPU time of one of several threads is not informative: use wall time for them
    const std::vector<double>& spent = name.ends_with("-threads") ? real_ns : cpu_ns;
    record.Set("cpu_ns", MedianOf(spent));
    for (const auto& [key, values] : counters) record.Set(key, MedianOf(values));
    record.Set("series.cpu_ns", spent);
    record.Set("series.real_ns", real_ns);
    return record;
  }
};

std::vector<Repetitions> ReadRuns(const JsonNode& root) {
  std::vector<Repetitions> all;
  std::map<std::string, std::size_t> place;
  const std::optional<JsonNode> runs = root.Required("benchmarks", "the runs of Google Benchmark");
  if (!runs) return all;
  for (const JsonNode& run : runs->Elements("runs of Google Benchmark")) {
    if (!run.value().is_object()) {
      run.Fail("an object, a run of Google Benchmark");
      continue;
    }
    const std::optional<JsonNode> type = run.Optional("run_type");
    if (type && type->Choice({"iteration", "aggregate"}, "a type of run") != 0) continue;
    const std::optional<JsonNode> run_name = run.Optional("run_name");
    const std::optional<JsonNode> name = run_name ? run_name : run.Required("name", "a name");
    if (!name) continue;
    const auto [at, is_new] = place.try_emplace(name->Text(), all.size());
    if (is_new) all.emplace_back().name = at->first;
    all[at->second].Add(run);
  }
  return all;
}

/// Returns the origin, and the machine load when the program started.
Record ReadContext(const JsonNode& root) {
  Record record;
  const std::optional<JsonNode> context = root.Optional("context");
  if (!context) return record;
  if (!context->value().is_object()) context->Fail("an object");
  for (const char* key : {"machine", "compiler", "flags", "libm", "commit"}) {
    if (const std::string text = AnyText(*context, key); !text.empty()) record.Set(key, text);
  }
  if (const auto load = context->Optional("load_avg")) {
    const std::vector<JsonNode> loads = load->Elements("numbers");
    if (!loads.empty()) record.Set("load_average", loads.front().Number());
  }
  return record;
}

}  // namespace

std::vector<Record> ParseBenchmarkJson(std::string_view text, const std::string& file) {
  return ReadDocument(text, file, [](const JsonNode& root) {
    if (!root.value().is_object()) root.Fail("the JSON object that Google Benchmark writes");
    std::vector<Record> records = Mapped<Record>(ReadRuns(root), &Repetitions::ToRecord);
    const Record context = ReadContext(root);
    for (Record& record : records) {
      for (const auto& [key, value] : context.items()) record.Set(key, value);
    }
    return records;
  });
}

std::vector<Record> ReadMeasurements(const std::filesystem::path& path,
                                     std::vector<std::string>* warnings) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error) || path.extension() == ".jsonl") {
    std::vector<Record> records = LatestRecords(ReadRecords(path, warnings));
    SortRows(&records);  // the store has the order in which runs ended
    return records;
  }
  return ParseBenchmarkJson(ReadTextFile(path), path.string());
}

}  // namespace loopbench::harness
