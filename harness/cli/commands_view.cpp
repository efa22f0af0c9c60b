#include "harness/cli/commands_view.h"

#include "harness/cli/commands_explain.h"
#include "harness/config/mechanism_reader.h"
#include "harness/isolation/print_from_child.h"
#include "harness/text/config_error.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"
#include "harness/view/camera.h"
#include "harness/view/html.h"
#include "harness/view/text.h"

namespace loopbench::harness {
namespace {

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

}  // namespace

int View(const ViewCommand& command) {
  const std::string format = FormatOf(command);
  if (format == "html" && command.svg.view != ViewNames().front()) {
    throw ConfigError("--view is for svg: a page is turned by hand");
  }
  const ExplainView view = ViewOfOutput(command.all);
  return PrintFromChild(command.mechanism.string(), command.limits,
                        [&] { return ViewHere(command, format, view); });
}

}  // namespace loopbench::harness
