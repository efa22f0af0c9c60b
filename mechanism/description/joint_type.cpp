#include "mechanism/description/joint_type.h"

namespace loopbench {

std::string_view ToString(SpaceKind space) {
  return space == SpaceKind::kPlanar ? "planar" : "spatial";
}

namespace {

/// "angle" and "wx" are of rotations, "qw" has no unit, what is left are lengths.
std::string_view UnitOf(std::string_view word, bool speed) {
  if (word.front() == 'q') return "";
  const bool turns = word.front() == 'a' || word.front() == 'w';
  return turns ? (speed ? "rad/s" : "rad") : (speed ? "m/s" : "m");
}

}  // namespace

std::vector<ValueWord> ValueWords(JointType type, SpaceKind space, bool speeds) {
  const JointTraits& traits = TraitsOf(type);
  std::string_view list = traits.coordinates;
  if (space == SpaceKind::kPlanar && traits.in_plane) {
    list = traits.planar;
  } else if (speeds && !traits.speeds.empty()) {
    list = traits.speeds;
  }
  constexpr std::string_view kBetween = ", ";
  std::vector<ValueWord> words;
  while (!list.empty()) {
    const std::string_view word = list.substr(0, list.find(kBetween));
    words.push_back({word, UnitOf(word, speeds)});
    list.remove_prefix(std::min(list.size(), word.size() + kBetween.size()));
  }
  return words;
}

int NumValues(JointType type, SpaceKind space, bool speeds) {
  return static_cast<int>(ValueWords(type, space, speeds).size());
}

}  // namespace loopbench
