// Kinds of forces that a program would add, and that no file could say.
#include "mechanism/model/registry.h"
#include "tests/harness/in_child.h"

namespace loopbench::harness::other_forces_test {

/// Parts as a kind may have them, of which a change makes parts that no file could say.
struct Odd {
  BodyPoint a, b, c;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  double number = 0.0;
  void (*change)(Odd&, ForceParts&) = nullptr;
};
ForceParts PartsOf(Odd& f) {
  ForceParts parts = {.name = "odd", .sentence = "Odd.", .points = {&f.a}};
  if (f.change != nullptr) f.change(f, parts);
  return parts;
}

TEST(OtherForces, ThatNoFileCouldSayAreRefused) {
  const auto refusal = [](void (*change)(Odd&, ForceParts&)) {
    Odd odd;
    odd.change = change;
    return RefusalOf([&] { RegisterForce(OtherForce(odd, nullptr)); });
  };
  ExpectPart(refusal([](Odd&, ForceParts& p) { p.name = "drag"; }), "it again");
  ExpectPart(refusal([](Odd&, ForceParts& p) { p.name = "Dr. Ag"; }), "no word");
  ExpectPart(refusal([](Odd&, ForceParts& p) { p.sentence = ""; }), "no sentence");
  ExpectPart(refusal([](Odd&, ForceParts& p) { p.points = {}; }), "0 points");
  ExpectPart(refusal([](Odd& f, ForceParts& p) { p.points = {&f.a, &f.b, &f.c}; }), "3 points");
  ExpectPart(refusal([](Odd& f, ForceParts& p) { p.force = &f.force; }), "both or none");
  ExpectPart(refusal([](Odd&, ForceParts& p) {
               p.numbers = {{"n", nullptr, quantity::kForce}};
             }),
             "without key or value");
  ExpectPart(refusal([](Odd& f, ForceParts& p) {
               p.numbers = {{"", &f.number, quantity::kForce}};
             }),
             "without key or value");
}

}  // namespace loopbench::harness::other_forces_test
