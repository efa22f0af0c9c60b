#include "tests/fuzz/readers.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
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

template <class Refusal, class Read>
void Call(Read read) {
  try {
    read();
  } catch (const Refusal& refusal) {
    CheckMessage(refusal.what());
  }
}

/// `bytes` as a file, for readers that take its path.
template <class Refusal, class Read>
void CallOnFile(std::string_view bytes, std::string_view extension, Read read) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / fmt::format("fuzzed-{}{}", ::getpid(), extension);
  std::ofstream(file, std::ios::binary) << bytes;
  Call<Refusal>([&] { read(file); });
  std::filesystem::remove(file);
}

void ReadStore(const std::filesystem::path& file) {
  std::vector<std::string> warnings;
  harness::LatestRecords(harness::ReadRecords(file, &warnings));
  for (const std::string& warning : warnings) CheckMessage(warning);
}

}  // namespace

void CallReader(std::string_view kind, std::string_view bytes) {
  using harness::ConfigError;
  if (kind == "mechanism") {
    Call<ConfigError>([bytes] { harness::ParseMechanism(bytes, "m.json"); });
  } else if (kind == "experiment") {
    Call<ConfigError>(
        [bytes] { harness::ParseExperiments(bytes, "configs/experiments/paper/fuzz.json"); });
  } else if (kind == "claim") {
    Call<ConfigError>([bytes] { harness::ParseClaims(bytes, "claims.json"); });
  } else if (kind == "map") {
    Call<ConfigError>([bytes] { harness::ParseMapRules(bytes, "map.json"); });
  } else if (kind == "benchmark") {
    Call<ConfigError>([bytes] { harness::ParseBenchmarks(bytes, "configs/benchmarks/fuzz.json"); });
  } else if (kind == "measurement") {
    Call<std::runtime_error>([bytes] { harness::ParseBenchmarkJson(bytes, "b.json"); });
  } else if (kind == "record") {
    Call<std::runtime_error>([bytes] { harness::FromJsonLine(bytes); });
    harness::IsTornRecord(bytes);
  } else if (kind == "store") {
    CallOnFile<std::runtime_error>(bytes, ".jsonl", ReadStore);
  } else if (kind == "import") {
    Call<ConfigError>([bytes] { harness::ImportText(bytes, "m.xml"); });
  } else if (kind == "sidecar") {
    CallOnFile<ConfigError>(bytes, ".json", [](const std::filesystem::path& file) {
      harness::ImportOptions options;
      options.sidecar = file;
      harness::ImportMechanism("configs/imports/furuta.sdf", options);
    });
  } else if (kind == "series") {
    CallOnFile<ConfigError>(bytes, ".json", [](const std::filesystem::path& file) {
      harness::ReadPublishedSeries(file);
    });
  } else if (kind == "trajectory") {
    CallOnFile<std::runtime_error>(bytes, ".csv", harness::ReadTrajectory);
  } else {
    throw std::logic_error("no reader of this kind");
  }
}

}  // namespace loopbench::fuzz
