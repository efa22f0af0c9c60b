#include "harness/text/temporary_folder.h"

#include <cstdlib>
#include <system_error>

#include "harness/text/files.h"

namespace loopbench::harness {

TemporaryFolder::TemporaryFolder(const std::string& name) {
  std::string made = (std::filesystem::temp_directory_path() / (name + "-XXXXXX")).string();
  if (::mkdtemp(made.data()) == nullptr) FailOn("make", made);
  path_ = made;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace loopbench::harness
