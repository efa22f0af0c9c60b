#include "harness/cli/program_view.h"

#include "harness/cli/options.h"
#include "harness/view/camera.h"

namespace loopbench::harness {

ViewOptions::ViewOptions(CLI::App& app) {
  app_ = app.add_subcommand("view", "Draw a mechanism: interactive HTML, SVG or text");
  app_->add_option("mechanism", view_.mechanism, "Mechanism file (JSON)")->required();
  app_->add_option("--format", view_.format,
                   "html: a page for browsers, without network; svg; text: tables of places "
                   "(default: by the ending of --out, else html)")
      ->check(CLI::IsMember({"html", "svg", "text"}));
  app_->add_option("-o,--out", view_.out,
                   "File (default: the mechanism file's name with .html or .svg, here; text on "
                   "the terminal)");
  app_->add_option("--view", view_.svg.view, "Viewing direction of a spatial mechanism (SVG)")
      ->check(CLI::IsMember(ViewNames()))
      ->capture_default_str();
  app_->add_flag("--plain", view_.svg.plain,
                 "svg: only the mechanism, without what the file said before the assembly and "
                 "without lines of text");
  app_->add_flag("--all", view_.all, "text: every row of long tables");
  AddLimits(app_, &view_.limits);
  app_->footer(
      "The page shows each degree of freedom as a motion, redundant constraints, and what a run\n"
      "leaves out. A mechanism whose loops do not close is drawn as the file says it, with the "
      "gaps;\n"
      "the exit code is then 2.\n"
      "  loopbench view my.json\n"
      "  loopbench view my.json --out my.svg --view side --plain");
}

std::optional<int> ViewOptions::Run() const {
  if (!*app_) return std::nullopt;
  return View(view_);
}

}  // namespace loopbench::harness
