// Where records and tables come from: program, machine, commit, command.
#pragma once

#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

// Which machine, compiler, flags and mathematical library made a record, and from which commit.
//
// Stored with every record, because it decides what may be compared with what: times only on one
// machine, bits only under one arithmetic.

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

// Where numbers come from: command, machine, compiler, versions, commit. Stands below every table.

/// One fact per line, "command: ...". `command` is what the user typed.
std::vector<std::string> Provenance(const std::string& command);

/// What `loopbench --version` prints: the version, and those facts that no command changes.
std::string VersionText();

/// 16 hexadecimal digits that change with any byte of this program: results of different versions
/// are different results.
const std::string& CodeVersion();

/// The program's name and its arguments, with spaces between.
std::string CommandLine(int argc, const char* const* argv);

/// The same as a shell takes it, with the program as it was called.
std::string ShellLine(const std::vector<std::string>& words);

}  // namespace loopbench::harness
