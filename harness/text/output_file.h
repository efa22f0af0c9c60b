// The one place that decides where output goes.
//
//   PATH is                         output goes
//   a new name, a regular file      to a temporary file beside it, which takes its name at the end
//   a symbolic link                 to the file that it leads to, in the same way; the link stays
//   a character device, a pipe      into it
//   standard output or error        into it, behind all that was printed
//   a file the command has read     nowhere: refused
//   a folder, a block device, ...   nowhere: refused
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "harness/text/temporary_folder.h"

namespace loopbench::harness {

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

}  // namespace loopbench::harness
