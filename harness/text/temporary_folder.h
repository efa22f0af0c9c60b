// A folder for the time of a command.
#pragma once

#include <filesystem>
#include <string>

namespace loopbench::harness {

/// A new folder, where temporary files belong on this machine, that goes with its owner.
class TemporaryFolder {
 public:
  /// @param name  what its name begins with, for whoever finds it. Throws std::runtime_error when
  ///              it cannot be made.
  explicit TemporaryFolder(const std::string& name);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace loopbench::harness
