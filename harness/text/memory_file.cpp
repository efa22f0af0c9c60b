#include "harness/text/memory_file.h"

#include <sys/mman.h>
#include <unistd.h>

#include <array>

#include "harness/text/files.h"

namespace loopbench::harness {

MemoryFile::MemoryFile(const char* what) : descriptor_(::memfd_create(what, MFD_CLOEXEC)) {
  if (descriptor_ < 0) FailOn("make in memory", what);
}

MemoryFile::~MemoryFile() { ::close(descriptor_); }

std::string MemoryFile::Text() const {
  std::string text;
  std::array<char, 1 << 16> buffer{};
  for (off_t at = 0;;) {
    const ssize_t count = ::pread(descriptor_, buffer.data(), buffer.size(), at);
    if (count <= 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(count));
    at += count;
  }
}

}  // namespace loopbench::harness
