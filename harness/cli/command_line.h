// Subcommands of the program as rows: names, sentences, options, functions.
#pragma once

#include <functional>
#include <memory>
#include <variant>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/config/experiment_reader.h"
#include "harness/run/processes.h"

namespace CLI {
class App;
}

namespace loopbench::harness {

/// Command line of a call.
struct Typed {
  std::string line;                ///< for provenance (CommandLine)
  std::string again;               ///< in shell syntax (ShellLine)
  std::vector<std::string> given;  ///< names of the options in it, such as "--out"
};

/// Place of an option's value. A place for bool is a flag. Conditions and settings are read after
/// all options, so that their mistakes are mistakes of the command and not of its syntax.
using OptionPlace =
    std::variant<bool*, int*, double*, std::string*, std::optional<std::string>*,
                 std::filesystem::path*, std::vector<std::string>*, std::vector<int>*,
                 std::vector<double>*, std::vector<std::filesystem::path>*, Selection*,
                 std::vector<Setting>*, void (*)()>;

/// Rules for the value of an option.
struct OptionRules {
  bool required = false;
  std::vector<std::string> words = {};  ///< accepted words; empty: any
  double from = 0.0, to = 0.0;          ///< accepted numbers, if to > from
  bool splits = false;                  ///< a list "a,b" is several values
  bool exists = false;                  ///< the value is an existing file
  bool takes_all = false;               ///< takes all words up to the next option
  int most = 0;                         ///< number of an argument's values; 0: by its place
  std::string needs = "";               ///< option without which this one has no meaning
  std::vector<std::string> excludes = {};
  /// Default in --help; otherwise it is there unless empty or zero.
  std::optional<bool> shows_default = std::nullopt;
};

inline constexpr auto kRequired = [](OptionRules& rules) { rules.required = true; };
inline constexpr auto kSplits = [](OptionRules& rules) { rules.splits = true; };
inline constexpr auto kExists = [](OptionRules& rules) { rules.exists = true; };
inline constexpr auto kTakesAll = [](OptionRules& rules) { rules.takes_all = true; };
inline auto OneOf(const std::vector<std::string>& words) {
  return [words](OptionRules& rules) { rules.words = words; };
}
inline auto From(double from, double to) {
  return [from, to](OptionRules& rules) { rules.from = from, rules.to = to; };
}
inline auto Most(int most) {
  return [most](OptionRules& rules) { rules.most = most; };
}
inline auto Needs(const char* option) {
  return [option](OptionRules& rules) { rules.needs = option; };
}
inline auto Excludes(const std::vector<std::string>& options) {
  return [options](OptionRules& rules) { rules.excludes = options; };
}
inline auto ShowsDefault(bool shows) {
  return [shows](OptionRules& rules) { rules.shows_default = shows; };
}

/// Option or argument of a command, and its line in --help, manual pages and completion.
struct Option {
  template <class... Rules>
  Option(std::string option_names, std::string text, OptionPlace value, const Rules&... set_rules)
      : names(std::move(option_names)), sentence(std::move(text)), place(value) {
    (set_rules(rules), ...);
  }

  std::string names;  ///< "-o,--out", or the name of an argument
  std::string sentence;
  OptionPlace place;
  OptionRules rules;
};

struct Command {
  std::string name;  ///< "history add" is a command of "history", which has no function
  std::string sentence;
  std::function<int(const Typed&)> run = nullptr;  ///< returns the exit code
  std::vector<Option> options = {};
  /// In --help, before the command's section of docs/reference/commands.md.
  std::string notes = "";
};

/// The subcommands of the program, and the values of their options.
class Commands {
 public:
  void Add(Command row) { rows_.push_back(std::move(row)); }

  /// Adds a command with the options of a T: `run` gets their values.
  template <class T>
  void Add(std::string name, std::string sentence, int (*run)(T&, const Typed&),
           std::string notes = "") {
    const auto values = std::make_shared<std::remove_const_t<T>>();
    Add({std::move(name), std::move(sentence),
         [values, run](const Typed& typed) { return run(*values, typed); }, values->Options(),
         std::move(notes)});
  }

  /// Parses the command line and runs its command. Prints help, or a mistake. Returns the exit
  /// code.
  int Run(int argc, char** argv, const std::string& footer);

 private:
  void AddShell(const CLI::App& app);

  std::vector<Command> rows_;
};

// Each function adds related subcommands.
void AddRun(Commands& commands);
void AddExperiments(Commands& commands);
void AddExplain(Commands& commands);
void AddSimplify(Commands& commands);
void AddFormats(Commands& commands);
void AddAdvise(Commands& commands);
void AddView(Commands& commands);
void AddImport(Commands& commands);
void AddConvert(Commands& commands);
void AddGenerate(Commands& commands);
void AddResults(Commands& commands);
void AddTrajectory(Commands& commands);
void AddCount(Commands& commands);
void AddComparison(Commands& commands);
void AddBaseline(Commands& commands);
void AddCluster(Commands& commands);
void AddHistory(Commands& commands);

/// Returns the message, with the remedy if an unknown key in it is an old name.
std::string WithMigrationHint(std::string message);

inline Option WideOption() {
  return {"--wide", "Show all columns; do not fit tables to the terminal", &ShowWide};
}

// Limits of the work on a mechanism file. Experiments contain their own ("limits").
inline Option CpuOption(ProcessLimits* limits) {
  return {"--cpu-limit", "CPU time limit per mechanism file [s]", &limits->cpu_s, From(0.001, 1e9)};
}
inline Option MemoryOption(ProcessLimits* limits) {
  return {"--memory-limit", "Memory limit per mechanism file [MiB]", &limits->memory_mb,
          From(1.0, 1e9)};
}

inline Option FormatOption(std::string* format, std::vector<std::string> words,
                           const std::string& sentence = "Output format") {
  return {"--format", sentence, format, OneOf(std::move(words))};
}
inline Option TableFormatOption(std::string* format) {
  return FormatOption(format, {"text", "csv", "markdown", "json", "latex"});
}

inline Option OutOption(std::filesystem::path* out) {
  return {"-o,--out", "Output file (default: the terminal)", out};
}

inline Option JsonOption(bool* json) {
  return {"--json", "One JSON document instead (docs/using.md has its keys)", json};
}

inline Option WhereOption(Selection* where) {
  return {"--where", "Only these records: key=value[,value] (or !=, <, <=, >, >=)", where};
}

inline Option FilterOption(Selection* filter) {
  return {"--filter", "Only these cases: key=value[,value] (or !=, <, <=, >, >=)", filter};
}

inline Option SetOption(std::vector<Setting>* settings) {
  return {"--set", "Change a field of the file: /json/pointer=value", settings};
}

inline Option SizeOption(std::string* size) {
  return {"--size", "Width of figures: 85 mm or 178 mm, letters of 8 pt", size,
          OneOf({"one-column", "two-column"})};
}

inline Option GateOption(std::string* gate) {
  return {"--fail-on", "Exit with status 1 if a shown accuracy run has warnings or did not finish",
          gate, OneOf({"warnings"})};
}

inline Option StoreArgument(std::filesystem::path* store) {
  return {"store", "Folder of a run, or a .jsonl file", store, kRequired};
}

inline Option MechanismArgument(std::filesystem::path* mechanism) {
  return {"mechanism", "Mechanism file (JSON)", mechanism, kRequired};
}

}  // namespace loopbench::harness
