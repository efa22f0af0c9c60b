// import and convert: mechanisms from and for other programs.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "harness/cli/command_line.h"
#include "harness/cli/commands.h"
#include "harness/config/mechanism_reader.h"
#include "harness/exchange/export_mechanism.h"
#include "harness/exchange/import.h"
#include "harness/isolation/processes.h"
#include "harness/record/record.h"
#include "harness/text/files.h"
#include "harness/text/numeric_option.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {
namespace {

struct ImportCommand {
  std::filesystem::path file;
  std::filesystem::path out;  ///< "": the file's name with .json, in the current folder
  ImportOptions options;
  bool json = false;
  ProcessLimits limits = kFileLimits;
};

/// Returns the output file, which is never an input file.
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

/// Writes the mechanism and prints the parts of the file that it lacks. The work is done in a child
/// process under the limits.
int Import(const ImportCommand& command) {
  return PrintFromChild(command.file.string(), command.limits, [&] { return ImportHere(command); });
}

/// Parses three numbers: "0,0,-1.62".
Eigen::Vector3d ParseGravity(const std::string& text) {
  Eigen::Vector3d gravity;
  const char* at = text.data();
  const char* end = at + text.size();
  for (int i = 0; i < 3; ++i) {
    const auto [next, error] = std::from_chars(at, end, gravity[i]);
    const bool ends_well = i < 2 ? next != end && *next == ',' : next == end;
    if (error != std::errc() || !ends_well || !std::isfinite(gravity[i])) {
      throw ConfigError("--gravity " + text + ": found \"" + text +
                        "\", expected three numbers: 0,0,-9.81 [m/s^2]");
    }
    at = next + 1;
  }
  return gravity;
}

}  // namespace

void AddImport(Commands& commands) {
  auto& command = commands.Keep<ImportCommand>();
  auto& gravity = commands.Keep<std::string>();
  CLI::App* app =
      commands.Add("import", "Read a mechanism of MuJoCo (MJCF), URDF or SDF", [&](const Typed&) {
        if (!gravity.empty()) command.options.gravity = ParseGravity(gravity);
        return Import(command);
      });
  ImportOptions& options = command.options;
  app->add_option("file", command.file, "Model file (XML)")->required();
  app->add_option("-o,--out", command.out, "Mechanism file (default: NAME.json here)");
  app->add_option("--input-format", options.format, "Expected input format")
      ->check(CLI::IsMember(ImportFormats()));
  app->add_option("--loops", options.sidecar,
                  "Sidecar file (JSON): loops, joints, forces, initial, gravity, known_solution");
  app->add_flag("--planar", options.planar,
                "Import as a planar mechanism; an error if it is spatial");
  app->add_flag("--floating", options.floats, "Free root link instead of a fixed one (URDF)");
  app->add_flag("--keep-digits", options.keeps_digits,
                "Keep rounded angles and directions (1.5708) as written");
  app->add_option("--gravity", gravity, "Gravity x,y,z [m/s^2] instead of the file's");
  app->add_flag("--json", command.json,
                "One JSON document instead (docs/exchange.md has its keys)");
  AddLimits(app, &command.limits);
}

// convert: writes a mechanism in the format of another program.

namespace {

struct ConvertCommand {
  std::filesystem::path mechanism;
  std::string to;             ///< a name of ExportFormats()
  std::filesystem::path out;  ///< "": the mechanism file's name with the format's ending
  exchange::ExportOptions options;
  bool json = false;
  ProcessLimits limits = kFileLimits;
};

const exchange::ExportFormat& FormatNamed(const std::string& name) {
  return *std::ranges::find(exchange::ExportFormats(), name, &exchange::ExportFormat::name);
}

/// Prints the document; `out` is empty if no file is written.
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
  } catch (const exchange::Unsupported& missing) {
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

/// Returns 0. If the format cannot represent parts of the mechanism, prints them, writes nothing
/// and returns 2.
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

}  // namespace

void AddConvert(Commands& commands) {
  auto& command = commands.Keep<ConvertCommand>();
  CLI::App* app = commands.Add("export-mechanism", "Write a mechanism for MuJoCo or Simbody",
                               [&](const Typed&) { return Convert(command); });
  app->add_option("mechanism", command.mechanism, "Mechanism file (JSON)")->required();
  app->add_option("--to", command.to, "mjcf: MuJoCo model; simbody: C++17 program")
      ->required()
      ->check(CLI::IsMember(ExportFormatNames()));
  app->add_option("-o,--out", command.out, "Output file (default: NAME.xml or NAME.cpp here)");
  app->add_option("--step", command.options.time_step,
                  "MuJoCo's step [s]; loop constraints are as stiff as it permits (mjcf)")
      ->check(NumberFrom(1e-12, 1e3))
      ->capture_default_str();
  AddJson(app, &command.json);
  AddLimits(app, &command.limits);
}

}  // namespace loopbench::harness
