#include "tests/harness/include_arrows.h"

namespace loopbench::architecture {
namespace {

// From the lowest up: a file includes files of modules above its own in this list only.
// clang-format off
constexpr std::string_view kModules[] = {"mechanism/algebra",
                                       "mechanism/description",
                                       "mechanism/model",
                                       "mechanism/loops",
                                       "mechanism/start",
                                       "mechanism/formulation",
                                       "mechanism/simplify",
                                       "odca",
                                       "lagrange",
                                       "reduction",
                                       "harness/base",
                                       "harness/config",
                                       "harness/judge",
                                       "harness/generate",
                                       "harness/integrator",
                                       "harness/observers",
                                       "harness/run",
                                       "harness/precision",
                                       "harness/suite",
                                       "harness/figures",
                                       "harness/exchange",
                                       "harness/history",
                                       "harness/cli",
                                       "peers",
                                       "examples/own-parts",
                                       "tests"};
// clang-format on
// The build writes these headers, and one module reads them.
constexpr std::string_view kGenerated = "harness/build_";

bool OneOf(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::ranges::find(words, word) != words.end();
}

bool StartsWithOneOf(std::string_view text, std::initializer_list<std::string_view> starts) {
  return std::ranges::any_of(starts,
                             [text](std::string_view start) { return text.starts_with(start); });
}

/// The module of a file, "" in none.
std::string_view ModuleOf(std::string_view path) {
  const auto module = std::ranges::find_if(kModules, [path](std::string_view one) {
    return path.starts_with(one) && path.substr(one.size()).starts_with('/');
  });
  return module == std::end(kModules) ? "" : *module;
}

bool IsFormulation(std::string_view module) {
  return OneOf(module, {"odca", "lagrange", "reduction"});
}

bool IsCore(std::string_view module) {
  return module.starts_with("mechanism/") || IsFormulation(module);
}

/// Whether files of `module` may include those of `other`.
bool Reaches(std::string_view module, std::string_view other) {
  if (module == other) return true;
  if (IsFormulation(module) && IsFormulation(other)) return false;
  return std::ranges::find(kModules, module) > std::ranges::find(kModules, other);
}

/// Why a file at `path` must not include the foreign `header`; "" when it may.
std::string_view WhyNotForeign(std::string_view path, std::string_view header) {
  if (IsCore(ModuleOf(path)) && header.find_first_of("./") != std::string_view::npos) {
    return header.starts_with("Eigen/") ? "" : "the core knows Eigen and the standard library";
  }
  if (StartsWithOneOf(header, {"arkode/", "cvode/", "ida/", "kinsol/", "nvector/", "sun"})) {
    return OneOf(path, {"harness/integrator/arkode.cpp", "harness/config/arkode_tables.cpp"})
               ? ""
               : "SUNDIALS is for harness/integrator/arkode.cpp";
  }
  if (header.starts_with("nlohmann/")) {
    const bool allowed = StartsWithOneOf(
        path, {"harness/base/", "harness/judge/statistics.cpp", "tests/harness/store"});
    return allowed ? "" : "nlohmann-json is for harness/base";
  }
  if (header.starts_with("CLI/")) {
    const bool allowed = OneOf(path, {"harness/cli/command_line.cpp", "harness/run/count.cpp",
                                      "harness/base/numeric_option.h"});
    return allowed ? "" : "CLI11 is for the command lines of programs";
  }
  if (header.starts_with("benchmark/")) {
    return path.starts_with("harness/run/") ? "" : "Google Benchmark is for harness/run";
  }
  if (StartsWithOneOf(header, {"gtest/", "gmock/"})) {
    return path.starts_with("tests/") ? "" : "GoogleTest is for tests";
  }
  if (header == "Simbody.h" || header.starts_with("mujoco/")) {
    return StartsWithOneOf(path, {"peers/simbody_", "peers/mujoco_", "tests/peers/"})
               ? ""
               : "peers are for peers/simbody_* and peers/mujoco_*";
  }
  if (header == "tinyxml2.h") {
    return OneOf(path,
                 {"harness/exchange/xml_document.cpp", "tests/generate/cli_generate_test.cpp"})
               ? ""
               : "XML is for harness/exchange/xml_document.cpp";
  }
  if (header.starts_with("boost/context/")) {
    return path == "harness/run/side_by_side.cpp"
               ? ""
               : "stacks of runs are for harness/run/side_by_side.cpp";
  }
  if (header.starts_with("boost/")) {
    const bool allowed =
        OneOf(path, {"harness/observers/built_in.cpp", "harness/exchange/export_c.cpp",
                     "tests/reference/rigid_motions.cpp"});
    return allowed ? "" : "Boost is for closed forms of motions and checksums of archives";
  }
  return "";
}

/// The same for a header of this repository, named from its root.
std::string_view WhyNotOwn(std::string_view path, std::string_view header) {
  const std::string_view module = ModuleOf(header);
  if (ModuleOf(path).empty()) return "its folder is no module of kModules";
  if (header.starts_with(kGenerated) && ModuleOf(path) == "harness/base") return "";
  if (header.find("..") != std::string_view::npos || module.empty()) {
    return "own headers are named from the root of the repository";
  }
  return Reaches(ModuleOf(path), module) ? "" : "the arrow points the other way";
}

/// `text` with comments blanked, line ends kept.
std::string WithoutComments(std::string_view text) {
  std::string kept;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::string_view rest = text.substr(i);
    if (rest.starts_with("//")) {
      i = std::min(text.find('\n', i), text.size()) - 1;
    } else if (rest.starts_with("/*")) {
      const std::size_t end = std::min(text.find("*/", i + 2), text.size());
      kept.append(static_cast<std::size_t>(std::count(&text[i], text.data() + end, '\n')), '\n');
      i = end + 1;
    } else if (rest.front() == '"') {
      // a string, or the name of a header: "//" in it starts no comment
      const std::size_t end = std::min(text.find_first_of("\"\n", i + 1), text.size() - 1);
      kept += text.substr(i, end - i + 1);
      i = end;
    } else {
      kept += text[i];
    }
  }
  return kept;
}

std::string_view Trimmed(std::string_view text) {
  const std::size_t start = text.find_first_not_of(" \t");
  if (start == std::string_view::npos) return {};
  return text.substr(start, text.find_last_not_of(" \t\r") - start + 1);
}

}  // namespace

std::vector<std::string> Includes(std::string_view text) {
  const std::string code = WithoutComments(text);
  std::vector<std::string> headers;
  for (std::size_t start = 0; start < code.size();) {
    const std::size_t end = std::min(code.find('\n', start), code.size());
    std::string_view line = Trimmed(std::string_view(code).substr(start, end - start));
    start = end + 1;
    if (!line.starts_with('#')) continue;
    line = Trimmed(line.substr(1));
    constexpr std::string_view kInclude = "include";
    if (!line.starts_with(kInclude)) continue;
    headers.emplace_back(Trimmed(line.substr(kInclude.size())));
  }
  return headers;
}

std::vector<std::string> Violations(std::string_view path, std::string_view text) {
  std::vector<std::string> violations;
  for (const std::string& header : Includes(text)) {
    const std::string_view name = std::string_view(header).substr(1, header.size() - 2);
    std::string_view why = "a header must be named, not computed";
    if (header.starts_with('<')) why = WhyNotForeign(path, name);
    if (header.starts_with('"')) why = WhyNotOwn(path, name);
    // own headers in angle brackets, foreign ones in quotes: no way around the rules
    if (header.starts_with('<') && !ModuleOf(name).empty()) {
      why = "own headers stand in quotes";
    }
    if (!why.empty()) {
      violations.push_back(std::string(path) + ": #include " + header + ": " + std::string(why));
    }
  }
  return violations;
}

}  // namespace loopbench::architecture
