#include "harness/suite/kept_files.h"

#include <fmt/format.h>

#include <string_view>

#include "harness/config/mechanism_reader.h"
#include "harness/config/mechanism_writer.h"
#include "harness/reference/reference.h"
#include "harness/text/config_error.h"
#include "harness/text/files.h"
#include "harness/text/hash.h"
#include "harness/trajectory/store_files.h"

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

/// The comment of a file holds the hash of all its bytes, with zeros instead of the hash.
constexpr std::string_view kChecksum = "Kept by a run; checksum ", kZeros = "0000000000000000";

std::string WithOwnHash(std::string text) {
  const std::size_t at = text.find(kChecksum);
  if (at == std::string::npos) return text;  // of version 1.0
  text.replace(at + kChecksum.size(), kZeros.size(), kZeros);
  return text.replace(at + kChecksum.size(), kZeros.size(), Fnv1a(text));
}

bool IsAsWritten(const std::string& text) { return WithOwnHash(text) == text; }

}  // namespace

MechanismDescription ReadKeptMechanism(const std::filesystem::path& file) {
  if (!IsAsWritten(ReadFile(file))) {
    throw ChangedFile(fmt::format(
        "{}: the file was changed after its run wrote it: its checksum is not that of the file; "
        "remove it: the same run writes it again",
        file.string()));
  }
  return ReadMechanism(file).description;
}

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
        WriteFileAtomically(
            path, WithOwnHash(MechanismText(scene.mechanism.description, scene.mechanism.observe,
                                            fmt::format("{}{}.", kChecksum, kZeros))));
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
      const std::string text = ReadFile(from);
      if (!IsAsWritten(text)) continue;
      WriteFileAtomically(to, text);
      break;
    }
  }
}

}  // namespace loopbench::harness
