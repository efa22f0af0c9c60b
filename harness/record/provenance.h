// Origin of records and tables: program, machine, commit, command.
#pragma once

#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

// Machine, compiler, flags, mathematical library and commit that produced a record.
//
// Every record contains them because they limit comparisons: times need one machine, bits one
// arithmetic.

struct Origin {
  std::string machine;   ///< processor model and number of logical processors
  std::string compiler;  ///< name and version
  std::string flags;     ///< build type, -march and other flags that change results
  std::string libm;  ///< hash of sines, powers, ... at fixed arguments: equal libraries, equal bits
  std::string commit;  ///< "-dirty" if the tree was changed

  /// True if equal code gives equal bits: compiler, flags and libm are known and equal.
  bool SameArithmetic(const Origin& other) const;
  /// True if times may be compared: the machine is known and equal.
  bool SameMachine(const Origin& other) const;
};

/// Returns the origin of this program on this machine.
const Origin& ThisOrigin();

/// Sets the keys "machine", "compiler", "flags", "libm" and "commit".
void Stamp(Record& record);

/// Returns the origin from the keys set by Stamp(); unknown parts are empty.
Origin OriginOf(const Record& record);

// Provenance below every table: command, machine, compiler, versions, commit.

/// Returns one fact per line, "command: ...". `command` is the typed command.
std::vector<std::string> Provenance(const std::string& command);

/// Returns the output of `loopbench --version`: the version, and facts independent of the command.
std::string VersionText();

/// Returns 16 hexadecimal digits that change with any byte of this program: results of different
/// versions are different results.
const std::string& CodeVersion();

/// Returns the program's name and its arguments, separated by spaces.
std::string CommandLine(int argc, const char* const* argv);

/// Returns the command line in shell syntax, with the program as it was called.
std::string ShellLine(const std::vector<std::string>& words);

}  // namespace loopbench::harness
