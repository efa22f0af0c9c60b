// Families of mechanisms (mechanism/description/library.h) as scenes: {"family": "chain", "bars":
// 10}.
#include <fmt/format.h>

#include <numbers>

#include "harness/config/experiment_sections.h"
#include "mechanism/description/library.h"

namespace loopbench::harness {
namespace {

constexpr std::int64_t kMostUnits = 100'000;  ///< bars, windows, storeys
constexpr double kAngle = 1.0,
                 kSpeed = 1.0;  ///< defaults of cranks [rad], [rad/s]: those of timing

std::vector<std::int64_t> ReadCounts(const JsonNode& node, const std::string& key,
                                     std::int64_t least) {
  const auto counts =
      node.Required(key, fmt::format("an integer from {}, a list of them or a range", least));
  return counts ? counts->IntegerList(least, kMostUnits) : std::vector<std::int64_t>();
}

double ReadOr(const JsonNode& node, const std::string& key, double fallback) {
  const auto number = node.Optional(key);
  return number ? number->Number() : fallback;
}

/// Held joints are what ensembles perturb: as many as there are degrees of freedom.
void HoldNamed(MechanismDescription* description, std::string_view start, std::size_t count) {
  for (std::size_t i = 0; i < description->joints.size(); ++i) {
    if (description->initial.held.size() == count) return;
    if (description->joints[i].name.starts_with(start)) {
      description->initial.held.push_back(static_cast<int>(i));
    }
  }
}

/// A member counted against the room before it is built; building a million bodies takes its time.
class Members {
 public:
  Members(const JsonNode& node, std::size_t room) : node_(node), room_(room) {}

  template <class Build>
  void Add(std::size_t bodies, std::string counts, const Json& canonical, Build build,
           const SceneObservation& observe = {}) {
    used_ += bodies;
    if (used_ > room_) return;
    FamilyMember member;
    member.counts = std::move(counts);
    member.mechanism.description = build();
    member.mechanism.observe = observe;
    member.mechanism.canonical = canonical.dump();
    members_.push_back(std::move(member));
  }

  std::vector<FamilyMember> Take() {
    if (used_ > room_) {
      node_.FailAs(fmt::format("mechanisms with {} bodies", used_),
                   fmt::format("at most {} in all scenes", kMaxBodies));
    }
    return std::move(members_);
  }

 private:
  const JsonNode& node_;
  std::size_t room_, used_ = 0;
  std::vector<FamilyMember> members_;
};

std::vector<FamilyMember> ReadChains(const JsonNode& node, std::size_t room) {
  Members members(node, room);
  const double speed = ReadOr(node, "speed", 0.0);
  for (const std::int64_t bars : ReadCounts(node, "bars", 3)) {
    members.Add(static_cast<std::size_t>(bars), fmt::format("{}", bars),
                {{"family", "chain"}, {"bars", bars}, {"speed", speed}}, [&] {
                  MechanismDescription chain = Chain(static_cast<int>(bars));
                  if (speed != 0.0) chain.initial.speeds.push_back({0, {speed}});
                  HoldNamed(&chain, "J", static_cast<std::size_t>(bars) - 2);
                  return chain;
                });
  }
  return members.Take();
}

/// The cranks turn as one pendulum: n + 1 cranks and n couplers, which only shift, all of 1 m and
/// 1 kg, give [(n + 1) / 3 + n] phi'' = -[(n + 1) / 2 + n] g sin(phi).
PendulumForm PendulumOfLadder(const MechanismDescription& ladder) {
  const double n = static_cast<double>(ladder.bodies.size() - 2) / 2;  // without Ground
  return {.body = "crank0",
          .down_angle = -std::numbers::pi / 2,
          .frequency_squared = ((n + 1) / 2 + n) * -ladder.gravity.y() / ((n + 1) / 3 + n)};
}

std::vector<FamilyMember> ReadLadders(const JsonNode& node, std::size_t room) {
  Members members(node, room);
  const double angle = ReadOr(node, "angle", kAngle), speed = ReadOr(node, "speed", kSpeed);
  for (const std::int64_t windows : ReadCounts(node, "windows", 1)) {
    members.Add(static_cast<std::size_t>(2 * windows + 1), fmt::format("{}", windows),
                {{"family", "ladder"}, {"windows", windows}, {"angle", angle}, {"speed", speed}},
                [&] {
                  MechanismDescription ladder = Ladder(static_cast<int>(windows), angle, speed);
                  HoldNamed(&ladder, "O", 1);
                  return ladder;
                });
  }
  std::vector<FamilyMember> ladders = members.Take();
  for (FamilyMember& ladder : ladders) {
    ladder.mechanism.observe.closed_form = PendulumOfLadder(ladder.mechanism.description);
  }
  return ladders;
}

/// The first crank of each storey moves as it likes: J crank 1.0, J crank 2.0, ...
void HoldFirstCranks(MechanismDescription* grid) {
  for (std::size_t i = 0; i < grid->joints.size(); ++i) {
    const std::string& name = grid->joints[i].name;
    if (name.starts_with("Jcrank") && name.ends_with(".0")) {
      grid->initial.held.push_back(static_cast<int>(i));
    }
  }
}

std::vector<FamilyMember> ReadGrids(const JsonNode& node, std::size_t room) {
  Members members(node, room);
  const double angle = ReadOr(node, "angle", kAngle), speed = ReadOr(node, "speed", kSpeed);
  const std::vector<std::int64_t> all_windows = ReadCounts(node, "windows", 1);
  for (const std::int64_t storeys : ReadCounts(node, "storeys", 1)) {
    for (const std::int64_t windows : all_windows) {
      members.Add(static_cast<std::size_t>(storeys * (2 * windows + 1)),
                  fmt::format("{}x{}", storeys, windows),
                  {{"family", "grid"},
                   {"storeys", storeys},
                   {"windows", windows},
                   {"angle", angle},
                   {"speed", speed}},
                  [&] {
                    MechanismDescription grid =
                        Grid(static_cast<int>(storeys), static_cast<int>(windows), angle, speed);
                    HoldFirstCranks(&grid);
                    return grid;
                  });
    }
  }
  return members.Take();
}

}  // namespace

std::vector<FamilyMember> ReadFamilyMembers(const JsonNode& node, std::size_t room) {
  const auto family = node.Required("family", "a family");
  const auto kind = family ? family->Choice({"chain", "ladder", "grid"}, "a family") : std::nullopt;
  if (kind == 0 && node.ExpectObject({"family", "bars", "speed"})) return ReadChains(node, room);
  if (kind == 1 && node.ExpectObject({"family", "windows", "angle", "speed"})) {
    return ReadLadders(node, room);
  }
  if (kind == 2 && node.ExpectObject({"family", "storeys", "windows", "angle", "speed"})) {
    return ReadGrids(node, room);
  }
  return {};
}

}  // namespace loopbench::harness
