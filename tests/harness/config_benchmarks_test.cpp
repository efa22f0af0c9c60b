// What the reader of configs/benchmarks/ takes and refuses.
#include "harness/config/benchmarks.h"
#include "harness/run/timing.h"
#include "mechanism/model/mechanism.h"
#include "tests/harness/places.h"

namespace loopbench::harness::config_benchmarks_test {

namespace fs = std::filesystem;

constexpr std::string_view kSet = R"({
  "name": "small", "step": 1e-4, "integrator": "ode45",
  "groups": [
    {"mechanisms": "mechanisms/four-bar.json", "measure": "rhs",
     "methods": [{"formulation": "odca", "enforcement": "acceleration"}]},
    {"family": "grid", "sizes": [1, 2], "measure": ["rhs", "step"],
     "methods": [{"formulation": "lagrange", "enforcement": "velocity"}]}]})";

BenchmarkSet ParseSet(const std::string& text) {
  return ParseBenchmarks(text, kConfigs / "b.json");
}

TEST(BenchmarkSet, IsReadWithMembersKindsAndColumns) {
  const BenchmarkSet set = ParseSet(std::string(kSet));
  ASSERT_EQ(set.groups.size(), 2u);
  EXPECT_EQ(set.groups[0].members[0].name, "four-bar");
  EXPECT_EQ(set.groups[0].members[0].Make().bodies.size(), 4u);
  EXPECT_EQ(set.groups[1].members[1].name, "grid/2");
  EXPECT_EQ(set.groups[1].members[1].Make().bodies.size(), 11u);  // 2 x 5 bars and ground
  EXPECT_EQ(set.groups[1].kinds.size(), 2u);
  EXPECT_EQ(BenchmarkName(BenchmarkKind::kStep, set.groups[1].members[1], set.groups[1].methods[0]),
            "step/grid/2/lagrange/velocity/joint/rank-revealing");
}

TEST(BenchmarkSet, TakesMembersIntoSpaceAndSimplifiesThem) {
  const BenchmarkSet set = ReadBenchmarks(kConfigs / "benchmarks/simplifications.json");
  std::map<std::string, MechanismDescription> members;
  for (const BenchmarkGroup& group : set.groups) {
    for (const BenchmarkMember& member : group.members) members[member.name] = member.Make();
  }
  EXPECT_EQ(members.at("four-bar").space, SpaceKind::kPlanar);
  EXPECT_EQ(members.at("four-bar/space").space, SpaceKind::kSpatial);
  EXPECT_EQ(members.at("four-bar/space/compiled").space, SpaceKind::kPlanar);
  EXPECT_EQ(members.at("ladder/5/space").space, SpaceKind::kSpatial);
  EXPECT_EQ(members.at("ladder/5/space/compiled").bodies.size(),
            members.at("ladder/5").bodies.size());
  EXPECT_EQ(members.at("welded-four-bar/compiled").bodies.size(), 4u);
  EXPECT_EQ(members.at("truss/compiled").bodies.size(), 3u);
  EXPECT_EQ(members.at("four-islands/compiled/4").bodies.size(), 4u);
}

TEST(BenchmarkSet, OfTheRepositoryReachesAThousandBodies) {
  const BenchmarkSet set = ReadBenchmarks(kConfigs / "benchmarks/default.json");
  EXPECT_EQ(set.states.size(), 38u);
  for (const std::string family : {"chain", "ladder", "grid"}) {
    std::size_t odca = 0, dense = 0;
    for (const BenchmarkGroup& group : set.groups) {
      for (const BenchmarkMember& member : group.members) {
        if (member.family != family) continue;
        const bool is_odca = group.methods[0].formulation == "odca";
        std::size_t& largest = is_odca ? odca : dense;
        largest = std::max(largest, member.Make().bodies.size() - 1);
      }
    }
    EXPECT_GE(odca, 1000u) << family;
    EXPECT_GE(dense, 100u) << family;
  }
  EXPECT_FALSE(ReadBenchmarks(kConfigs / "benchmarks/counts.json").groups.empty());
}

TEST(BenchmarkSet, StatesAreReadStrictly) {
  const fs::path folder = fs::path(testing::TempDir()) / "loopbench-states";
  WriteFileAtomically(folder / "s.json", R"({"grid/1/joint": "0123456789abcdef", "x": "short"})");
  const std::string text = R"({"name": "n", "states": "s.json", "groups": [
    {"family": "grid", "sizes": 1, "measure": "rhs",
     "methods": [{"formulation": "odca", "enforcement": "velocity"}]}]})";
  const std::string message = MessageOf([&] { ParseBenchmarks(text, folder / "b.json"); });
  ExpectWords(message, {"s.json", "/x: found \"short\", expected 16 hexadecimal"});
  const StateHashes states = {{"grid/1/joint", "0123456789abcdef"}};
  WriteFileAtomically(folder / "s.json", StatesToJson(states));
  EXPECT_EQ(ParseBenchmarks(text, folder / "b.json").states, states);
  fs::remove_all(folder);
}

TEST(Subject, IsMeasuredAtAMovingStateThatIsTheSavedOne) {
  const BenchmarkSet set = ReadBenchmarks(kConfigs / "benchmarks/default.json");
  for (const BenchmarkGroup& group : set.groups) {
    const BenchmarkMember& member = group.members.front();
    const Method& method = group.methods.front();
    const MechanismDescription description = member.Make();
    const BenchmarkState state = ComputeState(description, method.coordinates);
    ASSERT_EQ(state.outcome, Outcome::kFinished) << member.name;
    EXPECT_GT(state.u.cwiseAbs().maxCoeff(), 0.01) << member.name;
    EXPECT_EQ(state.hash, set.states.at(member.name + "/joint"));
    const auto subject = MakeSubject(description, method, state, set.integrator, set.step);
    // the same work each time: neither derivatives nor steps leave anything behind
    ASSERT_EQ(subject->Derivative(), Outcome::kFinished) << member.name;
    const std::string first = HashExact(subject->derivative());
    for (int i = 0; i < 3; ++i) ASSERT_EQ(subject->Step(), Outcome::kFinished) << member.name;
    ASSERT_EQ(subject->Derivative(), Outcome::kFinished);
    EXPECT_EQ(HashExact(subject->derivative()), first) << member.name;
  }
}

TEST(Subject, HashesForgiveRoundOffOrNothing) {
  const std::vector<double> a = {1.0, -0.25}, b = {1.0 + 1e-13, -0.25}, c = {1.00001, -0.25};
  EXPECT_EQ(HashRounded(a), HashRounded(b));
  EXPECT_NE(HashRounded(a), HashRounded(c));
  EXPECT_NE(HashExact(a), HashExact(b));
}

}  // namespace loopbench::harness::config_benchmarks_test
