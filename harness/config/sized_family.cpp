#include "harness/config/sized_family.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "mechanism/description/library.h"

namespace loopbench::harness {
namespace {

constexpr int kLargest = 1'000'000;

/// The other speeds follow. Tension grows with length and its square: so slow that steps of a few
/// milliseconds are short against the waves in it.
MechanismDescription Started(MechanismDescription description, int size) {
  description.initial.speeds.push_back({0, {std::min(1.0, 1000.0 / size)}});
  return description;
}

}  // namespace

const std::vector<SizedFamily>& SizedFamilies() {
  // the smallest loops that move have three bars in the plane and six in space
  static const std::vector<SizedFamily> all = {
      {"chain", 3, kLargest, "bars of a closed chain", [](int n) { return Started(Chain(n), n); }},
      {"ladder", 1, kLargest, "windows in a row", [](int n) { return Ladder(n, 1.0, 1.0); }},
      // storeys stand at angles from 0.4 rad on, a tenth more each: the 25th at 2.8 rad, the 29th
      // would fold flat
      {"grid", 1, 25, "storeys of as many windows", [](int n) { return Grid(n, n, 0.4, 0.5); }},
      {"tree", 1, kLargest, "bars of a binary tree", [](int n) { return Tree(n, 0.1); }},
      {"arm", 1, kLargest, "bars in space, with axes of all directions",
       [](int n) { return Started(Arm(n, false), n); }},
      {"ring", 6, kLargest, "the same in a closed loop",
       [](int n) { return Started(Arm(n, true), n); }}};
  return all;
}

std::vector<std::string> NamesOfSizedFamilies() {
  std::vector<std::string> names;
  for (const SizedFamily& family : SizedFamilies()) names.push_back(family.name);
  return names;
}

std::string TextOfSizedFamilies() {
  std::string text = "What a size counts:";
  for (const SizedFamily& family : SizedFamilies()) {
    text += fmt::format("{} {} ({}, from {})", &family == &SizedFamilies().front() ? "" : ",",
                        family.name, family.of_what, family.smallest);
  }
  return text + ".";
}

const SizedFamily& SizedFamilyOf(const std::string& name) {
  const auto at = std::ranges::find(SizedFamilies(), name, &SizedFamily::name);
  if (at == SizedFamilies().end()) throw std::invalid_argument("no family \"" + name + "\"");
  return *at;
}

}  // namespace loopbench::harness
