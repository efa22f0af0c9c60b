#include "harness/suite/kept_files.h"

#include "harness/config/mechanism_writer.h"
#include "harness/reference/reference.h"
#include "harness/text/config_error.h"
#include "harness/text/files.h"
#include "harness/text/hash.h"

namespace loopbench::harness {
namespace {

/// Records may have been written by anybody: only what a run calls its files is a name.
bool IsId(const std::string& text) {
  return text.size() == 16 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

std::filesystem::path MechanismPath(const std::filesystem::path& store_file,
                                    const std::string& scene_id) {
  return store_file.parent_path() / "mechanisms" / (scene_id + ".json");
}

}  // namespace

std::filesystem::path MechanismOf(const Record& record, const std::filesystem::path& store_file) {
  const std::string id = record.Text("scene_id");
  return IsId(id) ? MechanismPath(store_file, id) : std::filesystem::path();
}

std::filesystem::path ReferenceOf(const Record& record, const std::filesystem::path& store_file) {
  const std::string id = record.Text("reference_file");
  return IsId(id) ? ReferencePath(store_file, id) : std::filesystem::path();
}

void KeepMechanisms(const std::vector<Experiment>& experiments,
                    const std::filesystem::path& store_file) {
  for (const Experiment& experiment : experiments) {
    if (!experiment.reference && !experiment.output) continue;
    for (const ExperimentScene& scene : experiment.scenes) {
      const auto path = MechanismPath(store_file, Fnv1a(scene.mechanism.canonical));
      if (std::filesystem::exists(path)) continue;
      try {
        WriteFileAtomically(path,
                            MechanismText(scene.mechanism.description, scene.mechanism.observe));
      } catch (const ConfigError&) {
      }
    }
  }
}

void CopyMechanisms(const std::vector<Record>& records,
                    const std::vector<std::filesystem::path>& stores,
                    const std::filesystem::path& target) {
  for (const Record& record : records) {
    const std::filesystem::path to = MechanismOf(record, target);
    if (to.empty() || std::filesystem::exists(to)) continue;
    for (const std::filesystem::path& store : stores) {
      const std::filesystem::path from = MechanismOf(record, store);
      if (!std::filesystem::exists(from)) continue;
      WriteFileAtomically(to, ReadFile(from));
      break;
    }
  }
}

}  // namespace loopbench::harness
