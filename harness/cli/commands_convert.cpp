#include "harness/cli/commands_convert.h"

#include <algorithm>

#include "harness/config/mechanism_reader.h"
#include "harness/isolation/print_from_child.h"
#include "harness/record/json_object.h"
#include "harness/text/config_error.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {
namespace {

const exchange::ExportFormat& FormatNamed(const std::string& name) {
  return *std::ranges::find(exchange::ExportFormats(), name, &exchange::ExportFormat::name);
}

/// `out` is empty where nothing is written.
void PrintDocument(const ConvertCommand& command, const std::string& name,
                   const std::filesystem::path& out, const std::vector<std::string>& missing,
                   const std::vector<exchange::Note>& notes) {
  std::vector<JsonObject> said;
  for (const exchange::Note& note : notes) {
    said.emplace_back().Add("loss", note.loss).Add("text", note.text);
  }
  JsonObject document;
  document.Add("file", command.mechanism.string()).Add("name", name).Add("to", command.to);
  if (!out.empty()) document.Add("out", out.string());
  PrintText(document.Add("missing", missing).Add("notes", said).Text() + "\n");
}

int Refuse(const ConvertCommand& command, const std::string& name,
           const std::vector<std::string>& missing) {
  PrintError("{}: found what {} does not have, so nothing is written:\n",
             command.mechanism.string(), command.to);
  for (const std::string& part : missing) PrintError("  {}\n", part);
  if (command.json) PrintDocument(command, name, {}, missing, {});
  return 2;
}

int ConvertHere(const ConvertCommand& command) {
  const exchange::ExportFormat& format = FormatNamed(command.to);
  const MechanismDescription mechanism = ReadMechanism(command.mechanism).description;
  std::filesystem::path out = command.out;
  if (out.empty()) {
    out = FileName(command.mechanism.stem().string()) + std::string(format.ending);
  }
  exchange::ExportedFile file;
  try {
    file = exchange::Export(mechanism, format, command.options);
  } catch (const exchange::NotThere& missing) {
    return Refuse(command, mechanism.name, missing.parts());
  } catch (const std::runtime_error& error) {
    throw ConfigError(command.mechanism.string() + ": " + error.what());
  }
  WriteFileAtomically(out, file.text);
  if (command.json) {
    PrintDocument(command, mechanism.name, out, {}, file.notes);
    return 0;
  }
  Print("wrote {}: {} bodies, {} joints, {} kB\n", out.string(), mechanism.bodies.size() - 1,
        mechanism.joints.size(), (file.text.size() + 999) / 1000);
  for (const exchange::Note& note : file.notes) {
    Print("  {}{}\n", note.loss ? "With a loss: " : "", note.text);
  }
  return 0;
}

}  // namespace

int Convert(const ConvertCommand& command) {
  return PrintFromChild(command.mechanism.string(), command.limits,
                        [&] { return ConvertHere(command); });
}

std::vector<std::string> ExportFormatNames() {
  std::vector<std::string> names;
  for (const exchange::ExportFormat& format : exchange::ExportFormats()) {
    names.emplace_back(format.name);
  }
  return names;
}

}  // namespace loopbench::harness
