// The certified references beside several stores, put beside one.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace loopbench::harness {

struct MergedReferences {
  std::map<std::string, std::string> texts;  ///< name of a file in references/ and what is in it
  std::vector<std::string> notes;            ///< of which certificate was kept, where two differ
};

/// All references of stores (`store_files`: their results.jsonl). Those of one name agree in all
/// but the time they took, or the one that is certified longer, and then to less, is kept. Throws
/// std::runtime_error, with the file's name, for one that is damaged or another's.
MergedReferences MergeReferences(const std::vector<std::filesystem::path>& store_files);

/// Writes them beside the store.
void WriteReferences(const MergedReferences& references, const std::filesystem::path& store_file);

}  // namespace loopbench::harness
