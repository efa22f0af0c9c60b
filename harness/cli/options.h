// What the options of several subcommands share.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "harness/isolation/processes.h"
#include "harness/record/select.h"
#include "harness/text/numeric_option.h"
#include "harness/text/screen.h"

namespace loopbench::harness {

inline Selection ParseSelection(const std::vector<std::string>& conditions) {
  Selection selection;
  for (const std::string& text : conditions) selection.push_back(ParseCondition(text));
  return selection;
}

/// For commands that print tables.
inline void AddWide(CLI::App* app) {
  app->add_flag_callback("--wide", ShowWide, "Show all columns; do not fit tables to the terminal");
}

/// Limits of work on a mechanism; experiments contain their own ("limits").
inline void AddLimits(CLI::App* app, ProcessLimits* limits) {
  app->add_option("--cpu", limits->cpu_s, "CPU time limit per mechanism file [s]")
      ->check(NumberFrom(0.001, 1e9))
      ->capture_default_str();
  app->add_option("--memory", limits->memory_mb, "Memory limit per mechanism file [MiB]")
      ->check(NumberFrom(1.0, 1e9))
      ->capture_default_str();
}

inline CLI::Option* AddJson(CLI::App* app, bool* json) {
  return app->add_flag("--json", *json, "One JSON document instead (docs/using.md has its keys)");
}

inline CLI::Option* AddGate(CLI::App* app, std::string* gate) {
  return app
      ->add_option("--gate", *gate,
                   "doubts: exit with 1 if an accuracy run shown did not finish or has doubts")
      ->check(CLI::IsMember({"doubts"}));
}

}  // namespace loopbench::harness
