// view: a mechanism as a page, as a picture for papers, as tables.
#include <filesystem>
#include <string>

#include "harness/cli/command_line.h"
#include "harness/cli/commands.h"
#include "harness/cli/explain.h"
#include "harness/config/mechanism_reader.h"
#include "harness/isolation/processes.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"
#include "harness/view/html.h"
#include "harness/view/picture.h"
#include "harness/view/svg.h"

namespace loopbench::harness {
namespace {

struct ViewCommand {
  std::filesystem::path mechanism;
  std::string format;         ///< html, svg or text; "" for the ending of `out`, else html
  std::filesystem::path out;  ///< "": NAME.html or NAME.svg in this folder; text: the terminal
  SvgOptions svg;
  bool all = false;  ///< every row of long tables
  ProcessLimits limits = kFileLimits;
};

std::string FormatOf(const ViewCommand& command) {
  if (!command.format.empty()) return command.format;
  const std::string ending = command.out.extension().string();
  if (ending == ".svg") return "svg";
  return ending == ".txt" ? "text" : "html";
}

void PrintPicture(const Picture& picture, const ExplainView& view) {
  Print("{} ({})\n", picture.name, picture.file);
  if (!picture.freedom.empty()) Print("  degrees of freedom: {}\n", picture.freedom);
  for (const Table& table : ToTables(picture)) {
    Table untitled = table;
    untitled.title.clear();
    PrintSection(table.title, untitled, view);
  }
  if (!picture.notes.empty()) Print("\nWhat a run leaves out, and what is not shown\n");
  for (const std::string& note : picture.notes) Print("  {}\n", note);
}

int ViewHere(const ViewCommand& command, const std::string& format, const ExplainView& view) {
  const Picture picture =
      MakePicture(ReadMechanism(command.mechanism).description, command.mechanism.string());
  if (format == "text" && command.out.empty()) {
    PrintPicture(picture, view);
  } else {
    std::filesystem::path out = command.out;
    if (out.empty()) out = FileName(command.mechanism.stem().string()) + "." + format;
    std::string text;
    if (format == "text") {
      for (const Table& table : ToTables(picture)) text += ToText(table) + "\n";
    } else {
      text = format == "svg" ? ToSvg(picture, command.svg) : ToHtml(picture);
    }
    WriteFileAtomically(out, text);
    Print("wrote {}: {} bodies, {} joints, {} motions, {} kB\n", out.string(), picture.bodies - 1,
          picture.joints, picture.motions.size(), (text.size() + 999) / 1000);
  }
  if (picture.assembled) return 0;
  PrintError("not assembled: {}\n", picture.message);
  return 2;
}

/// Returns 0, or 2 if the start cannot be assembled: the picture then shows the mechanism of the
/// file with its open loops.
int View(const ViewCommand& command) {
  const std::string format = FormatOf(command);
  if (format == "html" && command.svg.view != ViewNames().front()) {
    throw ConfigError("--view is for svg: a page is turned by hand");
  }
  const ExplainView view = ViewOfOutput(command.all);
  return PrintFromChild(command.mechanism.string(), command.limits,
                        [&] { return ViewHere(command, format, view); });
}

}  // namespace

void AddView(Commands& commands) {
  auto& command = commands.Keep<ViewCommand>();
  CLI::App* app = commands.Add("view", "Draw a mechanism: interactive HTML, SVG or text",
                               [&](const Typed&) { return View(command); });
  app->add_option("mechanism", command.mechanism, "Mechanism file (JSON)")->required();
  app->add_option("--format", command.format,
                  "Output format (default: by the ending of --out, else html)")
      ->check(CLI::IsMember({"html", "svg", "text"}));
  app->add_option("-o,--out", command.out,
                  "Output file (default: NAME.html or NAME.svg here; text goes to the terminal)");
  app->add_option("--view", command.svg.view, "Viewing direction of a spatial mechanism (SVG)")
      ->check(CLI::IsMember(ViewNames()))
      ->capture_default_str();
  app->add_flag("--no-annotations", command.svg.plain,
                "SVG of the mechanism alone, without text and unassembled start");
  app->add_flag("--all", command.all, "Print all rows of long tables (text)");
  AddLimits(app, &command.limits);
}

}  // namespace loopbench::harness
