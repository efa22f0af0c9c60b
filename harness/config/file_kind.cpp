#include "harness/config/file_kind.h"

#include <string>

#include "harness/config/json_document.h"

namespace loopbench::harness {

FileKind KindOfFile(const std::filesystem::path& path) {
  const std::string text = ReadTextFile(path);
  const auto has = [&text](const char* key) { return text.find(key) != std::string::npos; };
  if (has("\"scenes\"")) return FileKind::kExperiment;
  if (has("\"claims\"")) return FileKind::kClaims;
  if (has("\"rows\"")) return FileKind::kMap;
  if (has("\"groups\"")) return FileKind::kBenchmarks;
  return FileKind::kMechanism;
}

}  // namespace loopbench::harness
