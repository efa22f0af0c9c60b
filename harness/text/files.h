// Whole files, read and written at once, and their errors.
#pragma once

#include <csignal>
#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace loopbench::harness {

// Exception for input that the user can correct.

/// Bad input. what() is the complete message: for each mistake the file, the JSON Pointer, the
/// value found and the value expected. The command line turns it into exit code 2. Numerical
/// failures are not such errors; they are outcomes of a run.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Whole files, read and written at once.

/// A failed operation of the system: a full disk, a limit, a missing file. It is no result of a
/// method, so no record is made of it (processes.h).
class SystemFault : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Writes `text` to `path` by the output rules of files.h: a reader of a regular file finds the old
/// contents or the new ones, never a part. Makes missing parent folders. Throws std::runtime_error
/// with the path and the system's reason.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view text);

/// Writes a text that comes in parts: `fill` passes each part to its argument.
void WriteFileAtomically(
    const std::filesystem::path& path,
    const std::function<void(const std::function<void(std::string_view)>& write)>& fill);

/// Writes `text` to `path` if no file exists there; else returns false and changes nothing. If
/// several processes try at once, one succeeds. If a process is killed, the file is complete or
/// absent, because a temporary file gets its second name by link(2). Throws as WriteFileAtomically
/// does.
bool WriteNewFile(const std::filesystem::path& path, std::string_view text);

/// Makes the folder of `path` and its parents. Throws std::runtime_error with the folder and the
/// system's reason.
void MakeFolderOf(const std::filesystem::path& path);

/// Throws SystemFault: "cannot VERB 'PATH': " and the reason in errno.
[[noreturn]] void FailOn(std::string_view verb, const std::filesystem::path& path);

/// Writes all of `text` to an open file; `path` names it in the error. Calls write(2) once, and
/// again only if the system accepted a part or was interrupted.
void WriteAll(int descriptor, std::string_view text, const std::filesystem::path& path);

/// Waits until the names in the folder of `path` are on disk, if the file system supports this.
void SyncFolderOf(const std::filesystem::path& path);

/// Returns the bytes of the regular file `path` (a device might never end) and notes it as input
/// (files.h). Throws std::runtime_error with the path and the reason.
std::string ReadFile(const std::filesystem::path& path);

// Temporary files and folders of a command: none remains, however the command ends.

/// The signal with which a parent ends a child process, whose temporary files are then removed.
inline constexpr int kRemoveAndEnd = SIGUSR1;

/// Temporary file or folder. It is removed with its owner, and before SIGHUP, SIGINT, SIGTERM or
/// kRemoveAndEnd ends this process. A signal that is ignored or has a handler (processes.h) stays
/// unchanged.
class Unfinished {
 public:
  explicit Unfinished(const std::filesystem::path& path);
  ~Unfinished();
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;

  std::filesystem::path path() const { return path_; }

 private:
  std::string path_;
};

/// New folder in the system's folder for temporary files. It holds a lock: the next folder of the
/// same name removes the folders of killed processes.
class TemporaryFolder {
 public:
  /// @param name  first part of the folder's name. Throws std::runtime_error if the folder cannot
  ///        be made.
  explicit TemporaryFolder(const std::string& name);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path path() const { return unfinished_->path(); }

 private:
  std::optional<Unfinished> unfinished_;
  int lock_ = -1;
};

// Rules for the destination of output.
//
//   PATH is                         output goes
//   a new name, a regular file      to a temporary file next to it, renamed at the end
//   a symbolic link                 to its target, in the same way; the link stays
//   a character device, a pipe      into it
//   standard output or error        into it, after all previous output
//   a file the command has read     nowhere: rejected
//   a folder, a block device, ...   nowhere: rejected

/// Scope in which the files passed to NoteInput() are inputs, and output onto them is rejected.
/// Only one object may exist; without one there are no inputs.
class CommandInputs {
 public:
  CommandInputs();
  ~CommandInputs();
  CommandInputs(const CommandInputs&) = delete;
  CommandInputs& operator=(const CommandInputs&) = delete;
};
/// Registers an input file; every function that reads files calls it. Thread-safe.
void NoteInput(const std::filesystem::path& path);

/// Permission to write a file that the command has read: for its own records, never for a result.
enum class Onto { kNoInput, kAnyFile };

/// Throws as OutputFile does, and writes nothing: a check before long work.
void RequireOutput(const std::filesystem::path& path);

/// Follows symbolic links to their end, which may be missing.
std::filesystem::path BehindLinks(std::filesystem::path file);

/// Removes temporary files of OutputFile in `folder` whose process was killed. Such a process
/// no longer exists, and no process of another machine holds the lock of the file.
void RemoveAbandoned(const std::filesystem::path& folder);

/// Output in progress. A reader of a regular file finds the old contents or the new ones.
class OutputFile {
 public:
  /// Makes missing folders. Throws std::runtime_error, here and below, with the path and the
  /// reason.
  /// @param ending  ending of the temporary file; "": a unique one
  explicit OutputFile(const std::filesystem::path& path, Onto onto = Onto::kNoInput,
                      std::string_view ending = "");
  /// Leaves a regular file unchanged if Finish() was not called.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void Write(std::string_view text);
  /// Puts the file on disk. Call it once, at the end.
  void Finish();
  /// Finishes like Finish(), but returns false and keeps an existing file of this name.
  bool FinishIfNew();

 private:
  void Close();

  std::filesystem::path path_, target_;  ///< target_: path after links; "" for a device or pipe
  std::optional<Unfinished> part_;
  int descriptor_ = -1;
};

// Versions of files (docs/release.md). A version is raised if an old program could misread a new
// file, or a new program an old file.

/// Configuration files; those without a version read as 1.
inline constexpr int kFileFormat = 1;
/// Lines of stores and histories. 2: keys and values have other names (`loopbench migrate`).
inline constexpr int kRecordFormat = 2;

/// Expected format in messages.
inline constexpr const char* kExpectedFormat = "{}, the format that this version reads";

}  // namespace loopbench::harness
