#include "harness/record/provenance.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/utsname.h>

#include <Eigen/Core>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>

#include "harness/build_commit.h"
#include "harness/build_info.h"
#include "harness/record/origin.h"
#include "harness/text/hash.h"

namespace loopbench::harness {

std::vector<std::string> Provenance(const std::string& command) {
  utsname system{};
  uname(&system);
  const std::time_t now = std::time(nullptr);
  return {
      fmt::format("command: {}", command),
      fmt::format("date: {:%Y-%m-%d %H:%M} UTC", fmt::gmtime(now)),
      fmt::format("commit: {}", kBuildCommit),
      fmt::format("machine: {}, {} {}", ThisOrigin().machine, system.sysname, system.release),
      fmt::format("compiler: {}, flags {}", ThisOrigin().compiler, ThisOrigin().flags),
      fmt::format("libraries: Eigen {}.{}.{}, SUNDIALS {}, fmt {}", EIGEN_WORLD_VERSION,
                  EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION, kBuildSundials, FMT_VERSION),
  };
}

std::string VersionText() {
  std::string text = fmt::format("loopbench {}", kBuildVersion);
  const std::vector<std::string> facts = Provenance("");
  for (std::size_t i = 2; i < facts.size(); ++i) text += "\n" + facts[i];  // no command, no date
  return text;
}

const std::string& CodeVersion() {
  static const std::string version = [] {
    constexpr const char* kProgram = "/proc/self/exe";
    std::string bytes(std::filesystem::file_size(kProgram), '\0');
    std::ifstream(kProgram, std::ios::binary).read(bytes.data(), std::ssize(bytes));
    return Fnv1a(bytes);
  }();
  return version;
}

std::string ShellLine(const std::vector<std::string>& words) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+./:=,@%";
  std::string line;
  for (const std::string& word : words) {
    if (!line.empty()) line += ' ';
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string_view::npos) {
      line += word;
      continue;
    }
    line += '\'';
    for (const char c : word) line += c == '\'' ? "'\\''" : std::string(1, c);
    line += '\'';
  }
  return line;
}

std::string CommandLine(int argc, const char* const* argv) {
  std::string line = std::filesystem::path(argv[0]).filename().string();
  for (int i = 1; i < argc; ++i) line += std::string(" ") + argv[i];
  return line;
}

}  // namespace loopbench::harness
