#include "harness/record/origin.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <thread>
#include <vector>

#include "harness/build_commit.h"
#include "harness/build_info.h"
#include "harness/text/hash.h"

namespace loopbench::harness {

namespace {

std::string CpuModel() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
}

/// Hash of the functions that simulations call, at some thousand arguments. Libraries that differ
/// in one last bit in a hundred calls cannot get through.
std::string LibmHash() {
  std::vector<double> answers;
  volatile double scale = 0.0173;  // not known to the compiler, which would fold the calls
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

}  // namespace loopbench::harness
