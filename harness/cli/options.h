// What the options of several subcommands share.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "harness/record/select.h"
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
