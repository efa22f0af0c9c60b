// Where the repository lies that the tests were built from.
#pragma once

#include <filesystem>

namespace loopbench::harness {

inline const std::filesystem::path kRoot = LOOPBENCH_SOURCE_DIR;
inline const std::filesystem::path kConfigs = kRoot / "configs";

}  // namespace loopbench::harness
