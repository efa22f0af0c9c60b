#include "tests/fuzz/readers.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/base/record.h"
#include "harness/base/store.h"
#include "harness/base/text.h"
#include "harness/config/benchmarks.h"
#include "harness/config/experiment_reader.h"
#include "harness/config/mechanism_reader.h"
#include "harness/config/published_series.h"
#include "harness/exchange/import.h"
#include "harness/judge/judge.h"
#include "harness/observers/trajectory.h"

namespace loopbench::fuzz {
namespace {

/// Messages are printed: bytes that are not UTF-8 would garble a terminal, a line of megabytes
/// would hide what it says.
void CheckMessage(const std::string& message) {
  if (message.empty()) throw std::logic_error("a refusal without a message");
  if (message.find("json.exception") != std::string::npos) {
    throw std::logic_error("the parser's own words: " + message);
  }
  constexpr std::size_t kLongestLine = 4000, kMaxLines = 250;
  std::size_t length = 0, lines = 1, following = 0;
  for (const char c : message) {
    const auto byte = static_cast<unsigned char>(c);
    length = c == '\n' ? 0 : length + 1;
    lines += c == '\n' ? 1 : 0;
    if (length > kLongestLine) throw std::logic_error("an endless line: " + message.substr(0, 200));
    if (lines > kMaxLines) throw std::logic_error("too many lines: " + message.substr(0, 200));
    if (byte < 0x20 && c != '\n') throw std::logic_error("a control character: " + message);
    const bool continues = (byte & 0xC0u) == 0x80u;
    if (continues != (following > 0)) throw std::logic_error("no UTF-8: " + message);
    if (continues) {
      --following;
    } else {
      following = byte >= 0xF0 ? 3 : byte >= 0xE0 ? 2 : byte >= 0xC0 ? 1 : 0;
    }
  }
}

/// Returns true if the reader accepts its input.
template <class Refusal, class Read>
bool Call(Read read) {
  try {
    read();
    return true;
  } catch (const Refusal& refusal) {
    CheckMessage(refusal.what());
    return false;
  }
}

/// `bytes` as a file, for readers that take its path.
template <class Refusal, class Read>
bool CallOnFile(std::string_view bytes, std::string_view extension, Read read) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / fmt::format("fuzzed-{}{}", ::getpid(), extension);
  std::ofstream(file, std::ios::binary) << bytes;
  const bool is_accepted = Call<Refusal>([&] { read(file); });
  std::filesystem::remove(file);
  return is_accepted;
}

void ReadStore(const std::filesystem::path& file) {
  std::vector<std::string> warnings;
  harness::LatestRecords(harness::ReadRecords(file, &warnings));
  for (const std::string& warning : warnings) CheckMessage(warning);
}

/// Times are finite, and messages name the file.
void ReadMeasurement(std::string_view bytes) {
  try {
    for (const harness::Record& record : harness::ParseBenchmarkJson(bytes, "b.json")) {
      for (const double time : record.Numbers("series.cpu_ns")) {
        if (!(time >= 0.0) || std::isinf(time)) throw std::logic_error("a time that is none");
      }
    }
  } catch (const harness::ConfigError& refusal) {
    if (std::string_view(refusal.what()).starts_with("b.json:")) throw;
    throw std::logic_error(std::string("no file in ") + refusal.what());
  }
}

}  // namespace

bool CallReader(std::string_view kind, std::string_view bytes) {
  using harness::ConfigError;
  if (kind == "mechanism") {
    return Call<ConfigError>([bytes] { harness::ParseMechanism(bytes, "m.json"); });
  }
  if (kind == "experiment") {
    return Call<ConfigError>(
        [bytes] { harness::ParseExperiments(bytes, "configs/experiments/paper/fuzz.json"); });
  }
  if (kind == "claim") {
    return Call<ConfigError>([bytes] { harness::ParseClaims(bytes, "claims.json"); });
  }
  if (kind == "map") {
    return Call<ConfigError>([bytes] { harness::ParseMapRules(bytes, "map.json"); });
  }
  if (kind == "benchmark") {
    return Call<ConfigError>(
        [bytes] { harness::ParseBenchmarks(bytes, "configs/benchmarks/fuzz.json"); });
  }
  if (kind == "measurement") {
    return Call<ConfigError>([bytes] { ReadMeasurement(bytes); });
  }
  if (kind == "record") {
    harness::IsTornRecord(bytes);
    return Call<std::runtime_error>([bytes] { harness::FromJsonLine(bytes); });
  }
  if (kind == "store") {
    return CallOnFile<std::runtime_error>(bytes, ".jsonl", ReadStore);
  }
  if (kind == "import") {
    return Call<ConfigError>([bytes] { harness::ImportText(bytes, "m.xml"); });
  }
  if (kind == "sidecar") {
    return CallOnFile<ConfigError>(bytes, ".json", [](const std::filesystem::path& file) {
      harness::ImportOptions options;
      options.sidecar = file;
      harness::ImportMechanism("configs/imports/furuta.sdf", options);
    });
  }
  if (kind == "series") {
    return CallOnFile<ConfigError>(bytes, ".json", [](const std::filesystem::path& file) {
      harness::ReadPublishedSeries(file);
    });
  }
  if (kind == "trajectory") {
    return CallOnFile<std::runtime_error>(bytes, ".csv", harness::ReadTrajectory);
  }
  throw std::logic_error("no reader of this kind");
}

}  // namespace loopbench::fuzz
