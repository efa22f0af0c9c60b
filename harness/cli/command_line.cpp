// The command line: options of all rows of commands by CLI11, and the services from the same rows:
// help, spelling suggestions, shell completion, a manual page.
#include "harness/cli/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <sstream>

#include "harness/base/numeric_option.h"
#include "harness/exchange/export_names.h"

namespace loopbench::harness {

extern const std::string_view kCommandReference;  // docs/reference/commands.md

namespace {

/// Headings of `loopbench --help`, and their commands in order.
constexpr std::pair<const char*, std::string_view> kGroups[] = {
    {"Experiments", " run list integrators estimate advise merge "},
    {"Mechanisms", " check explain assemble view simplify import export-mechanism generate count "},
    {"Results", " table plot report trajectory work-precision robustness check-claims "},
    {"Regressions", " compare fit-scaling export-metrics baseline history "},
    {"Clusters", " submit status collect "},
    {"Shell", " schema migrate completion manual "}};

/// Returns the group of a command and its place there.
std::pair<std::size_t, std::size_t> PlaceOf(const Command& row) {
  const std::string word = " " + row.name.substr(0, row.name.find(' ')) + " ";
  for (std::size_t group = 0; group < std::size(kGroups); ++group) {
    const std::size_t at = kGroups[group].second.find(word);
    if (at != std::string_view::npos) return {group, at};
  }
  throw std::logic_error("no group of --help has the command" + word);
}

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
  return Mapped<std::string>(Subcommands(app),
                             [](const CLI::App* command) { return command->get_name(); });
}

/// Options of a command and of the commands within it.
std::vector<const CLI::Option*> AllOptions(const CLI::App& command) {
  std::vector<const CLI::Option*> all = command.get_options();
  for (const CLI::App* part : Subcommands(command)) {
    for (const CLI::Option* option : part->get_options()) all.push_back(option);
  }
  return all;
}

/// Returns the accepted words of an option, which CLI11 shows as "TEXT:{a,b}".
std::vector<std::string> ValuesOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t begin = type.find('{'), end = type.rfind('}');
  if (begin == std::string::npos || end == std::string::npos) return {};
  return CLI::detail::split(type.substr(begin + 1, end - begin - 1), ',');
}

bool TakesValue(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

struct Metavariables {
  std::string_view name, options;  ///< options between slashes
};
constexpr Metavariables kMetavariables[] = {
    {"PATH", "/out/"},
    {"FILE",
     "/loops/rules/claims/mechanism/compare-with/figure/fmu/markdown/junit/counts/count-program/"
     "experiments/"},
    {"DIR", "/timings-from/store/history/dir/keep-output/"},
    {"CONDITION", "/filter/where/"},
    {"POINTER=VALUE", "/set/"},
    {"KEY", "/sort/x/y/error-key/cost-key/"},
    {"KEYS", "/columns/group/match/per/"},
    {"SECONDS", "/cpu-limit/horizon/trial-duration/verify/step/budget/"},
    {"MIB", "/memory-limit/"},
    {"METRES", "/max-error/max-model-error/"},
    {"ERRORS", "/error-levels/"},
    {"RATIO", "/error-ratio/"},
    {"BODIES", "/min-size/"},
    {"K/N", "/shard/"},
    {"X,Y,Z", "/gravity/"},
    {"POINT", "/points/"},
    {"NAME", "/only/case/measure/partition/"},
    {"NAME=VALUE", "/threshold/"},
    {"COMMIT", "/commit/"},
    {"DATE", "/date/"},
    {"BRANCH", "/branch/"},
    {"TIME", "/time/"},
    {"OPTION", "/sbatch/"},
    {"N", "/jobs/threads/tasks/every/sizes/"}};

/// Returns the placeholder of an option's value: "{svg,pdf}", "SECONDS" or "TEXT".
std::string Metavariable(const CLI::Option& option) {
  const std::vector<std::string> values = ValuesOf(option);
  if (!values.empty()) return fmt::format("{{{}}}", fmt::join(values, ","));
  if (option.get_lnames().empty()) return "";
  const std::string word = "/" + option.get_lnames().front() + "/";
  for (const auto& [name, options] : kMetavariables) {
    if (options.find(word) == options.npos) continue;
    const bool is_list = option.get_description().find("a,b") != std::string::npos;
    return name == "KEYS" && !is_list ? "KEY" : std::string(name);
  }
  return "TEXT";
}

/// Returns the description of an option with its default value.
std::string DescriptionOf(const CLI::Option& option) {
  std::string text = option.get_description();
  std::string value = option.get_default_str();
  if (value.starts_with('[')) value = value.substr(1, value.size() - 2);
  if (!value.empty() && text.find("default") == text.npos) text += " (default: " + value + ")";
  if (option.get_required() && !option.get_positional()) text += " (required)";
  return text;
}

std::string Quoted(const std::string& text) {  // for fish and zsh, between single quotes
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

/// Returns words that may follow a command: commands within it, or values of its first argument.
std::string WordsAfter(const CLI::App& command) {
  std::vector<std::string> words = CommandNames(command);
  for (const CLI::Option* option : command.get_options()) {
    if (words.empty() && option->get_positional()) words = ValuesOf(*option);
  }
  return Joined(words, " ");
}

std::string AllOptionNames(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : AllOptions(command)) {
    for (const std::string& name : option->get_lnames()) AddOnce(names, "--" + name);
  }
  return Joined(names, " ");
}

/// Returns the script for bash or zsh. Its arms of "case $command-$before" have the words that may
/// follow a command, or an option with a list of values.
std::string CompletionScript(const CLI::App& app, const std::string& shell) {
  const auto offer = [&shell](const std::string& words) {
    return shell == "zsh" ? fmt::format("compadd -- {}; return", words)
                          : fmt::format("words='{}'", words);
  };
  std::string values, options;
  for (const CLI::App* command : Subcommands(app)) {
    const std::string &name = command->get_name(), all = AllOptionNames(*command);
    options += fmt::format("    '{} '*) {} ;;\n", name, offer(all));
    if (const std::string words = WordsAfter(*command); !words.empty()) {
      values += fmt::format("    '{0} {0}') {1} ;;\n", name, offer(words + " " + all));
    }
    for (const CLI::Option* option : AllOptions(*command)) {
      const std::vector<std::string> words = ValuesOf(*option);
      if (words.empty() || option->get_lnames().empty()) continue;
      values += fmt::format("    '{} --{}') {} ;;\n", name, option->get_lnames().front(),
                            offer(Joined(words, " ")));
    }
  }
  return exchange::Filled("completion." + shell, {{"FIRST", Joined(CommandNames(app), " ") + " " +
                                                                Joined(OptionNames(app), " ")},
                                                  {"VALUES", values},
                                                  {"OPTIONS", options}});
}

std::string FishScript(const CLI::App& app) {
  std::string script = "# fish completion of loopbench\n";
  for (const CLI::App* command : Subcommands(app)) {
    const std::string& name = command->get_name();
    script += fmt::format("complete -c loopbench -n __fish_use_subcommand -f -a {} -d {}\n", name,
                          Quoted(command->get_description()));
    if (const std::string words = WordsAfter(*command); !words.empty()) {
      script += fmt::format(
          "complete -c loopbench -n '__fish_seen_subcommand_from {}' -f -a '{}'\n", name, words);
    }
    for (const CLI::Option* option : AllOptions(*command)) {
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

/// Escapes text for roff, with any first character.
std::string Roff(std::string_view text) {
  std::string roff;
  bool begins_line = true;
  for (const char c : text) {
    if (begins_line && (c == '.' || c == '\'')) roff += "\\&";
    roff += c == '\\' ? "\\e" : c == '-' ? "\\-" : std::string(1, c);
    begins_line = c == '\n';
  }
  return roff;
}

std::string Block(std::string_view text) {
  while (text.starts_with('\n')) text.remove_prefix(1);
  return text.empty() ? "" : fmt::format(".PP\n.nf\n{}\n.fi\n", Roff(text));
}

/// Returns the sections of a command and its subcommands. `name` is "loopbench history add".
std::string CommandSection(const CLI::App& command, const std::string& name) {
  std::string usage = name, entries, others;
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional()) {
      usage += " " + option->get_name(true) + (option->get_items_expected_max() > 1 ? " ..." : "");
    }
    std::string value = TakesValue(*option) ? Metavariable(*option) : "";
    entries += fmt::format(
        ".TP\n\\fB{}\\fR{}{}\n{}\n",
        Roff(option->get_positional() ? option->get_name(true) : option->get_name(false, true)),
        value.empty() ? "" : " ", Roff(value), Roff(DescriptionOf(*option)));
  }
  for (const CLI::App* each : Subcommands(command)) {
    others += CommandSection(*each, name + " " + each->get_name());
  }
  const bool is_nested = command.get_parent()->get_parent() != nullptr;
  return fmt::format(".SS {} [options]\n{}.\n{}{}{}", Roff(usage), Roff(command.get_description()),
                     entries, is_nested ? "" : Block(command.get_footer()), others);
}

/// Returns the page of all commands, or of `command`, in the macros of man(7).
std::string ManualPage(const CLI::App& app, const CLI::App* command) {
  const std::string version = VersionText();
  const CLI::App& subject = command == nullptr ? app : *command;
  const std::string suffix = command == nullptr ? "" : "\\-" + Roff(command->get_name());
  std::string page =
      fmt::format(".TH LOOPBENCH{0} 1 \"\" \"{1}\" \"\"\n.SH NAME\nloopbench{0} \\- {2}\n", suffix,
                  Roff(version.substr(0, version.find('\n'))), Roff(subject.get_description()));
  if (command != nullptr) {
    return page + ".SH DESCRIPTION\n" +
           CommandSection(*command, "loopbench " + command->get_name());
  }
  page += ".SH SYNOPSIS\n.B loopbench\n\\fIcommand\\fR [\\fIoptions\\fR]\n.SH DESCRIPTION\n" +
          Block(app.get_footer()) + "\n.SH COMMANDS\n";
  for (const CLI::App* each : Subcommands(app)) {
    page += CommandSection(*each, "loopbench " + each->get_name());
  }
  return page;
}

/// Returns the message of a failed parse: unknown words with spelling suggestions, or `error`.
std::string ParseFailure(const CLI::App& app, const CLI::Error& error) {
  const CLI::App* failed = &app;
  std::string command = app.get_name();
  while (!failed->get_subcommands().empty()) {
    failed = failed->get_subcommands().front();
    command += " " + failed->get_name();
  }
  for (const std::string& word : failed->remaining()) {
    const bool is_option = word.starts_with('-');
    if (!is_option && Subcommands(*failed).empty()) continue;
    const std::string name = word.substr(0, word.find('='));
    const std::string nearest =
        NearestSpelling(name, is_option ? OptionNames(*failed) : CommandNames(*failed));
    return fmt::format("{}: unknown {} '{}'{}\n", command, is_option ? "option" : "command", name,
                       nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest));
  }
  const bool is_missing = std::string_view(error.what()) == "A subcommand is required";
  return fmt::format("{0}: {1} (see {0} --help)\n", command,
                     is_missing ? "expected a command" : error.what());
}

/// Returns the section of a command in docs/reference/commands.md as plain text.
std::string HelpSection(const std::string& command) {
  const std::string heading = "\n## " + command + "\n\n";
  const std::size_t at = kCommandReference.find(heading);
  if (at == std::string_view::npos) throw std::logic_error("commands.md lacks " + command);
  const std::string_view rest = kCommandReference.substr(at + heading.size());
  std::istringstream section(std::string(rest.substr(0, rest.find("\n## "))));
  std::string text;
  bool is_code = false;
  for (std::string line; std::getline(section, line);) {
    const bool is_fence = line.starts_with("```");
    is_code = is_code != is_fence;
    if (is_fence) {
      // a blank line of Markdown between a heading and its examples
      if (is_code && text.ends_with(":\n\n")) text.pop_back();
    } else {
      text.append(is_code && !line.empty() ? "  " : "").append(line) += '\n';
    }
  }
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

/// Returns the layout of --help: a metavariable and the default of each option.
std::shared_ptr<CLI::FormatterBase> HelpLayout() {
  class Layout final : public CLI::Formatter {
    std::string make_option_opts(const CLI::Option* option) const override {
      if (!TakesValue(*option)) return "";
      const std::string value = Metavariable(*option);  // of an argument: its choices, if any
      const bool repeats = option->get_items_expected_max() > 1;
      return (value.empty() ? "" : " " + value) + (repeats ? " ..." : "");
    }
    std::string make_option_desc(const CLI::Option* option) const override {
      return DescriptionOf(*option);
    }
  };
  auto layout = std::make_shared<Layout>();
  layout->label("Positionals", "Arguments");
  layout->column_width(30);
  return layout;
}
/// Work of an option after all options are parsed, such as reading its conditions.
using Finish = std::function<void()>;

/// Adds an option whose words are read by `read` into a list.
template <class T>
CLI::Option* AddLater(CLI::App* app, const Option& row, std::vector<T>* place,
                      T (*read)(std::string_view), std::vector<Finish>* later) {
  const auto texts = std::make_shared<std::vector<std::string>>();
  later->push_back([texts, place, read] {
    for (const std::string& text : *texts) place->push_back(read(text));
  });
  return app->add_option(row.names, *texts, row.sentence);
}

/// Adds an option with its default, and with its range if its place has numbers.
template <class T>
CLI::Option* AddValue(CLI::App* app, const Option& row, T* place) {
  CLI::Option* option = app->add_option(row.names, *place, row.sentence);
  const double from = row.rules.from, to = row.rules.to;
  if constexpr (std::is_same_v<T, std::filesystem::path>) {
    option->check([](const std::string& text) {  // "" is a shell variable that is not set
      return text.empty() ? "found an empty name, expected a file or folder" : "";
    });
  }
  if constexpr (std::is_same_v<T, int>) {
    if (to > from) option->check(NumberFrom(static_cast<int>(from), static_cast<int>(to)));
  } else if (to > from) {
    option->check(NumberFrom(from, to));
  }
  const bool shows = !option->get_positional() && *place != T{};
  if (row.rules.shows_default.value_or(shows)) option->capture_default_str();
  return option;
}

void AddOption(CLI::App* app, const Option& row, std::vector<Finish>* later) {
  const OptionRules& rules = row.rules;
  const auto add = [&](auto* place) -> CLI::Option* {
    using T = std::remove_pointer_t<decltype(place)>;
    if constexpr (std::is_same_v<T, bool>) {
      return app->add_flag(row.names, *place, row.sentence);
    } else if constexpr (std::is_same_v<T, void()>) {
      return app->add_flag_callback(row.names, place, row.sentence);
    } else if constexpr (std::is_same_v<T, std::optional<std::string>>) {
      const auto store = [place](const std::string& text) { *place = text; };
      return app->add_option_function<std::string>(row.names, store, row.sentence);
    } else if constexpr (std::is_same_v<T, Selection>) {
      return AddLater(app, row, place, &ParseCondition, later);
    } else if constexpr (std::is_same_v<T, std::vector<Setting>>) {
      return AddLater(app, row, place, &ParseSetting, later);
    } else {
      return AddValue(app, row, place);
    }
  };
  CLI::Option* option = std::visit(add, row.place);
  option->required(rules.required);
  if (!rules.words.empty()) option->check(CLI::IsMember(rules.words));
  if (rules.exists) option->check(CLI::ExistingFile);
  if (rules.splits) option->delimiter(',');
  if (rules.most > 0) option->expected(1, rules.most);
  if (!rules.needs.empty()) option->needs(app->get_option(rules.needs));
  for (const std::string& other : rules.excludes) option->excludes(app->get_option(other));
  // other options take only the next word, because file names may follow
  if (!option->get_positional() && !rules.takes_all) option->allow_extra_args(false);
}

}  // namespace

void Commands::AddShell(const CLI::App& app) {
  struct Values {
    std::string shell, subject;
    std::filesystem::path folder;
  };
  const auto values = std::make_shared<Values>();
  std::vector<std::string> names;
  for (const Command& row : rows_) {
    if (row.name.find(' ') == row.name.npos) names.push_back(row.name);
  }
  names.insert(names.end(), {"completion", "manual"});
  Add({"completion",
       "Print a completion script",
       [&app, values](const Typed&) {
         PrintText(values->shell == "fish" ? FishScript(app)
                                           : CompletionScript(app, values->shell));
         return 0;
       },
       {{"shell", "Shell to generate for", &values->shell, kRequired,
         OneOf({"bash", "zsh", "fish"})}}});
  Add({"manual",
       "Print manual pages",
       [&app, values](const Typed&) {
         const auto& [shell, subject, folder] = *values;
         if (folder.empty()) {
           PrintText(ManualPage(app, subject.empty() ? nullptr : app.get_subcommand(subject)));
           return 0;
         }
         WriteFileAtomically(folder / "loopbench.1", ManualPage(app, nullptr));
         for (const CLI::App* each : Subcommands(app)) {
           const std::string file = "loopbench-" + each->get_name() + ".1";
           WriteFileAtomically(folder / file, ManualPage(app, each));
         }
         return 0;
       },
       {{"command", "Command (default: all)", &values->subject, OneOf(names)},
        {"-o,--out", "Folder for the pages of all commands", &values->folder}}});
}

int Commands::Run(int argc, char** argv, const std::string& footer) {
  CLI::App app{
      "Measures constraint drift and time of formulations of closed-loop multibody dynamics.",
      "loopbench"};
  app.footer(footer);
  app.set_version_flag("--version", VersionText);
  app.require_subcommand(1);
  app.formatter(HelpLayout());
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    return EscapeTerminalLines(ParseFailure(*failed, error));
  });
  std::ranges::stable_sort(rows_, {}, &PlaceOf);
  AddShell(app);
  std::vector<Finish> later;
  std::function<int(const Typed&)> run;
  Typed typed{CommandLine(argc, argv), ShellLine({argv, argv + argc}), {}};
  for (const Command& row : rows_) {
    const std::size_t space = row.name.find(' ');
    CLI::App* command =
        (space == row.name.npos ? &app : app.get_subcommand(row.name.substr(0, space)))
            ->add_subcommand(row.name.substr(space == row.name.npos ? 0 : space + 1), row.sentence);
    for (const Option& option : row.options) AddOption(command, option, &later);
    if (space == row.name.npos) {
      command->group(kGroups[PlaceOf(row).first].first)->footer(row.notes + HelpSection(row.name));
      if (!row.run) command->require_subcommand(1);
    } else {
      command->group("Subcommands");
    }
    if (row.run) {
      command->callback([&run, &typed, command, &row] {
        run = row.run;
        for (const CLI::Option* option : command->get_options()) {
          if (option->count() > 0) typed.given.push_back(option->get_name());
        }
      });
    }
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  for (const Finish& finish : later) finish();
  return run ? run(typed) : 0;
}

}  // namespace loopbench::harness
