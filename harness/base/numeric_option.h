// Numbers on the command line, checked as strictly as numbers in configuration files.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "harness/base/text.h"

namespace loopbench::harness {

/// Accepts only a decimal number of type T from `least` to `most`. CLI::Range accepts "nan",
/// because it is not below any number, and reads "010" as 8.
template <typename T>
CLI::Validator NumberFrom(T least, T most) {
  const auto check = [least, most](std::string& text) -> std::string {
    const std::optional<T> number = WholeNumber<T>(text);
    if (!(number >= least && number <= most)) {
      return fmt::format("found \"{}\", expected a number from {} to {}", text, least, most);
    }
    text = fmt::format("{}", *number);
    return "";
  };
  return CLI::Validator(check, fmt::format("{} to {}", least, most));
}

}  // namespace loopbench::harness
