// Whole files, read and written at once.
#pragma once

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace loopbench::harness {

/// The system rejects an operation that a program needs: a full disk, a limit, a missing file. It
/// is no result of a method, so that no record is made of it (processes.h).
class SystemFault : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Writes `text` to `path` as output goes (output_file.h): of a regular file a reader finds the old
/// contents or the new ones, never a part. Missing parent folders are made. Throws
/// std::runtime_error that names the path and the system's reason.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view text);

/// The same with a text that comes in parts: `fill` calls what it is given with each.
void WriteFileAtomically(
    const std::filesystem::path& path,
    const std::function<void(const std::function<void(std::string_view)>& write)>& fill);

/// Writes `text` to `path` if nothing is there; else false, and what is there stays. Of several
/// processes that try at once one succeeds, and of one that is killed the file has all of the text
/// or is not there: a temporary file gets its second name by link(2). Throws as WriteFileAtomically
/// does.
bool WriteNewFile(const std::filesystem::path& path, std::string_view text);

/// Makes the folder that `path` is in, with all above it. Throws std::runtime_error that names the
/// folder and the system's reason.
void MakeFolderOf(const std::filesystem::path& path);

/// Throws SystemFault: "cannot VERB 'PATH': " and the reason in errno.
[[noreturn]] void FailOn(std::string_view verb, const std::filesystem::path& path);

/// All of `text` to an open file; `path` names it in the error. One write(2) in the usual case;
/// more only if the system accepted a part or was interrupted.
void WriteAll(int descriptor, std::string_view text, const std::filesystem::path& path);

/// Waits until the names in the folder of `path` are on the disk, where the file system can.
void SyncFolderOf(const std::filesystem::path& path);

/// The bytes of `path`, a regular file: a device might never end. It is an input (output_file.h).
/// Throws std::runtime_error that names the path and the reason.
std::string ReadFile(const std::filesystem::path& path);

}  // namespace loopbench::harness
