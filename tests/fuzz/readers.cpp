#include "tests/fuzz/readers.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "harness/config/claims_reader.h"
#include "harness/config/config_error.h"
#include "harness/config/experiment_reader.h"
#include "harness/config/failure_map_reader.h"
#include "harness/config/mechanism_reader.h"
#include "harness/store/record_json.h"

namespace loopbench::fuzz {
namespace {

/// Messages are printed: bytes that are not UTF-8 would garble a terminal, a line of megabytes
/// would hide what it says.
void CheckMessage(const std::string& message) {
  if (message.empty()) throw std::logic_error("a refusal without a message");
  if (message.find("json.exception") != std::string::npos) {
    throw std::logic_error("the parser's own words: " + message);
  }
  constexpr std::size_t kLongestLine = 4000, kMostLines = 250;
  std::size_t length = 0, lines = 1, following = 0;
  for (const char c : message) {
    const auto byte = static_cast<unsigned char>(c);
    length = c == '\n' ? 0 : length + 1;
    lines += c == '\n' ? 1 : 0;
    if (length > kLongestLine) throw std::logic_error("an endless line: " + message.substr(0, 200));
    if (lines > kMostLines) throw std::logic_error("too many lines: " + message.substr(0, 200));
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

}  // namespace

void CallMechanismReader(std::string_view bytes) {
  Call<harness::ConfigError>([bytes] { harness::ParseMechanism(bytes, "m.json"); });
}

void CallExperimentReader(std::string_view bytes) {
  Call<harness::ConfigError>(
      [bytes] { harness::ParseExperiments(bytes, "configs/experiments/paper/fuzz.json"); });
}

void CallRecordReader(std::string_view bytes) {
  Call<std::runtime_error>([bytes] { harness::FromJsonLine(bytes); });
  harness::IsTornRecord(bytes);
}

void CallClaimsReader(std::string_view bytes) {
  Call<harness::ConfigError>([bytes] { harness::ParseClaims(bytes, "claims.json"); });
}

void CallMapReader(std::string_view bytes) {
  Call<harness::ConfigError>([bytes] { harness::ParseMapRules(bytes, "map.json"); });
}

}  // namespace loopbench::fuzz
