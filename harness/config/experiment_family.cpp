// Families of mechanisms (mechanism/description/library.h) as scenes: {"family": "chain", "bars":
// 10}.
#include <fmt/format.h>

#include <numbers>

#include "harness/config/experiment_sections.h"
#include "mechanism/description/library.h"

namespace loopbench::harness {
namespace {

constexpr std::int64_t kMostUnits = 100'000;  ///< bars, windows, storeys

/// {"family": "chain", ...} and so on; the defaults of cranks are those of timing.
struct ChainFamily {
  std::vector<std::int64_t> bars;
  double speed = 0.0;
};
struct LadderFamily {
  std::vector<std::int64_t> windows;
  double angle = 1.0, speed = 1.0;
};
struct GridFamily : LadderFamily {
  std::vector<std::int64_t> storeys;
};

std::string CountsExpected(int least) {
  return fmt::format("an integer from {}, a list of them or a range", least);
}

const Fields<ChainFamily>& ChainFields() {
  static const Fields<ChainFamily> fields(
      "chain", "Closed chains of bars.",
      {{"family", ChoiceSchema({"chain"}), "What it is.", "a family"},
       {"bars", IntegerList(&ChainFamily::bars, 3, kMostUnits), "How many.", CountsExpected(3)},
       {"speed", Number(&ChainFamily::speed), "Of the first bar [rad/s]."}});
  return fields;
}

const Fields<LadderFamily>& LadderFields() {
  static const Fields<LadderFamily> fields(
      "ladder", "Parallel cranks, couplers between them: windows in a row.",
      {{"family", ChoiceSchema({"ladder"}), "What it is.", "a family"},
       {"windows", IntegerList(&LadderFamily::windows, 1, kMostUnits), "How many.",
        CountsExpected(1)},
       {"angle", Number(&LadderFamily::angle), "Of the cranks [rad]."},
       {"speed", Number(&LadderFamily::speed), "Of the cranks [rad/s]."}});
  return fields;
}

const Fields<GridFamily>& GridFields() {
  static const Fields<GridFamily> fields(
      "grid", "Storeys of windows.",
      {{"family", ChoiceSchema({"grid"}), "What it is.", "a family"},
       {"storeys", IntegerList(&GridFamily::storeys, 1, kMostUnits), "How many.",
        CountsExpected(1)},
       {"windows", IntegerList(&GridFamily::windows, 1, kMostUnits), "In each storey.",
        CountsExpected(1)},
       {"angle", Number(&GridFamily::angle),
        "Of the first storey's cranks [rad]; each storey stands 0.1 further."},
       {"speed", Number(&GridFamily::speed),
        "Of the first storey's cranks [rad/s]; that of storey r is r times as much."}});
  return fields;
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

std::vector<FamilyMember> MakeMembers(const ChainFamily& family, const JsonNode& node,
                                      std::size_t room) {
  Members members(node, room);
  const double speed = family.speed;
  for (const std::int64_t bars : family.bars) {
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

std::vector<FamilyMember> MakeMembers(const LadderFamily& family, const JsonNode& node,
                                      std::size_t room) {
  Members members(node, room);
  const double angle = family.angle, speed = family.speed;
  for (const std::int64_t windows : family.windows) {
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

std::vector<FamilyMember> MakeMembers(const GridFamily& family, const JsonNode& node,
                                      std::size_t room) {
  Members members(node, room);
  const double angle = family.angle, speed = family.speed;
  for (const std::int64_t storeys : family.storeys) {
    for (const std::int64_t windows : family.windows) {
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

template <class Family>
std::vector<FamilyMember> ReadFamily(const Fields<Family>& fields, const JsonNode& node,
                                     std::size_t room) {
  Family family;
  if (!fields.Read(node, &family)) return {};
  return MakeMembers(family, node, room);
}

}  // namespace

Json FamilySchema() {
  return Named("family", EitherSchema({ChainFields().Schema(), LadderFields().Schema(),
                                       GridFields().Schema()}));
}

std::vector<FamilyMember> ReadFamilyMembers(const JsonNode& node, std::size_t room) {
  const auto family = node.Required("family", "a family");
  const auto kind = family ? family->Choice({"chain", "ladder", "grid"}, "a family") : std::nullopt;
  if (kind == 0) return ReadFamily(ChainFields(), node, room);
  if (kind == 1) return ReadFamily(LadderFields(), node, room);
  if (kind == 2) return ReadFamily(GridFields(), node, room);
  return {};
}

}  // namespace loopbench::harness
