// Subcommands of the program, and options that several of them share.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "harness/config/experiment_reader.h"
#include "harness/isolation/processes.h"
#include "harness/record/select.h"
#include "harness/text/numeric_option.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {

/// Command line of a call.
struct Typed {
  std::string line;   ///< for provenance (CommandLine)
  std::string again;  ///< in shell syntax (ShellLine)
};

/// Returns the section of a command in docs/reference/commands.md as plain text.
std::string HelpSection(const std::string& command);

/// Returns the layout of --help: a metavariable and the default of each option.
std::shared_ptr<CLI::FormatterBase> HelpLayout();

/// The subcommands of the program. The object owns option values: `app` parses into them.
class Commands {
 public:
  /// Runs a parsed subcommand and returns its exit code.
  using Runner = std::function<int(const Typed&)>;

  explicit Commands(CLI::App* app) : app_(app) {}

  CLI::App* app() const { return app_; }

  template <class T>
  T& Keep(T value = {}) {
    const auto kept = std::make_shared<T>(std::move(value));
    kept_.push_back(kept);
    return *kept;
  }

  CLI::App* Add(const std::string& name, const std::string& sentence, Runner run) {
    runners_.emplace_back(app_->add_subcommand(name, sentence), std::move(run));
    return runners_.back().first->footer(HelpSection(name));
  }

  /// Runs the parsed subcommand and returns its exit code, 0 if there is none.
  int Run(const Typed& typed) const {
    for (const auto& [app, run] : runners_) {
      if (*app) return run(typed);
    }
    return 0;
  }

 private:
  CLI::App* app_;
  std::vector<std::shared_ptr<void>> kept_;
  std::vector<std::pair<CLI::App*, Runner>> runners_;
};

// Each function adds one subcommand or several related ones.
void AddRun(Commands& commands);
void AddMerge(Commands& commands);
void AddList(Commands& commands);
void AddCheck(Commands& commands);
void AddPlan(Commands& commands);
void AddExplain(Commands& commands);
void AddSimplify(Commands& commands);
void AddSchema(Commands& commands);
void AddMigrate(Commands& commands);
void AddAdvise(Commands& commands);
void AddView(Commands& commands);
void AddTable(Commands& commands);
void AddPlot(Commands& commands);
void AddTradeoff(Commands& commands);
void AddTrajectory(Commands& commands);
void AddVerdict(Commands& commands);
void AddMap(Commands& commands);
void AddReport(Commands& commands);
void AddImport(Commands& commands);
void AddConvert(Commands& commands);
void AddGenerate(Commands& commands);
void AddCount(Commands& commands);
void AddComparison(Commands& commands);
void AddBaseline(Commands& commands);
void AddCluster(Commands& commands);
void AddHistory(Commands& commands);
void AddShell(Commands& commands);

/// Returns the message of a failed parse: unknown words with spelling suggestions, or `error`.
std::string ParseFailure(const CLI::App& app, const CLI::Error& error);

/// Returns the message, with the remedy if an unknown key in it is an old name.
std::string WithMigrationHint(std::string message);

inline Selection ParseSelection(const std::vector<std::string>& conditions) {
  Selection selection;
  for (const std::string& text : conditions) selection.push_back(ParseCondition(text));
  return selection;
}

inline std::vector<Setting> ParseSettings(const std::vector<std::string>& texts) {
  std::vector<Setting> settings;
  for (const std::string& text : texts) settings.push_back(ParseSetting(text));
  return settings;
}

/// Adds --wide, for commands that print tables.
inline void AddWide(CLI::App* app) {
  app->add_flag_callback("--wide", ShowWide, "Show all columns; do not fit tables to the terminal");
}

/// Adds limits of the work on a mechanism file; experiments contain their own ("limits").
inline void AddLimits(CLI::App* app, ProcessLimits* limits) {
  app->add_option("--cpu-limit", limits->cpu_s, "CPU time limit per mechanism file [s]")
      ->check(NumberFrom(0.001, 1e9))
      ->capture_default_str();
  app->add_option("--memory-limit", limits->memory_mb, "Memory limit per mechanism file [MiB]")
      ->check(NumberFrom(1.0, 1e9))
      ->capture_default_str();
}

/// Adds an option whose value, with its default, is one of `words`.
inline void AddChoice(CLI::App* app, const std::string& name, std::string* word,
                      const std::string& text, const std::vector<std::string>& words) {
  app->add_option(name, *word, text)->check(CLI::IsMember(words))->capture_default_str();
}

inline CLI::Option* AddJson(CLI::App* app, bool* json) {
  return app->add_flag("--json", *json, "One JSON document instead (docs/using.md has its keys)");
}

inline void AddFilter(CLI::App* app, std::vector<std::string>* conditions) {
  app->add_option("--filter", *conditions,
                  "Only these cases: key=value[,value] (or !=, <, <=, >, >=)");
}

inline void AddWhere(CLI::App* app, std::vector<std::string>* conditions) {
  app->add_option("--where", *conditions,
                  "Only these records: key=value[,value] (or !=, <, <=, >, >=)");
}

/// Repeatable option with one value each: a second word would be a file name.
inline void AddSettings(CLI::App* app, std::vector<std::string>* settings) {
  app->add_option("--set", *settings, "Change a field of the file: /json/pointer=value");
}

inline void AddSize(CLI::App* app, std::string* size) {
  AddChoice(app, "--size", size, "Width of figures: 85 mm or 178 mm, letters of 8 pt",
            {"one-column", "two-column"});
}

inline CLI::Option* AddGate(CLI::App* app, std::string* gate) {
  return app
      ->add_option("--fail-on", *gate,
                   "Exit with status 1 if a shown accuracy run has warnings or did not finish")
      ->check(CLI::IsMember({"warnings"}));
}

}  // namespace loopbench::harness
