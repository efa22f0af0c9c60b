#include "harness/config/benchmarks.h"

#include <algorithm>

#include "mechanism/description/library.h"

namespace loopbench::harness {

MechanismDescription BenchmarkMember::Make() const {
  if (family == "chain") {
    MechanismDescription chain = Chain(size);
    // The other speeds follow. Tension grows with length and its square; so slow that steps of a
    // few milliseconds are short against the waves in it.
    chain.initial.speeds.push_back({0, {std::min(1.0, 1000.0 / size)}});
    return chain;
  }
  if (family == "arm" || family == "ring") {
    MechanismDescription arm = Arm(size, family == "ring");
    arm.initial.speeds.push_back({0, {std::min(1.0, 1000.0 / size)}});
    return arm;
  }
  if (family == "ladder") return Ladder(size, 1.0, 1.0);
  if (family == "tree") return Tree(size, 0.1);
  // storeys from 0.4 rad on: with kLargestGrid of them the last stands at 2.8 rad, short of pi
  if (family == "grid") return Grid(size, size, 0.4, 0.5);
  return description;
}

std::string BenchmarkName(BenchmarkKind kind, const BenchmarkMember& member, const Column& column) {
  return std::string(kNames<BenchmarkKind>[static_cast<std::size_t>(kind)]) + "/" + member.name +
         "/" + ToString(column);
}

}  // namespace loopbench::harness
