// Services from the declarations of all subcommands and options: spelling suggestions, shell
// completion, a manual page.
#include <fmt/format.h>

#include <vector>

#include "harness/cli/command_line.h"
#include "harness/record/provenance.h"
#include "harness/text/terminal.h"
#include "harness/text/words.h"

namespace loopbench::harness {
namespace {

/// Returns the options that may follow the subcommand: "--jobs", "--help".
std::vector<std::string> OptionNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::vector<const CLI::App*> Subcommands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<std::string> CommandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : Subcommands(app)) names.push_back(command->get_name());
  return names;
}

std::string Joined(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, " "));
}

/// Returns "unknown: --fromat (did you mean --format?)".
std::string Unknown(const std::string& word, const std::vector<std::string>& known) {
  const std::string nearest = NearestSpelling(word, known);
  return fmt::format("unknown: {}{}\n", word,
                     nearest.empty() ? "" : fmt::format(" (did you mean {}?)", nearest));
}

/// Returns the accepted words of an option with a list: CLI11 shows it as "TEXT:{a,b}".
std::vector<std::string> ValuesOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t begin = type.find('{'), end = type.rfind('}');
  if (begin == std::string::npos || end == std::string::npos) return {};
  return CLI::detail::split(type.substr(begin + 1, end - begin - 1), ',');
}

bool TakesValue(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

std::string Quoted(const std::string& text) {  // for fish and zsh, between single quotes
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

/// Returns the arms of "case $command-$before": words that may follow an option with a list of
/// values, formatted by `line`.
template <class Line>
std::string ValueArms(const CLI::App& app, Line line) {
  std::string arms;
  for (const CLI::App* command : Subcommands(app)) {
    for (const CLI::Option* option : command->get_options()) {
      const std::vector<std::string> values = ValuesOf(*option);
      if (values.empty() || option->get_lnames().empty()) continue;
      arms += fmt::format("    '{} --{}') {} ;;\n", command->get_name(),
                          option->get_lnames().front(), line(Joined(values)));
    }
  }
  return arms;
}

template <class Line>
std::string OptionArms(const CLI::App& app, Line line) {
  std::string arms;
  for (const CLI::App* command : Subcommands(app)) {
    arms += fmt::format("    '{} '*) {} ;;\n", command->get_name(),
                        line(Joined(OptionNames(*command))));
  }
  return arms;
}

std::string BashScript(const CLI::App& app) {
  const auto words = [](const std::string& list) { return fmt::format("words='{}'", list); };
  return fmt::format(R"(# bash completion of loopbench
_loopbench() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} words=
  if [ "$word" = = ]; then word=; elif [ "$before" = = ]; then before=${{COMP_WORDS[COMP_CWORD-2]}}; fi
  if [ "$COMP_CWORD" -eq 1 ]; then
    words='{} {}'
  else
    case "${{COMP_WORDS[1]}} $before" in
{}    *) case "$word" in -*) case "${{COMP_WORDS[1]}} " in
{}    esac ;; esac ;;
    esac
  fi
  COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _loopbench loopbench
)",
                     fmt::join(CommandNames(app), " "), fmt::join(OptionNames(app), " "),
                     ValueArms(app, words), OptionArms(app, words));
}

std::string ZshScript(const CLI::App& app) {
  const auto add = [](const std::string& list) {
    return fmt::format("compadd -- {}; return", list);
  };
  return fmt::format(R"(#compdef loopbench
_loopbench() {{
  if (( CURRENT == 2 )); then compadd -- {} {}; return; fi
  case "${{words[2]}} ${{words[CURRENT-1]}}" in
{}  esac
  if [[ ${{words[CURRENT]}} == -* ]]; then
    case "${{words[2]}} " in
{}    esac
  fi
  _files
}}
_loopbench "$@"
)",
                     fmt::join(CommandNames(app), " "), fmt::join(OptionNames(app), " "),
                     ValueArms(app, add), OptionArms(app, add));
}

std::string FishScript(const CLI::App& app) {
  std::string script = "# fish completion of loopbench\n";
  for (const CLI::App* command : Subcommands(app)) {
    const std::string& name = command->get_name();
    script += fmt::format("complete -c loopbench -n __fish_use_subcommand -f -a {} -d {}\n", name,
                          Quoted(command->get_description()));
    for (const CLI::Option* option : command->get_options()) {
      if (option->get_lnames().empty()) continue;
      const std::vector<std::string> values = ValuesOf(*option);
      script +=
          fmt::format("complete -c loopbench -n '__fish_seen_subcommand_from {}' -l {} -d {}{}\n",
                      name, option->get_lnames().front(), Quoted(option->get_description()),
                      !values.empty()       ? fmt::format(" -x -a '{}'", fmt::join(values, " "))
                      : TakesValue(*option) ? " -r"
                                            : "");
    }
  }
  return script;
}

/// Returns a script for bash, zsh or fish that completes subcommands, options, option values from
/// lists, and file names.
std::string CompletionScript(const CLI::App& app, const std::string& shell) {
  if (shell == "zsh") return ZshScript(app);
  return shell == "fish" ? FishScript(app) : BashScript(app);
}

/// Escapes text for roff, with any first character.
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

/// Returns loopbench.1, in the macros of man(7).
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

}  // namespace

std::string WhatWasMeant(const CLI::App& app) {
  const std::vector<CLI::App*> parsed = app.get_subcommands();
  if (parsed.empty()) {
    // words after an unknown subcommand may be valid
    const std::vector<std::string> words = app.remaining();
    if (words.empty()) return "";
    const bool is_option = words.front().starts_with('-');
    return Unknown(words.front(), is_option ? OptionNames(app) : CommandNames(app));
  }
  std::string text;
  for (const std::string& word : parsed.front()->remaining()) {
    if (!word.starts_with('-')) continue;
    text += Unknown(word.substr(0, word.find('=')), OptionNames(*parsed.front()));
  }
  return text;
}

void AddShell(Commands& commands) {
  auto& shell = commands.Keep<std::string>();
  CLI::App* all = commands.app();
  const auto print = [](const std::string& text) {
    PrintText(text);
    return 0;
  };
  CLI::App* completion =
      commands.Add("completion", "Print a completion script",
                   [=, &shell](const Typed&) { return print(CompletionScript(*all, shell)); });
  completion->add_option("shell", shell, "Shell to generate for")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  completion->footer("  eval \"$(loopbench completion bash)\"      # for this shell");
  commands
      .Add("manual", "Print the manual page of all commands",
           [=](const Typed&) { return print(ManualPage(*all)); })
      ->footer("  loopbench manual | man -l -");
}

}  // namespace loopbench::harness
