// Where numbers come from: command, machine, compiler, versions, commit. Stands below every table.
#pragma once

#include <string>
#include <vector>

namespace loopbench::harness {

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
