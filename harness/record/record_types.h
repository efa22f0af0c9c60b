// What kind of value stands under the keys of records that this program writes.
#pragma once

#include <string_view>

namespace loopbench::harness {

enum class ValueType {
  kAny,      ///< of keys that this program does not know: parameters of sweeps, other programs'
  kNumber,   ///< or null, "not measured"
  kText,     ///< or null
  kFlag,     ///< true or false, or null
  kNumbers,  ///< an array of numbers and nulls
};

ValueType TypeOf(std::string_view key);

/// "a number or null": what a message says was expected.
std::string_view Describe(ValueType type);

}  // namespace loopbench::harness
