#include "harness/cli/commands_import.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/config/mechanism_writer.h"
#include "harness/isolation/print_from_child.h"
#include "harness/record/json_object.h"
#include "harness/text/config_error.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {
namespace {

/// Never one of those that are read.
std::filesystem::path OutOf(const ImportCommand& command) {
  std::filesystem::path out = command.out;
  if (out.empty()) out = FileName(command.file.stem().string()) + ".json";
  std::error_code none;
  for (const std::filesystem::path& read : {command.file, command.options.sidecar}) {
    if (!read.empty() && std::filesystem::equivalent(out, read, none)) {
      throw ConfigError(
          fmt::format("--out {}: found a file that is read, expected another name", out.string()));
    }
  }
  return out;
}

JsonObject Document(const Imported& imported, const ImportCommand& command,
                    const std::filesystem::path& out) {
  const MechanismDescription& description = imported.description;
  std::vector<JsonObject> notes;
  for (const ImportNote& note : imported.notes) {
    JsonObject& one = notes.emplace_back();
    one.Add("line", std::int64_t{note.line});
    one.Add("element", note.element);
    one.Add("reason", note.reason);
    one.Add("changes_motion", note.changes_motion);
  }
  JsonObject document;
  document.Add("file", command.file.string());
  document.Add("format", imported.format);
  document.Add("mechanism", out.string());
  document.Add("name", description.name);
  document.Add("space", std::string(ToString(description.space)));
  document.Add("bodies", Count(description.bodies.size() - 1));
  document.Add("joints", Count(description.joints.size()));
  document.Add("forces", Count(description.forces.size()));
  document.Add("notes", notes);
  return document;
}

int ImportHere(const ImportCommand& command) {
  const std::filesystem::path out = OutOf(command);
  const Imported imported = ImportMechanism(command.file, command.options);
  const MechanismDescription& description = imported.description;
  const std::string comment =
      fmt::format("Imported from {} ({}).", command.file.filename().string(), imported.format);
  WriteFileAtomically(out, MechanismText(description, imported.observe, comment));
  if (command.json) {
    PrintText(Document(imported, command, out).Text() + "\n");
    return 0;
  }
  for (const ImportNote& note : imported.notes) {
    Print("{}:{}: {}: {}{}\n", command.file.string(), note.line, note.element, note.reason,
          note.changes_motion ? " [changes the motion]" : "");
  }
  const auto changed = std::ranges::count(imported.notes, true, &ImportNote::changes_motion);
  Print("wrote {}: {}, {} bodies, {} joints, {} forces; {} notes, {} of them change the motion\n",
        out.string(), ToString(description.space), description.bodies.size() - 1,
        description.joints.size(), description.forces.size(), imported.notes.size(), changed);
  return 0;
}

}  // namespace

int Import(const ImportCommand& command) {
  return PrintFromChild(command.file.string(), command.limits, [&] { return ImportHere(command); });
}

}  // namespace loopbench::harness
