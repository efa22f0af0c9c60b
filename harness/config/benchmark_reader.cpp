#include "harness/config/benchmark_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <system_error>

#include "harness/config/experiment_sections.h"
#include "harness/config/mechanism_reader.h"
#include "harness/config/options.h"
#include "harness/json/config_error.h"
#include "harness/json/document_kind.h"
#include "harness/json/spelling.h"
#include "mechanism/description/in_space.h"
#include "mechanism/simplify/compile.h"

namespace loopbench::harness {
namespace {

/// The path a node names, relative to `folder`. Reports a file that is not there, with the nearest
/// name beside it.
std::optional<std::filesystem::path> ReadNamedFile(const JsonNode& node, std::string_view what,
                                                   const std::filesystem::path& folder) {
  const std::string named = node.Text();
  if (named.empty()) return std::nullopt;
  const std::filesystem::path path = (folder / named).lexically_normal();
  std::error_code error;
  if (std::filesystem::is_regular_file(path, error)) return path;
  std::vector<std::string> beside;
  const std::filesystem::path parent = path.has_parent_path() ? path.parent_path() : ".";
  for (const auto& entry : std::filesystem::directory_iterator(parent, error)) {
    beside.push_back(entry.path().filename().string());
  }
  std::ranges::sort(beside);
  const std::string nearest = NearestSpelling(path.filename().string(), beside);
  node.Fail(fmt::format("{} ({} does not exist)", what, path.string()),
            nearest.empty() ? "" : (std::filesystem::path(named).parent_path() / nearest).string());
  return std::nullopt;
}

std::vector<BenchmarkMember> ReadBenchmarkMechanisms(const JsonNode& node,
                                                     const std::filesystem::path& folder,
                                                     ErrorList* errors) {
  std::vector<BenchmarkMember> members;
  for (const JsonNode& element : node.OneOrMore("mechanism files")) {
    const auto path = ReadNamedFile(element, "a mechanism file", folder);
    if (!path) continue;
    try {
      BenchmarkMember member;
      member.description = ReadMechanism(*path).description;
      member.name = member.description.name;
      members.push_back(std::move(member));
    } catch (const ConfigError& mistakes) {
      errors->AddText(mistakes.what());
    }
  }
  return members;
}

std::vector<BenchmarkMember> ReadBenchmarkFamily(const JsonNode& node, const JsonNode& owner) {
  static const std::vector<std::string> kFamilies = {"chain", "ladder", "grid"};
  std::vector<BenchmarkMember> members;
  const auto index = node.Choice(kFamilies, "a family");
  const auto sizes = owner.Required("sizes", "a list of integers");
  if (!index || !sizes) return members;
  const std::string& family = kFamilies[static_cast<std::size_t>(*index)];
  // the smallest closed chain has three bars
  const int smallest = family == "chain" ? 3 : 1;
  const int largest = family == "grid" ? kLargestGrid : kLargestMember;
  for (const JsonNode& size : sizes->OneOrMore("sizes")) {
    BenchmarkMember member;
    member.family = family;
    member.size = static_cast<int>(size.Integer(smallest, largest));
    member.name = fmt::format("{}/{}", family, member.size);
    members.push_back(std::move(member));
  }
  return members;
}

/// Planar members, described in a plane tilted against the axes of space.
void PutInSpace(const JsonNode& node, std::vector<BenchmarkMember>* members) {
  const Eigen::Vector3d tilt(0.3, -0.4, 0.5);
  for (BenchmarkMember& member : *members) {
    member.description = member.Make();
    member.family.clear();
    if (member.description.space == SpaceKind::kSpatial) {
      node.FailAs(fmt::format("\"{}\", spatial already", member.name), "planar mechanisms");
      return;
    }
    member.description = InSpace(member.description, tilt);
    member.name += "/space";
  }
}

/// Each member's simplified parts in its place.
void CompileMembers(std::vector<BenchmarkMember>* members) {
  std::vector<BenchmarkMember> compiled;
  for (const BenchmarkMember& member : *members) {
    const Compiled all = Compile(member.Make(), CompileOptions::All());
    for (std::size_t i = 0; i < all.parts.size(); ++i) {
      BenchmarkMember part;
      part.name = member.name + "/compiled";
      if (all.parts.size() > 1) part.name += fmt::format("/{}", i + 1);
      part.description = all.parts[i].description;
      compiled.push_back(std::move(part));
    }
  }
  *members = std::move(compiled);
}

BenchmarkGroup ReadGroup(const JsonNode& node, const std::filesystem::path& folder,
                         ErrorList* errors) {
  BenchmarkGroup group;
  if (!node.ExpectObject(
          {"mechanisms", "family", "sizes", "in_space", "compile", "measure", "columns"})) {
    return group;
  }
  const auto mechanisms = node.Optional("mechanisms"), family = node.Optional("family");
  if (mechanisms && family) {
    family->Fail("no \"family\" beside \"mechanisms\"; make two groups");
  } else if (mechanisms) {
    group.members = ReadBenchmarkMechanisms(*mechanisms, folder, errors);
    if (const auto sizes = node.Optional("sizes")) sizes->Fail("no \"sizes\" without a \"family\"");
  } else if (family) {
    group.members = ReadBenchmarkFamily(*family, node);
  } else {
    node.FailAs("neither \"mechanisms\" nor \"family\"", "one of them");
  }
  const auto in_space = node.Optional("in_space"), compile = node.Optional("compile");
  if (in_space && in_space->Bool()) PutInSpace(*in_space, &group.members);
  if (compile && compile->Bool()) CompileMembers(&group.members);
  if (const auto measure = node.Required("measure", "\"rhs\", \"step\" or both")) {
    group.kinds = ReadEnums<BenchmarkKind>(*measure, "what is measured");
  }
  if (const auto columns = node.Required("columns", "an array of columns")) {
    group.columns = ReadColumns(*columns);
  }
  return group;
}

/// Reports the first benchmark that a group repeats: names must tell results apart.
void ReportRepeatedBenchmark(const JsonNode& node, const BenchmarkGroup& group,
                             std::set<std::string>* taken) {
  for (const BenchmarkMember& member : group.members) {
    for (const BenchmarkKind kind : group.kinds) {
      for (const Column& column : group.columns) {
        const std::string name = BenchmarkName(kind, member, column);
        if (taken->insert(name).second) continue;
        node.FailAs(fmt::format("benchmark \"{}\" again", name), "each benchmark once");
        return;
      }
    }
  }
}

/// The mistakes of the file of states join the others under its own name.
StateHashes ReadStates(const std::filesystem::path& path, ErrorList* errors) {
  StateHashes states;
  try {
    const std::string text = ReadTextFile(path);
    const Json document = ParseDocument(text, path.string());
    ErrorList own(path.string(), text);
    for (const auto& [name, node] : JsonNode(document, "", own).Members()) {
      const std::string hash = node.Text();
      const bool is_hash =
          hash.size() == 16 && hash.find_first_not_of("0123456789abcdef") == std::string::npos;
      if (!hash.empty() && !is_hash) node.Fail("16 hexadecimal digits");
      states[name] = hash;
    }
    own.ThrowIfAny();
  } catch (const ConfigError& mistakes) {
    errors->AddText(mistakes.what());
  }
  return states;
}

}  // namespace

BenchmarkSet ReadBenchmarks(const std::filesystem::path& path) {
  return ParseBenchmarks(ReadTextFile(path), path);
}

BenchmarkSet ParseBenchmarks(std::string_view text, const std::filesystem::path& path) {
  const Json document = ParseDocument(text, path.string());
  ErrorList errors(path.string(), text);
  const JsonNode root(document, "", errors);
  const std::filesystem::path folder = path.parent_path();
  BenchmarkSet set;
  set.path = path;
  if (ExpectDocument(root, FileKind::kBenchmarks)) {
    if (const auto name = root.Required("name", "a name")) set.name = name->Text();
    if (const auto comment = root.Optional("comment")) set.comment = comment->Text();
    const auto states = root.Optional("states");
    if (const std::string named = states ? states->Text() : ""; !named.empty()) {
      // the file itself may be missing: --save-states makes it
      set.states_path = folder / named;
      std::error_code error;
      if (std::filesystem::exists(set.states_path, error)) {
        set.states = ReadStates(set.states_path, &errors);
      }
    }
    if (const auto name = root.Optional("integrator")) {
      const std::vector<std::string> profiles = ProfileNames();
      const auto index = name->Choice(profiles, "an integrator profile");
      if (index) set.integrator = profiles[static_cast<std::size_t>(*index)];
    }
    if (const auto step = root.Optional("step")) set.step = step->Number(kPositive);
    if (const auto groups = root.Required("groups", "an array of groups")) {
      std::set<std::string> taken;
      for (const JsonNode& element : groups->Elements("groups")) {
        set.groups.push_back(ReadGroup(element, folder, &errors));
        ReportRepeatedBenchmark(element, set.groups.back(), &taken);
      }
      if (groups->value().is_array() && set.groups.empty()) groups->Fail("at least one group");
    }
  }
  errors.ThrowIfAny();
  return set;
}

std::string StatesToJson(const StateHashes& states) {
  const nlohmann::json document = states;
  return document.dump(2) + "\n";
}

}  // namespace loopbench::harness
