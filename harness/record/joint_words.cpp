#include "harness/record/joint_words.h"

#include <array>

namespace loopbench::harness {

namespace {

constexpr CoordinateWord kAngle{"angle", "rad"}, kShift{"shift", "m"}, kX{"x", "m"}, kY{"y", "m"},
    kZ{"z", "m"};
constexpr CoordinateWord kTurnX{"wx", "rad/s"}, kTurnY{"wy", "rad/s"}, kTurnZ{"wz", "rad/s"},
    kMoveX{"x", "m/s"}, kMoveY{"y", "m/s"}, kMoveZ{"z", "m/s"};

}  // namespace

std::vector<CoordinateWord> CoordinateWords(JointType type, SpaceKind space) {
  switch (type) {
    case JointType::kRevolute:
    case JointType::kHelical:
      return {kAngle};
    case JointType::kPrismatic:
      return {kShift};
    case JointType::kPinInSlot:
    case JointType::kCylindrical:
      return {kAngle, kShift};
    case JointType::kFree:
      if (space == SpaceKind::kPlanar) return {kAngle, kX, kY};
      return {{"qw", ""}, {"qx", ""}, {"qy", ""}, {"qz", ""}, kX, kY, kZ};
    case JointType::kSpherical:
      return {{"qw", ""}, {"qx", ""}, {"qy", ""}, {"qz", ""}};
    case JointType::kPlanar:
      return {kAngle, kX, kY};
    case JointType::kUniversal:
      return {{"angle about x", "rad"}, {"angle about y", "rad"}};
    case JointType::kWeld:
    case JointType::kRod:
      break;
  }
  return {};
}

std::vector<CoordinateWord> SpeedWords(JointType type, SpaceKind space) {
  if (type == JointType::kSpherical) return {kTurnX, kTurnY, kTurnZ};
  if (type == JointType::kFree && space == SpaceKind::kSpatial) {
    return {kTurnX, kTurnY, kTurnZ, kMoveX, kMoveY, kMoveZ};
  }
  std::vector<CoordinateWord> words = CoordinateWords(type, space);
  for (CoordinateWord& word : words) word.unit = word.unit == "rad" ? "rad/s" : "m/s";
  return words;
}

std::string_view AxesOfSide(JointType type, SpaceKind space, bool from) {
  const bool plane = space == SpaceKind::kPlanar;
  switch (type) {
    case JointType::kPrismatic:
      return "x";
    case JointType::kPinInSlot:
      return plane ? (from ? "x" : "") : (from ? "zx" : "z");
    case JointType::kRevolute:
      return plane ? "" : "z";
    case JointType::kCylindrical:
    case JointType::kPlanar:
    case JointType::kHelical:
      return "z";
    case JointType::kUniversal:
      return from ? "x" : "y";
    case JointType::kWeld:
    case JointType::kFree:
    case JointType::kSpherical:
    case JointType::kRod:
      break;
  }
  return "";
}

}  // namespace loopbench::harness
