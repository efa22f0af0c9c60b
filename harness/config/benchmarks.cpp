#include "harness/config/benchmarks.h"

#include <set>

#include "harness/base/text.h"
#include "harness/config/experiment_sections.h"
#include "harness/config/file_schemas.h"
#include "mechanism/description/library.h"
#include "mechanism/description/transforms.h"

namespace loopbench::harness {
namespace {

constexpr int kLargest = 1'000'000;

/// Sets the first joint's speed; other speeds follow. It decreases with size, because tension grows
/// with length and speed squared: steps of milliseconds stay short compared with waves.
MechanismDescription Started(MechanismDescription description, int size) {
  description.initial.speeds.push_back({0, {std::min(1.0, 1000.0 / size)}});
  return description;
}

std::vector<BenchmarkMember> ReadBenchmarkMechanisms(const JsonNode& node,
                                                     const std::filesystem::path& folder) {
  std::vector<BenchmarkMember> members;
  for (const JsonNode& element : node.OneOrMore("mechanism files")) {
    const std::string named = element.Text();
    const std::filesystem::path path = (folder / named).lexically_normal();
    if (named.empty()) continue;
    ReadNamedFile(element, path, "a mechanism file", [&] {
      BenchmarkMember member;
      member.description = ReadMechanism(path).description;
      member.name = member.description.name;
      members.push_back(std::move(member));
    });
  }
  return members;
}

std::vector<BenchmarkMember> ReadBenchmarkFamily(const JsonNode& node, const JsonNode& owner) {
  std::vector<BenchmarkMember> members;
  const auto index = node.Choice(NamesOfSizedFamilies(), "a family");
  const auto sizes = owner.Required("sizes", "a list of integers");
  if (!index || !sizes) return members;
  const SizedFamily& family = SizedFamilies()[static_cast<std::size_t>(*index)];
  for (const JsonNode& size : sizes->OneOrMore("sizes")) {
    BenchmarkMember member;
    member.family = family.name;
    member.size = static_cast<int>(size.Integer(family.smallest, family.largest));
    member.name = fmt::format("{}/{}", family.name, member.size);
    members.push_back(std::move(member));
  }
  return members;
}

/// Moves planar members to a plane that is tilted in space.
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

/// Replaces each member by its simplified parts.
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

/// Group being read.
struct GroupInFile : BenchmarkGroup {
  std::filesystem::path folder;
  bool in_space = false, compile = false;
};

/// Reads mechanisms of files or of a family.
void ReadMembers(const JsonNode& node, GroupInFile& group) {
  const auto mechanisms = node.Optional("mechanisms"), family = node.Optional("family");
  if (mechanisms && family) {
    family->Fail("no \"family\" beside \"mechanisms\"; make two groups");
  } else if (mechanisms) {
    group.members = ReadBenchmarkMechanisms(*mechanisms, group.folder);
    if (const auto sizes = node.Optional("sizes")) sizes->Fail("no \"sizes\" without a \"family\"");
  } else if (family) {
    group.members = ReadBenchmarkFamily(*family, node);
  } else {
    node.FailAs("neither \"mechanisms\" nor \"family\"", "one of them");
  }
}

void ChangeMembers(const JsonNode& node, GroupInFile& group) {
  if (group.in_space) PutInSpace(*node.Optional("in_space"), &group.members);
  if (group.compile) CompileMembers(&group.members);
}

const Fields<GroupInFile>& GroupFields() {
  static const Json one_of_two = Json::parse(R"({"oneOf": [
      {"required": ["mechanisms"], "not": {"anyOf": [{"required": ["family"]}, {"required": ["sizes"]}]}},
      {"required": ["family", "sizes"], "not": {"required": ["mechanisms"]}}]})");
  static const Fields<GroupInFile> fields(
      "benchmark_group", "Mechanisms or members of a family, with their benchmarks.",
      {{"mechanisms", OneOrMoreSchema(TextSchema()),
        "Paths of mechanism files, relative to this file."},
       {"family", ChoiceSchema(NamesOfSizedFamilies()), "Family of mechanisms."},
       {"sizes", OneOrMoreSchema(IntegerSchema(1, kMaxCount)), TextOfSizedFamilies()},
       {"", By(one_of_two, ReadMembers)},
       {"in_space", Bool(&GroupInFile::in_space),
        "If true, planar members are placed in a tilted plane in space."},
       {"preprocess", Bool(&GroupInFile::compile),
        "If true, the members' parts after all simplifications replace the members."},
       {"", By(Json::object(), ChangeMembers)},
       {"measure", Choices(&BenchmarkGroup::kinds, NamesOf<BenchmarkKind>, "a measured quantity"),
        "Right-hand sides, integrator steps, or both.", "\"rhs\", \"step\" or both"},
       {"methods", Methods(&BenchmarkGroup::methods), "Methods that impose the loop constraints.",
        "an array of methods"}});
  return fields;
}

/// Reports peers, which are timed over whole runs only.
void ReportPeer(const JsonNode& node, const BenchmarkGroup& group) {
  for (const Method& method : group.methods) {
    if (!FindFormulation(method.formulation)->is_peer()) continue;
    node.FailAs(fmt::format("\"{}\"", method.formulation),
                "a formulation: peers are timed by experiments");
    return;
  }
}

/// Reports the first repeated benchmark: names must be unique.
void ReportRepeatedBenchmark(const JsonNode& node, const BenchmarkGroup& group,
                             std::set<std::string>* taken) {
  for (const BenchmarkMember& member : group.members) {
    for (const BenchmarkKind kind : group.kinds) {
      for (const Method& method : group.methods) {
        const std::string name = BenchmarkName(kind, member, method);
        if (taken->insert(name).second) continue;
        node.FailAs(fmt::format("benchmark \"{}\" again", name), "each benchmark once");
        return;
      }
    }
  }
}

/// Reads the file of states; its errors are added with its own file name.
StateHashes ReadStates(const std::filesystem::path& path, ErrorList* errors) {
  try {
    return ReadDocument(ReadTextFile(path), path.string(), [](const JsonNode& root) {
      StateHashes states;
      for (const auto& [name, node] : root.Members()) {
        const std::string hash = node.Text();
        const bool is_hash =
            hash.size() == 16 && hash.find_first_not_of("0123456789abcdef") == std::string::npos;
        if (!hash.empty() && !is_hash) node.Fail("16 hexadecimal digits");
        states[name] = hash;
      }
      return states;
    });
  } catch (const ConfigError& mistakes) {
    errors->AddText(mistakes.what());
    return {};
  }
}

void ReadNamedStates(const JsonNode& node, BenchmarkSet& set) {
  const std::string named = node.Text();
  if (named.empty()) return;
  // the file may be missing: --save-states writes it
  set.states_path = set.path.parent_path() / named;
  std::error_code error;
  if (std::filesystem::exists(set.states_path, error)) {
    set.states = ReadStates(set.states_path, &node.errors());
  }
}

void ReadGroups(const JsonNode& node, BenchmarkSet& set) {
  std::set<std::string> taken;
  for (const JsonNode& element : node.Elements("groups", "at least one group")) {
    GroupInFile group;
    group.folder = set.path.parent_path();
    GroupFields().Read(element, &group);
    set.groups.push_back(group);
    ReportPeer(element, group);
    ReportRepeatedBenchmark(element, group, &taken);
  }
}

const Fields<BenchmarkSet>& BenchmarkFields() {
  static const Fields<BenchmarkSet> fields(
      "benchmarks",
      "Benchmarks of loopbench_bench and loopbench_count: every combination of a group's "
      "members, measures and methods. The program also checks that mechanism files exist and are "
      "valid, and that benchmarks are different.",
      DocumentRows<BenchmarkSet>(
          {{"name", Text(&BenchmarkSet::name), "Name of the set of benchmarks.", "a name"},
           {"comment", Text(&BenchmarkSet::comment), "Free text for readers."},
           {"states", By(TextSchema(), ReadNamedStates),
            "File of state hashes, relative to this file. loopbench_bench --save-states writes "
            "it."},
           {"integrator",
            Choice(&BenchmarkSet::integrator, ProfileNames(), "an integrator profile"),
            "Integrator profile of the measured step."},
           {"step", Number(&BenchmarkSet::step, kPositive), "Length of the measured step [s]."},
           {"groups", By(ArraySchema(GroupFields().Schema(), 1), ReadGroups), "Groups.",
            "an array of groups"}}));
  return fields;
}

}  // namespace

const std::vector<SizedFamily>& SizedFamilies() {
  // the smallest loops have three bars in the plane and six in space
  static const std::vector<SizedFamily> all = {
      {"chain", 3, kLargest, "bars of a closed chain", [](int n) { return Started(Chain(n), n); }},
      {"ladder", 1, kLargest, "windows in a row", [](int n) { return Ladder(n, 1.0, 1.0); }},
      // storey angles start at 0.4 rad and increase by 0.1 rad: the 25th is 2.8 rad, the 29th would
      // be flat
      {"grid", 1, 25, "storeys of as many windows", [](int n) { return Grid(n, n, 0.4, 0.5); }},
      {"tree", 1, kLargest, "bars of a binary tree", [](int n) { return Tree(n, 0.1); }},
      {"arm", 1, kLargest, "bars in space, with axes of all directions",
       [](int n) { return Started(Arm(n, false), n); }},
      {"ring", 6, kLargest, "the same in a closed loop",
       [](int n) { return Started(Arm(n, true), n); }}};
  return all;
}

std::vector<std::string> NamesOfSizedFamilies() {
  return Mapped<std::string>(SizedFamilies(), &SizedFamily::name);
}

std::string TextOfSizedFamilies() {
  std::string text = "Meaning of a size:";
  for (const SizedFamily& family : SizedFamilies()) {
    text += fmt::format("{} {} ({}, from {})", &family == &SizedFamilies().front() ? "" : ",",
                        family.name, family.of_what, family.smallest);
  }
  return text + ".";
}

const SizedFamily& SizedFamilyOf(const std::string& name) {
  const auto at = std::ranges::find(SizedFamilies(), name, &SizedFamily::name);
  if (at == SizedFamilies().end()) throw std::invalid_argument("no family \"" + name + "\"");
  return *at;
}

MechanismDescription BenchmarkMember::Make() const {
  return family.empty() ? description : SizedFamilyOf(family).make(size);
}

std::string BenchmarkName(BenchmarkKind kind, const BenchmarkMember& member, const Method& method) {
  return std::string(kNames<BenchmarkKind>[static_cast<std::size_t>(kind)]) + "/" + member.name +
         "/" + ToString(method);
}

Json BenchmarksSchema() { return BenchmarkFields().OwnSchema(); }

BenchmarkSet ReadBenchmarks(const std::filesystem::path& path) {
  return ParseBenchmarks(ReadTextFile(path), path);
}

BenchmarkSet ParseBenchmarks(std::string_view text, const std::filesystem::path& path) {
  return ReadDocument(text, path.string(), [&](const JsonNode& root) {
    BenchmarkSet set;
    set.path = path;
    if (ExpectDocument(root, FileKind::kBenchmarks)) BenchmarkFields().ReadRows(root, &set);
    return set;
  });
}

std::string StatesToJson(const StateHashes& states) {
  const nlohmann::json document = states;
  return document.dump(2) + "\n";
}

}  // namespace loopbench::harness
