// Which machine, compiler, flags and mathematical library made a record, and from which commit.
//
// Stored with every record, because it decides what may be compared with what: times only on one
// machine, bits only under one arithmetic.
#pragma once

#include <string>

#include "harness/record/record.h"

namespace loopbench::harness {

struct Origin {
  std::string machine;   ///< processor model and number of logical processors
  std::string compiler;  ///< name and version
  std::string flags;     ///< build type, -march and what else changes results
  std::string libm;  ///< hash of sines, powers, ... at fixed arguments: equal libraries, equal bits
  std::string commit;  ///< "-dirty" when the tree was changed

  /// Whether equal code gives equal bits: compiler, flags and libm known and the same.
  bool SameArithmetic(const Origin& other) const;
  /// Whether times may be compared: the machine known and the same.
  bool SameMachine(const Origin& other) const;
};

/// Of this program, here.
const Origin& ThisOrigin();

/// Sets the keys "machine", "compiler", "flags", "libm" and "commit".
void Stamp(Record& record);

/// What Stamp() left; unknown parts are empty.
Origin OriginOf(const Record& record);

}  // namespace loopbench::harness
