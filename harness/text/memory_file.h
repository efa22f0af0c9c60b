// A file in memory: what a child process prints is read from it, whatever becomes of the child.
#pragma once

#include <string>

namespace loopbench::harness {

/// It has no name, and nothing of it is left however this process ends. Programs started by
/// exec do not inherit it, children made by fork do.
class MemoryFile {
 public:
  /// @param what  it is for, in messages
  explicit MemoryFile(const char* what);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  int descriptor() const { return descriptor_; }

  /// All that was written, wherever the file's position stands.
  std::string Text() const;

 private:
  int descriptor_;
};

}  // namespace loopbench::harness
