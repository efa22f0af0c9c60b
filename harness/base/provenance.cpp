#include <fmt/chrono.h>
#include <sys/utsname.h>

#include <Eigen/Core>
#include <cmath>
#include <fstream>
#include <thread>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/build_commit.h"
#include "harness/build_info.h"

namespace loopbench::harness {

namespace {

std::string CpuModel() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
}

/// Returns a hash of the functions that simulations call, at about 1000 arguments. It detects a
/// library that differs in the last bit in one of a hundred calls.
std::string LibmHash() {
  std::vector<double> answers;
  volatile double scale = 0.0173;  // unknown to the compiler, which would otherwise fold the calls
  for (int i = 1; i <= 1000; ++i) {
    const double x = scale * i;
    for (const double value : {std::sin(x), std::cos(x), std::atan2(x, 1.0), std::hypot(x, 2.0),
                               std::pow(x, -0.2), std::exp(-x), std::log(x)}) {
      answers.push_back(value);
    }
  }
  return Fnv1a({reinterpret_cast<const char*>(answers.data()), answers.size() * sizeof(double)});
}

}  // namespace

bool Origin::SameArithmetic(const Origin& other) const {
  const bool known = !compiler.empty() && !flags.empty() && !libm.empty();
  return known && compiler == other.compiler && flags == other.flags && libm == other.libm;
}

bool Origin::SameMachine(const Origin& other) const {
  return !machine.empty() && machine == other.machine;
}

const Origin& ThisOrigin() {
  static const Origin origin = {
      fmt::format("{}, {} logical processors", CpuModel(), std::thread::hardware_concurrency()),
      fmt::format("{} {}", kBuildCompiler, __VERSION__), kBuildFlags, LibmHash(), kBuildCommit};
  return origin;
}

void Stamp(Record& record) {
  const Origin& origin = ThisOrigin();
  record.Set("machine", origin.machine);
  record.Set("compiler", origin.compiler);
  record.Set("flags", origin.flags);
  record.Set("libm", origin.libm);
  record.Set("commit", origin.commit);
}

Origin OriginOf(const Record& record) {
  return {record.Text("machine"), record.Text("compiler"), record.Text("flags"),
          record.Text("libm"), record.Text("commit")};
}

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
