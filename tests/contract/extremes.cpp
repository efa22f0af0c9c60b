#include "tests/contract/extremes.h"

#include "tests/contract/builder.h"

namespace loopbench::testing {

namespace {

int Append(Builder& b, JointType type, int parent) {
  const int body = b.AddBody(1.0);
  const Eigen::Vector3d at = b.Tip();
  b.AddJoint(type, parent, at, body, b.random.Vector(0.2, b.spatial), b.random.Uniform(-2.0, 2.0));
  return body;
}

}  // namespace

MechanismDescription ChainOfEveryKind(int n, SpaceKind space, std::uint64_t seed) {
  Builder b("every-kind-" + std::to_string(n), space, seed);
  std::vector<JointType> kinds;
  for (int k = 0; k < std::ssize(AllJointTraits()); ++k) {
    const auto type = static_cast<JointType>(k);
    if (type == JointType::kFree || type == JointType::kRod) continue;
    if (b.spatial || TraitsOf(type).in_plane) kinds.push_back(type);
  }
  int last = 0;
  for (int i = 0; i < n; ++i) last = Append(b, kinds[i % kinds.size()], last);
  b.Close(JointType::kRevolute, 0, last, b.Tip(), 0.0);
  b.Close(JointType::kRod, n / 2 - 4, n / 2 + 4, b.Tip(), 0.0);
  Append(b, JointType::kFree, last);
  return b.Finish();
}

MechanismDescription NestedLoops(int loops, SpaceKind space, std::uint64_t seed) {
  Builder b("nested-" + std::to_string(loops), space, seed);
  const int half = b.spatial ? 9 : 3;
  int from_left = 0, from_right = 0;
  for (int i = 0; i < loops; ++i) {
    int left = from_left, right = from_right;
    for (int k = 0; k < half; ++k) {
      left = Append(b, JointType::kRevolute, left);
      right = Append(b, JointType::kRevolute, right);
      if (k == half / 2) {
        from_left = left;
        from_right = right;
      }
    }
    b.Close(JointType::kRevolute, left, right, b.Tip(), b.random.Uniform(-1.0, 1.0));
  }
  return b.Finish();
}

}  // namespace loopbench::testing
