// Opens a store for one writer at a time.
#pragma once

#include <filesystem>
#include <string>

namespace loopbench::harness {

/// A descriptor of the regular file `file` for reading and appending, made if it is missing, with
/// an exclusive lock on the file itself: by whatever name another process opens it, through a
/// symbolic link or a hard one, it meets the lock. The lock ends when all copies of the descriptor
/// are closed, those of forked children too. Throws std::runtime_error that names the file, and the
/// process that holds the lock.
/// @param waits  for the lock, however long another process holds it
/// @param cure   what to do when another process has it, for the message
int OpenLocked(const std::filesystem::path& file, bool waits = false,
               const std::string& cure = "wait for it (--wait), or write to another --out");

/// Whether a process has the store `file` open for writing.
bool IsLocked(const std::filesystem::path& file);

/// Whether `file` still names what the descriptor is open on: no one deleted or replaced it.
bool IsStillNamed(int descriptor, const std::filesystem::path& file);

}  // namespace loopbench::harness
