// Files and folders for the time of a command: none is left, however the command ends.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace loopbench::harness {

/// A file or folder under way. It is removed with its owner, and before SIGHUP, SIGINT or SIGTERM
/// ends this process; a signal that is ignored or has a handler (interruption.h) stays as it is.
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

}  // namespace loopbench::harness
