// Numbers on the command line, checked as strictly as numbers in configuration files.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <string>
#include <system_error>

namespace loopbench::harness {

/// Accepts only a decimal number of type T from `least` to `most`. CLI::Range accepts "nan",
/// because it is not below any number, and reads "010" as 8.
template <typename T>
CLI::Validator NumberFrom(T least, T most) {
  const auto check = [least, most](std::string& text) -> std::string {
    T number{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    const bool whole = error == std::errc() && end == text.data() + text.size();
    if (!whole || !(number >= least && number <= most)) {
      return fmt::format("found \"{}\", expected a number from {} to {}", text, least, most);
    }
    text = fmt::format("{}", number);
    return "";
  };
  return CLI::Validator(check, fmt::format("{} to {}", least, most));
}

}  // namespace loopbench::harness
