// Whole files, read and written at once, and what can be wrong with them.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace loopbench::harness {

// The one exception for input that a person can correct.

/// Bad input. what() is the whole message, ready to print: for each mistake the file, the JSON
/// Pointer, the value found and what was expected instead. The command line turns it into exit
/// code 2. Numerical failures are not errors of this kind; they are outcomes of a run.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Whole files, read and written at once.

/// The system rejects an operation that a program needs: a full disk, a limit, a missing file. It
/// is no result of a method, so that no record is made of it (processes.h).
class SystemFault : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Writes `text` to `path` as output goes (files.h): of a regular file a reader finds the old
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

/// The bytes of `path`, a regular file: a device might never end. It is an input (files.h).
/// Throws std::runtime_error that names the path and the reason.
std::string ReadFile(const std::filesystem::path& path);

// Files and folders for the time of a command: none is left, however the command ends.

/// A file or folder under way. It is removed with its owner, and before SIGHUP, SIGINT or SIGTERM
/// ends this process; a signal that is ignored or has a handler (processes.h) stays as it is.
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

/// A new folder in the system's folder for temporary files. It holds a lock: the next folder of
/// the same name removes those whose process was killed.
class TemporaryFolder {
 public:
  /// @param name  first part of the folder's name. Throws std::runtime_error if the folder cannot
  ///              be made.
  explicit TemporaryFolder(const std::string& name);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path path() const { return unfinished_->path(); }

 private:
  std::optional<Unfinished> unfinished_;
  int lock_ = -1;
};

// The one place that decides where output goes.
//
//   PATH is                         output goes
//   a new name, a regular file      to a temporary file beside it, which takes its name at the end
//   a symbolic link                 to the file that it leads to, in the same way; the link stays
//   a character device, a pipe      into it
//   standard output or error        into it, behind all that was printed
//   a file the command has read     nowhere: refused
//   a folder, a block device, ...   nowhere: refused

/// While it lives, the files that NoteInput() names are inputs, and output onto them is refused.
/// One at a time; without one there are no inputs.
class CommandInputs {
 public:
  CommandInputs();
  ~CommandInputs();
  CommandInputs(const CommandInputs&) = delete;
  CommandInputs& operator=(const CommandInputs&) = delete;
};
/// Called by all that reads files. From any thread.
void NoteInput(const std::filesystem::path& path);

/// Whether a file may be written that the command has read: its own records, never a result.
enum class Onto { kNoInput, kAnyFile };

/// Throws as OutputFile does, and writes nothing: before work that takes long.
void RequireOutput(const std::filesystem::path& path);

/// Symbolic links followed to their end, which may be missing.
std::filesystem::path BehindLinks(std::filesystem::path file);

/// Removes the temporary files of OutputFile in `folder` whose process was killed: it is gone, and
/// no process of another machine holds the lock of the file.
void RemoveAbandoned(const std::filesystem::path& folder);

/// Output under way. A reader of a regular file finds the old contents or the new ones.
class OutputFile {
 public:
  /// Makes missing folders. Throws std::runtime_error, here and below, with the path and the
  /// reason.
  /// @param ending  of the temporary file; "": a unique one
  explicit OutputFile(const std::filesystem::path& path, Onto onto = Onto::kNoInput,
                      std::string_view ending = "");
  /// Without Finish() a regular file stays as it was.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void Write(std::string_view text);
  /// Once, at the end: the file is on the disk.
  void Finish();
  /// Like Finish(), but returns false and keeps the old file if one of the name exists by now.
  bool FinishIfNew();

 private:
  void Close();

  std::filesystem::path path_, target_;  ///< target_: behind links; "" of a device or pipe
  std::optional<Unfinished> part_;
  int descriptor_ = -1;
};

// The version of all that Loopbench reads back: configuration files, lines of stores, histories.

/// It is raised when a file of today could be misread by yesterday's program or the other way
/// round. What says none is of the time before 1.0 and read as 1: nothing changed its meaning.
/// docs/release.md has the promise.
inline constexpr int kFileFormat = 1;

/// What is expected where another stands; {}: kFileFormat.
inline constexpr const char* kExpectedFormat = "{}, the format that this version reads";

}  // namespace loopbench::harness
