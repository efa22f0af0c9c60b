#include "harness/config/benchmarks.h"

#include "harness/config/sized_family.h"

namespace loopbench::harness {

MechanismDescription BenchmarkMember::Make() const {
  return family.empty() ? description : SizedFamilyOf(family).make(size);
}

std::string BenchmarkName(BenchmarkKind kind, const BenchmarkMember& member, const Column& column) {
  return std::string(kNames<BenchmarkKind>[static_cast<std::size_t>(kind)]) + "/" + member.name +
         "/" + ToString(column);
}

}  // namespace loopbench::harness
