// view, import, export-mechanism, generate: mechanisms as pictures, and for other programs.
#include <sstream>

#include "harness/cli/commands.h"
#include "harness/config/formulations.h"
#include "harness/exchange/export_c.h"
#include "harness/exchange/import.h"
#include "harness/exchange/model.h"
#include "harness/figures/view.h"
#include "harness/integrator/arkode.h"
#include "harness/run/run.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {
namespace {

/// Returns the output file; without one, the name of the input with this ending in this folder.
std::filesystem::path OutOr(const std::filesystem::path& out, const std::filesystem::path& input,
                            std::string_view ending) {
  if (!out.empty()) return out;
  return FileName(input.stem().string()) + std::string(ending);
}

struct ViewCommand {
  std::filesystem::path mechanism;
  std::string format;         ///< html, svg or text; "" for the ending of `out`, else html
  std::filesystem::path out;  ///< "": NAME.html or NAME.svg in this folder; text: the terminal
  SvgOptions svg;
  bool all = false;  ///< every row of long tables
  ProcessLimits limits = kFileLimits;

  std::vector<Option> Options() {
    return {
        MechanismArgument(&mechanism),
        FormatOption(&format, {"html", "svg", "text"},
                     "Output format (default: by the ending of --out, else html)"),
        {"-o,--out", "Output file (default: NAME.html or NAME.svg here; text goes to the terminal)",
         &out},
        {"--view", "Viewing direction of a spatial mechanism (SVG)", &svg.view, OneOf(ViewNames())},
        {"--no-annotations", "SVG of the mechanism alone, without text and unassembled start",
         &svg.plain},
        {"--all", "Print all rows of long tables (text)", &all},
        WideOption(),
        CpuOption(&limits),
        MemoryOption(&limits)};
  }
};

void PrintPicture(const Picture& picture, const ExplainView& view) {
  Print("{} ({})\n", picture.name, picture.file);
  if (!picture.freedom.empty()) Print("  degrees of freedom: {}\n", picture.freedom);
  for (const Table& table : ToTables(picture)) {
    Table untitled = table;
    untitled.title.clear();
    PrintSection(table.title, untitled, view);
  }
  if (!picture.notes.empty()) Print("\nOmitted by runs, and not drawn\n");
  for (const std::string& note : picture.notes) Print("  {}\n", note);
}

int ViewHere(const ViewCommand& command, const std::string& format, const ExplainView& view) {
  const Picture picture =
      MakePicture(ReadMechanism(command.mechanism).description, command.mechanism.string());
  if (format == "text" && command.out.empty()) {
    PrintPicture(picture, view);
  } else {
    const auto out = OutOr(command.out, command.mechanism, "." + format);
    std::string text;
    if (format == "text") {
      for (const Table& table : ToTables(picture)) text += ToText(table) + "\n";
    } else {
      text = format == "svg" ? ToSvg(picture, command.svg) : ToHtml(picture);
    }
    WriteFileAtomically(out, text);
    Print("wrote {}: {}, {}, {}, {} kB\n", out.string(), WithCount(picture.bodies - 1, "body"),
          WithCount(picture.joints, "joint"), WithCount(picture.motions.size(), "motion"),
          (text.size() + 999) / 1000);
  }
  if (picture.assembled) return 0;
  PrintError("not assembled: {}\n", picture.message);
  return 2;
}

/// Returns 0, or 2 if the start cannot be assembled: the picture then shows the mechanism of the
/// file with its open loops.
int View(ViewCommand& command, const Typed&) {
  const std::string ending = command.out.extension().string();
  std::string format = command.format;
  if (format.empty()) format = ending == ".svg" ? "svg" : ending == ".txt" ? "text" : "html";
  if (format != "svg") RejectPictures(command.out, "\".html\", \".svg\" or \".txt\"");
  if (format == "html" && command.svg.view != ViewNames().front()) {
    throw ConfigError("--view is for svg: a page is turned by hand");
  }
  const ExplainView view{.all = command.all};
  return PrintFromChild(command.mechanism.string(), command.limits,
                        [&] { return ViewHere(command, format, view); });
}

struct ImportCommand {
  std::filesystem::path file;
  std::filesystem::path out;  ///< "": the file's name with .json, in the current folder
  ImportOptions options;
  std::string gravity;  ///< "": the file's
  bool json = false;
  ProcessLimits limits = kFileLimits;

  std::vector<Option> Options() {
    return {
        {"file", "Model file (XML)", &file, kRequired},
        {"-o,--out", "Mechanism file (default: NAME.json here)", &out},
        {"--input-format", "Expected input format", &options.format, OneOf(ImportFormats())},
        {"--loops", "Sidecar file (JSON): loops, joints, forces, initial, gravity, known_solution",
         &options.sidecar},
        {"--planar", "Import as a planar mechanism; an error if it is spatial", &options.planar},
        {"--floating", "Free root link instead of a fixed one (URDF)", &options.floats},
        {"--keep-digits", "Keep rounded angles and directions (1.5708) as written",
         &options.keeps_digits},
        {"--balance-inertia",
         "Replace moments of inertia that violate the triangle inequality by their mean",
         &options.balances_inertia},
        {"--gravity", "Gravity x,y,z [m/s^2] instead of the file's", &gravity},
        {"--json", "One JSON document instead (docs/exchange.md has its keys)", &json},
        CpuOption(&limits),
        MemoryOption(&limits)};
  }
};

/// Returns the output file, which is never an input file.
std::filesystem::path OutOf(const ImportCommand& command) {
  std::filesystem::path out = OutOr(command.out, command.file, ".json");
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
  std::vector<JsonObject> notes = Mapped<JsonObject>(imported.notes, [](const ImportNote& note) {
    return JsonOf("file", note.file, "line", note.line, "element", note.element, "reason",
                  note.reason, "changes_motion", note.changes_motion);
  });
  return JsonOf("file", command.file.string(), "format", imported.format, "mechanism", out.string(),
                "name", description.name, "space", description.space, "bodies",
                description.bodies.size() - 1, "joints", description.joints.size(), "forces",
                description.forces.size(), "notes", notes);
}

/// Writes the mechanism and prints the parts of the file that it lacks.
int ImportHere(const ImportCommand& command) {
  const std::filesystem::path out = OutOf(command);
  const Imported imported = ImportMechanism(command.file, command.options);
  const MechanismDescription& description = imported.description;
  const std::string comment =
      fmt::format("Imported from {} ({}).", command.file.filename().string(), imported.format);
  WriteFileAtomically(out, MechanismText(description, imported.observe, comment));
  if (command.json) return PrintJson(Document(imported, command, out));
  for (const ImportNote& note : imported.notes) {
    Print("{}:{}: {}: {}{}\n", note.file, note.line, note.element, note.reason,
          note.changes_motion ? " [changes the motion]" : "");
  }
  const auto changed = std::ranges::count(imported.notes, true, &ImportNote::changes_motion);
  Print("wrote {}: {}, {}, {}, {}; {}, {} of them {} the motion\n", out.string(),
        ToString(description.space), WithCount(description.bodies.size() - 1, "body"),
        WithCount(description.joints.size(), "joint"),
        WithCount(description.forces.size(), "force"), WithCount(imported.notes.size(), "note"),
        changed, changed == 1 ? "changes" : "change");
  return 0;
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

int Import(ImportCommand& command, const Typed&) {
  if (!command.gravity.empty()) command.options.gravity = ParseGravity(command.gravity);
  return PrintFromChild(command.file.string(), command.limits, [&] { return ImportHere(command); });
}

struct ConvertCommand {
  std::filesystem::path mechanism;
  std::string to;             ///< a name of ExportFormats()
  std::filesystem::path out;  ///< "": the mechanism file's name with the format's ending
  double time_step = exchange::kTimeStep;  ///< of MuJoCo [s]
  bool json = false;
  ProcessLimits limits = kFileLimits;

  std::vector<Option> Options() {
    return {MechanismArgument(&mechanism),
            {"--to", "mjcf: MuJoCo model; simbody: C++17 program", &to, kRequired,
             OneOf(Mapped<std::string>(exchange::ExportFormats(), &exchange::ExportFormat::name))},
            {"-o,--out", "Output file (default: NAME.xml or NAME.cpp here)", &out},
            {"--step", "MuJoCo's step [s]; loop constraints are as stiff as it permits (mjcf)",
             &time_step, From(1e-12, 1e3)},
            JsonOption(&json),
            CpuOption(&limits),
            MemoryOption(&limits)};
  }
};

/// Prints the document; `out` is empty if no file is written.
void PrintDocument(const ConvertCommand& command, const std::string& name,
                   const std::filesystem::path& out, const std::vector<std::string>& missing,
                   const std::vector<exchange::Note>& notes) {
  std::vector<JsonObject> rows = Mapped<JsonObject>(notes, [](const exchange::Note& note) {
    return JsonOf("loss", note.loss, "text", note.text);
  });
  JsonObject document = JsonOf("file", command.mechanism.string(), "name", name, "to", command.to);
  if (!out.empty()) document.Add("out", out.string());
  PrintJson(Put(document, "missing", missing, "notes", rows));
}

/// Returns 0. If the format cannot represent parts of the mechanism, prints them, writes nothing
/// and returns 2.
int ConvertHere(const ConvertCommand& command) {
  const exchange::ExportFormat& format =
      *std::ranges::find(exchange::ExportFormats(), command.to, &exchange::ExportFormat::name);
  const MechanismDescription mechanism = ReadMechanism(command.mechanism).description;
  const auto out = OutOr(command.out, command.mechanism, format.ending);
  exchange::ExportedFile file;
  try {
    file = format.write(mechanism, command.time_step);
  } catch (const exchange::Unsupported& missing) {
    PrintError("{}: found what {} does not have, so nothing is written:\n",
               command.mechanism.string(), command.to);
    for (const std::string& part : missing.parts()) PrintError("  {}\n", part);
    if (command.json) PrintDocument(command, mechanism.name, {}, missing.parts(), {});
    return 2;
  } catch (const std::runtime_error& error) {
    throw ConfigError(command.mechanism.string() + ": " + error.what());
  }
  WriteFileAtomically(out, file.text);
  if (command.json) {
    PrintDocument(command, mechanism.name, out, {}, file.notes);
    return 0;
  }
  Print("wrote {}: {}, {}, {} kB\n", out.string(), WithCount(mechanism.bodies.size() - 1, "body"),
        WithCount(mechanism.joints.size(), "joint"), (file.text.size() + 999) / 1000);
  for (const exchange::Note& note : file.notes) {
    Print("  {}{}\n", note.loss ? "With a loss: " : "", note.text);
  }
  return 0;
}

int Convert(ConvertCommand& command, const Typed&) {
  return PrintFromChild(command.mechanism.string(), command.limits,
                        [&] { return ConvertHere(command); });
}

struct GenerateCommand {
  std::filesystem::path mechanism, out;
  std::filesystem::path fmu;  ///< "": none
  std::string formulation = "lagrange", level = "acceleration", coordinates = "joint";
  std::string solver = "rank-revealing";
  double horizon = 10.0;  ///< length of the motion whose branches are generated [s]
  double step = 0.0;      ///< step of the example and of co-simulation [s]; 0: from the motion
  bool json = false;
  ProcessLimits limits = kFileLimits;

  std::vector<Option> Options() {
    return {MechanismArgument(&mechanism),
            {"-o,--out", "Folder of the C files", &out, kRequired},
            {"--fmu", "File for an FMU (FMI 2.0) of the same code", &fmu},
            {"--formulation", "Formulation", &formulation, OneOf(FormulationNamesWithoutPeers())},
            {"--enforcement", "Level of enforcement", &level, OneOf({"acceleration", "velocity"})},
            {"--coordinates", "Coordinate set", &coordinates, OneOf({"joint", "absolute"})},
            {"--solver", "Solver", &solver, OneOf({"plain", "rank-revealing"})},
            {"--horizon", "Duration of the motion whose branches are generated [s]", &horizon,
             From(0.0, 1e6)},
            {"--step",
             "Step of the example and of co-simulation [s] (default: a quarter of the median step "
             "of ode45 at 1e-6, at most 1e-3)",
             &step, From(1e-9, 1e3)},
            JsonOption(&json),
            CpuOption(&limits),
            MemoryOption(&limits)};
  }
};

// integrator of the motion along which branches are recorded
constexpr const char* kProfile = "ode45";
constexpr double kTolerance = 1e-6;
constexpr std::size_t kMinStates = 500, kMaxStates = 2000;

/// Returns a quarter of the median step of `states`, at most 1 ms, rounded down to 1, 2, 5 x 10^n.
double StepOf(const std::vector<exchange::MotionState>& states) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < states.size(); ++i) steps.push_back(states[i].t - states[i - 1].t);
  if (steps.empty()) return 1e-3;
  std::ranges::nth_element(steps, steps.begin() + std::ssize(steps) / 2);
  const double step = std::min(1e-3, steps[steps.size() / 2] / 4.0);
  const double decade = std::pow(10.0, std::floor(std::log10(step) + 1e-9));
  return decade * (step >= 5.0 * decade ? 5.0 : step >= 2.0 * decade ? 2.0 : 1.0);
}

/// Adds the start, accepted steps of the motion from it, and the step for fixed steps; the mode of
/// the start is kept, as in generated code.
template <class Space>
IntegratorResult Move(const GenerateCommand& command, exchange::CodeRequest& request) {
  const generate::RecordingSubject& subject = request.subject;
  const Mechanism<Space, double> mechanism(subject.description, subject.coordinates);
  const Start<double> start = Assemble<Space>(subject.description, mechanism);
  if (start.outcome != Outcome::kFinished) {
    throw ConfigError(fmt::format("{}: {}: {}", command.mechanism.string(), ToString(start.outcome),
                                  start.message));
  }
  const auto system = MakeFormulation<Space>(subject.formulation, mechanism, subject.options);
  request.start = {0.0, start.q, start.u};
  system->Start(0.0, start.q, start.u);
  std::vector<double> y(static_cast<std::size_t>(system->size()));
  system->ToState(start.q, start.u, y);
  IntegratorOptions options;
  options.profile = kProfile;
  options.stop_times = mechanism.stop_times();
  options.max_step = command.horizon / kMinStates;
  options.rtol = options.atol = kTolerance;
  const auto note = [&](double t, std::span<double> state) {
    request.motion.push_back({t, {state.begin(), state.end()}});
    return StepAction::kContinue;
  };
  IntegratorResult result = Integrate(*system, 0.0, command.horizon, y, options, note);
  std::vector<exchange::MotionState>& states = request.motion;
  request.step = command.step > 0.0 ? command.step : StepOf(states);
  const std::size_t every = states.size() / kMaxStates + 1;
  for (std::size_t i = 0; i * every < states.size(); ++i) std::swap(states[i], states[i * every]);
  states.resize((states.size() + every - 1) / every);
  return result;
}

int GenerateHere(const GenerateCommand& command) {
  if (!command.fmu.empty()) RequireOutput(command.fmu);
  const MechanismFile file = ReadMechanism(command.mechanism);
  const SimplifiedProblem problem = SimplifyProblem(file.description, file.observe, {});
  const MechanismDescription& description = problem.compiled.parts.front().description;
  std::vector<std::string> lines;
  std::istringstream version(VersionText());
  for (std::string line; std::getline(version, line);) lines.push_back(line);
  exchange::CodeRequest request{
      .subject = {.description = description,
                  .coordinates = *Parse<Coordinates>(command.coordinates),
                  .formulation = command.formulation,
                  .options = {.enforcement = *Parse<Enforcement>(command.level),
                              .solver = *Parse<SolverKind>(command.solver)}},
      .provenance = {lines.at(0) + ", " + lines.at(1),
                     fmt::format("{}: formulation {}, level {}, {} coordinates, solver {}",
                                 command.mechanism.filename().string(), command.formulation,
                                 command.level, command.coordinates, command.solver)}};
  const IntegratorResult motion = description.space == SpaceKind::kPlanar
                                      ? Move<Planar>(command, request)
                                      : Move<Spatial>(command, request);
  exchange::Code code;
  std::string fmu;
  try {
    code = exchange::MakeCode(request);
    if (!command.fmu.empty()) fmu = exchange::MakeFmu(code, file.description.name, request.step);
  } catch (const generate::NotCovered& why) {
    throw ConfigError(command.mechanism.string() + ": cannot be generated: " + why.what());
  }
  std::error_code ignored;
  const auto archive = std::filesystem::weakly_canonical(command.fmu, ignored);
  for (const exchange::CodeFile& part : code.files) {
    if (archive.empty() || weakly_canonical(command.out / part.name, ignored) != archive) continue;
    Reject("--fmu: found \"{}\", expected a file other than the generated code",
           command.fmu.string());
  }
  for (const exchange::CodeFile& part : code.files) {
    WriteFileAtomically(command.out / part.name, part.text);
  }
  if (!fmu.empty()) WriteFileAtomically(command.fmu, fmu);
  if (command.json) {
    std::vector<JsonObject> functions;
    for (const exchange::CodeFunction& function : code.functions) {
      functions.push_back(JsonOf("name", function.name, "flops", function.operations, "branches",
                                 function.branches, "states_missed", function.missed));
    }
    return PrintJson(JsonOf("file", command.mechanism.string(), "out", command.out.string(),
                            "identifier", code.identifier, "states", code.state_names.size(),
                            "t_reached", motion.t_reached, "functions", functions));
  }
  Print("wrote {0}.h, {0}.c, {0}_example.c and CMakeLists.txt to {1}{2}\n", code.identifier,
        command.out.string(), fmu.empty() ? "" : ", and " + command.fmu.string());
  std::vector<std::string> counts;
  for (const exchange::CodeFunction& function : code.functions) {
    AddNote(counts, "{} {} ({})", function.name, function.operations, function.branches);
  }
  Print("{} states; weighted operations (branches): {}\n", code.state_names.size(),
        fmt::join(counts, ", "));
  if (motion.outcome != Outcome::kFinished) {
    Print(
        "warning: the motion ended as {} at t = {:.6g} s of {:.6g} s; branches behind that are "
        "missing\n",
        ToString(motion.outcome), motion.t_reached, command.horizon);
  }
  for (const exchange::CodeFunction& function : code.functions) {
    if (function.missed == 0) continue;
    Print("warning: {}: {} branches do not serve {} of {} states of the motion\n", function.name,
          function.branches, function.missed, request.motion.size());
  }
  return 0;
}

int Generate(GenerateCommand& command, const Typed&) {
  return PrintFromChild(command.mechanism.string(), command.limits,
                        [&] { return GenerateHere(command); });
}

}  // namespace

void AddView(Commands& commands) {
  commands.Add("view", "Draw a mechanism: interactive HTML, SVG or text", View);
}
void AddImport(Commands& commands) {
  commands.Add("import", "Read a mechanism of MuJoCo (MJCF), URDF or SDF", Import);
}
void AddConvert(Commands& commands) {
  commands.Add("export-mechanism", "Write a mechanism for MuJoCo or Simbody", Convert);
}
void AddGenerate(Commands& commands) {
  commands.Add("generate", "Write a mechanism's equations of motion as C99 or FMU", Generate);
}

}  // namespace loopbench::harness
