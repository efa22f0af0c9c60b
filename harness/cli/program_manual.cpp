// The manual page, from the declarations of options.
#include <fmt/format.h>

#include "harness/cli/program_shell.h"
#include "harness/record/provenance.h"

namespace loopbench::harness {
namespace {

/// Text as roff shows it, whatever it begins with.
std::string Roff(std::string_view text) {
  std::string roff;
  bool begins_line = true;
  for (const char c : text) {
    if (begins_line && (c == '.' || c == '\'')) roff += "\\&";
    if (c == '\\') {
      roff += "\\e";
    } else if (c == '-') {
      roff += "\\-";
    } else {
      roff += c;
    }
    begins_line = c == '\n';
  }
  return roff;
}

std::string Block(std::string_view text) {
  while (text.starts_with('\n')) text.remove_prefix(1);
  return text.empty() ? "" : fmt::format(".PP\n.nf\n{}\n.fi\n", Roff(text));
}

std::string OptionEntry(const CLI::Option& option) {
  const bool takes = option.get_items_expected_max() > 0;
  std::string value = takes ? option.get_type_name() : "";
  if (!option.get_default_str().empty()) value += " = " + option.get_default_str();
  const std::string name =
      option.get_positional() ? option.get_name(true) : option.get_name(false, true);
  return fmt::format(".TP\n\\fB{}\\fR{}{}\n{}\n", Roff(name), value.empty() ? "" : " ", Roff(value),
                     Roff(option.get_description()));
}

std::string CommandSection(const CLI::App& command) {
  std::string usage = "loopbench " + command.get_name();
  std::string entries;
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional()) {
      usage += " " + option->get_name(true) + (option->get_items_expected_max() > 1 ? " ..." : "");
    }
    entries += OptionEntry(*option);
  }
  return fmt::format(".SS {} [options]\n{}.\n{}{}", Roff(usage), Roff(command.get_description()),
                     entries, Block(command.get_footer()));
}

}  // namespace

std::string ManualPage(const CLI::App& app) {
  const std::string version = VersionText();
  std::string page = fmt::format(
      ".TH LOOPBENCH 1 \"\" \"{}\" \"\"\n.SH NAME\nloopbench \\- {}\n"
      ".SH SYNOPSIS\n.B loopbench\n\\fIcommand\\fR [\\fIoptions\\fR]\n.SH DESCRIPTION\n{}\n",
      Roff(version.substr(0, version.find('\n'))), Roff(app.get_description()),
      Block(app.get_footer()));
  page += ".SH COMMANDS\n";
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    page += CommandSection(*command);
  }
  return page;
}

}  // namespace loopbench::harness
