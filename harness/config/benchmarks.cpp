#include "harness/config/benchmarks.h"

#include "mechanism/description/library.h"

namespace loopbench::harness {

MechanismDescription BenchmarkMember::Make() const {
  if (family == "chain") {
    MechanismDescription chain = Chain(size);
    chain.initial.speeds.push_back({0, {1.0}});  // the other speeds follow
    return chain;
  }
  if (family == "ladder") return Ladder(size, 1.0, 1.0);
  // storeys from 0.4 rad on: with kLargestGrid of them the last stands at 2.8 rad, short of pi
  if (family == "grid") return Grid(size, size, 0.4, 0.5);
  return description;
}

std::string BenchmarkName(BenchmarkKind kind, const BenchmarkMember& member, const Column& column) {
  return std::string(kNames<BenchmarkKind>[static_cast<std::size_t>(kind)]) + "/" + member.name +
         "/" + ToString(column);
}

}  // namespace loopbench::harness
