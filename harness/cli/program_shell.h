// What shells and readers want to know of all subcommands and options, from their declarations: the
// nearest spelling of a wrong word, completion, a manual page.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace loopbench::harness {

/// Lines about the words that no subcommand or option took, each with the nearest that there is; ""
/// when there are none. `app` is the whole program, after a parse that failed.
std::string WhatWasMeant(const CLI::App& app);

/// The subcommands completion and manual. They print what all subcommands of `app` have declared.
class ShellOptions {
 public:
  /// Adds them to `app`, which must outlive this.
  explicit ShellOptions(CLI::App& app);

  /// Runs the one that was parsed: 0.
  int Run();

 private:
  CLI::App& app_;
  CLI::App *completion_app_, *manual_app_;
  std::string shell_;
};

/// A script for bash, zsh or fish, which completes subcommands, options, the values of those that
/// have a list of them, and names of files.
std::string CompletionScript(const CLI::App& app, const std::string& shell);

/// loopbench.1, in the macros of man(7).
std::string ManualPage(const CLI::App& app);

}  // namespace loopbench::harness
