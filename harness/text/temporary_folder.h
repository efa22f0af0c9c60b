// A folder for a while.
#pragma once

#include <filesystem>
#include <string>

namespace loopbench::harness {

/// A new folder among the system's temporary ones, which goes with its owner.
class TemporaryFolder {
 public:
  /// Throws std::runtime_error. @param name  its name begins so
  explicit TemporaryFolder(const std::string& name);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace loopbench::harness
