// Joints and forces that a program adds (mechanism/model/registry.h), and those of
// examples/own-parts.
#include "examples/own-parts/friction.h"
#include "examples/own-parts/rack_and_pinion.h"
#include "mechanism/description/library.h"
#include "mechanism/model/registry.h"
#include "tests/harness/in_child.h"
#include "tests/reference/cases.h"

namespace kinds_test {

/// A spring that is the built-in one but for its name.
struct EchoSpring : loopbench::JointSpring {};
inline loopbench::ForceParts PartsOf(EchoSpring& f) {
  loopbench::ForceParts parts = loopbench::PartsOf(static_cast<loopbench::JointSpring&>(f));
  parts.name = "echo_spring";
  return parts;
}

}  // namespace kinds_test

template <class Space, class S>
class loopbench::ForceElement<Space, S, kinds_test::EchoSpring>
    : public ForceElement<Space, S, JointSpring> {
  using ForceElement<Space, S, JointSpring>::ForceElement;
};

namespace loopbench::harness {
namespace kinds_test {

using namespace reference;

JointKindSet BuiltIn(JointType type, bool in_plane) {
  JointKindSet kinds{{}, {}, KindOf<Spatial, double>(type), KindOf<Spatial, Dual>(type)};
  if (in_plane) {
    kinds.planar = KindOf<Planar, double>(type);
    kinds.planar_dual = KindOf<Planar, Dual>(type);
  }
  return kinds;
}

JointTraits Named(JointType type, std::string_view name) {
  JointTraits traits = TraitsOf(type);
  traits.name = name;
  return traits;
}

/// Returns the faults of a built-in joint kind after a change.
template <class Change>
std::string WrongWith(JointType type, Change change) {
  JointTraits traits = Named(type, "other");
  JointKindSet kinds = BuiltIn(type, traits.in_plane);
  change(traits, kinds);
  return RefusalOf([&] { RegisterJoint(traits, kinds); });
}

using Traits = JointTraits;
using Kinds = JointKindSet;

TEST(OtherJoints, WhatContradictsItselfIsRefused) {
  ExpectPart(WrongWith(JointType::kRevolute, [](Traits& t, Kinds&) { t.name = "weld"; }),
             "it again");
  ExpectPart(WrongWith(JointType::kRevolute, [](Traits& t, Kinds&) { t.name = "My joint"; }),
             "no word");
  ExpectPart(WrongWith(JointType::kRevolute, [](Traits&, Kinds& k) { k.planar = {}; }),
             "no transform, coordinates or rates in the plane");
  ExpectPart(WrongWith(JointType::kRevolute, [](Traits& t, Kinds&) { t.coordinates = "shift"; }),
             "an angle among its axes where its traits name a length");
  ExpectPart(WrongWith(JointType::kCylindrical, [](Traits& t, Kinds&) { t.coordinates = "angle"; }),
             "other coordinates and speeds than its traits name");
  ExpectPart(WrongWith(JointType::kRevolute,
                       [](Traits&, Kinds& k) { k.spatial.axes = {2, 0, 0, 3, 4, 5}; }),
             "axes that are not each axis once");
  ExpectPart(WrongWith(JointType::kRevolute,
                       [](Traits&, Kinds& k) { k.spatial.axes = {1, 0, 2, 3, 4, 5}; }),
             "not the derivative of the transform");
  ExpectPart(WrongWith(JointType::kUniversal, [](Traits&, Kinds& k) { k.spatial.bias = nullptr; }),
             "a bias that is not the derivative of H u");
  ExpectPart(WrongWith(JointType::kHelical,
                       [](Traits&, Kinds& k) {
                         k.spatial.coordinates = [](const Pose<Spatial, double>& X, double* q,
                                                    double pitch) { q[0] = X.p[2] / pitch + 0.1; };
                       }),
             "an admissible pose that `coordinates` does not give back");
  ExpectPart(WrongWith(JointType::kPrismatic,
                       [](Traits&, Kinds& k) { k.planar.rotation_invariant = true; }),
             "rotations of F change D in the plane");
  ExpectPart(WrongWith(JointType::kUniversal,
                       [](Traits&, Kinds& k) {
                         k.spatial.basis = [](const Pose<Spatial, double>&,
                                              Basis<Spatial, double>& b, double) {
                           for (int i = 0; i < 6; ++i)
                             b[i] = Direction<Spatial, double>::Unit(i / 2);
                         };
                       }),
             "directions [H D] that are not orthogonal");
}

/// The check itself finds nothing wrong with what other tests hold to an oracle.
TEST(OtherJoints, BuiltInKindsWouldPass) {
  InChild([] {
    const std::vector<JointTraits> all(AllJointTraits().begin(), AllJointTraits().end());
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto type = static_cast<JointType>(i);
      if (type == JointType::kRod) continue;  // it has no coordinates, as only a built-in kind may
      const std::string* name = new std::string("other-" + std::string(all[i].name));
      EXPECT_EQ(
          RefusalOf([&] { RegisterJoint(Named(type, *name), BuiltIn(type, all[i].in_plane)); }),
          "none")
          << *name;
    }
  });
}

/// All formulations in both coordinate sets, which may have redundant loops.
std::vector<Method> RankRevealingMethods() {
  std::vector<Method> methods = PublishedMethods();
  for (Method& method : methods) method.solver = SolverKind::kRankRevealing;
  return methods;
}

Record RunText(const std::string& text, const Method& method, const std::string& profile) {
  const MechanismFile file = ParseMechanism(text, "test.json");
  const Experiment experiment = Single(file);
  Case one = CaseOf(experiment, file.description.name, method, 1e-6, 0.1);
  one.integrator = profile;
  return RunCase(experiment, one);
}

/// Pins and springs under other names are the same mechanism: the same bits, explicit and implicit
/// (with derivatives in dual numbers), in plane and space.
TEST(OtherKinds, UnderAnotherNameGiveTheSameBits) {
  InChild([] {
    RegisterJoint(Named(JointType::kRevolute, "hinge"), BuiltIn(JointType::kRevolute, true));
    RegisterForce<::kinds_test::EchoSpring>();
    for (const char* name : {"four-bar", "bennett"}) {
      const std::filesystem::path path = kConfigs / "mechanisms" / (std::string(name) + ".json");
      std::string text = ReadFile(path);
      const std::string spring = R"("forces": [{"type": "joint_spring", "joint": ")" +
                                 ReadMechanism(path).description.joints[0].name +
                                 R"(", "stiffness": 2.0, "rest": 0.1}],)";
      text.insert(text.find('{') + 1, "\n" + spring);
      const std::string other =
          std::regex_replace(std::regex_replace(text, std::regex("\"revolute\""), "\"hinge\""),
                             std::regex("joint_spring"), "echo_spring");
      ASSERT_NE(other, text);
      for (const Method& method : PublishedMethods()) {
        for (const char* profile : {"dormand-prince", "kvaerno-54"}) {
          const Record a = RunText(text, method, profile), b = RunText(other, method, profile);
          EXPECT_EQ(a.Text("outcome"), "finished") << a.Text("message");
          EXPECT_EQ(a.Text("state_hash"), b.Text("state_hash")) << name << ToString(method);
          EXPECT_EQ(a.Number("energy_error_max"), b.Number("energy_error_max"));
        }
      }
    }
  });
}

/// A wheel and a slider on its axle, on a rack along x, which closes the loop; gravity pulls along
/// it: x'' = g (m + M) / (m + M + I / r^2), with the slider's mass M.
std::string WheelOnRack(const std::string& space) {
  const std::string vector = space == "planar" ? "" : ", 0.0";
  return R"({"name": "wheel-on-rack", "space": ")" + space + R"(", "gravity": [2.0, -9.0)" +
         vector +
         R"(],
    "bodies": [{"name": "slider", "mass": 1.5, "inertia": )" +
         (space == "planar" ? "0.1" : "[0.1, 0.1, 0.1]") + R"(},
               {"name": "wheel", "mass": 2.0, "inertia": )" +
         (space == "planar" ? "0.3" : "[0.2, 0.2, 0.3]") + R"(}],
    "joints": [
      {"name": "rail", "type": "prismatic", "from": {"body": "ground"}, "to": {"body": "slider"}},
      {"name": "axle", "type": "revolute", "from": {"body": "slider"}, "to": {"body": "wheel"}},
      {"name": "teeth", "type": "rack-and-pinion", "radius": -0.25, "cut": true,
       "from": {"body": "ground"}, "to": {"body": "wheel"}}],
    "initial": {"coordinates": {"rail": 0.5, "axle": -2.0}}})";
}

/// The rack of one size, a kind without parameter whose H is not of unit length.
template <class Space, class S>
struct RackOfOneSize {
  using Any = own::RackAndPinion<Space, S>;
  using X = Pose<Space, S>;
  static constexpr double kRadius = -0.25;

  static JointKind<Space, S> Make() {
    JointKind<Space, S> kind = Any::Make();
    kind.transform = [](const S* q, X& X_FM, S) { Any::Transform(q, X_FM, S(kRadius)); };
    kind.coordinates = [](const X& X_FM, S* q, S) { Any::Coordinate(X_FM, q, S(kRadius)); };
    kind.basis = [](const X& X_FM, Basis<Space, S>& basis_F, S) {
      Any::Directions(X_FM, basis_F, S(kRadius));
    };
    return kind;
  }
};

/// The wheel on either rack, which closes a loop or is a joint of the tree.
TEST(OtherKinds, AWheelRollsAsItsClosedFormSays) {
  InChild([] {
    own::RegisterRackAndPinion();
    RegisterJoint<RackOfOneSize>(
        {.name = "rack-of-one-size", .in_plane = true, .planar = "angle", .coordinates = "angle"});
    const auto with = [](const char* space, bool own_size, bool in_tree) {
      std::string text = WheelOnRack(space);
      const auto change = [&](const std::string& from, const std::string& to) {
        text.replace(text.find(from), from.size(), to);
      };
      if (own_size) change(R"("rack-and-pinion", "radius": -0.25)", R"("rack-of-one-size")");
      if (in_tree) change(R"("cut": true,)", "");
      if (in_tree)
        change(R"("to": {"body": "slider"}})", R"("to": {"body": "slider"}, "cut": true})");
      if (in_tree) change(R"("rail": 0.5)", R"("teeth": -2.0)");
      return ParseMechanism(text, "wheel.json");
    };
    for (const MechanismFile& file :
         {with("planar", false, false), with("planar", true, false), with("planar", false, true),
          with("planar", true, true), with("spatial", false, false), with("spatial", true, true)}) {
      const double a = 2.0 * 3.5 / (3.5 + 0.3 / (0.25 * 0.25));
      for (const Method& method : RankRevealingMethods()) {
        const Record record = RunFile(file, method, 1e-10, 2.0);
        ASSERT_EQ(record.Text("outcome"), "finished") << record.Text("message");
        const auto* x = std::get_if<std::vector<double>>(record.Find("series.displacement.rail"));
        const auto* turn = std::get_if<std::vector<double>>(record.Find("series.angle.axle"));
        ASSERT_NE(turn, nullptr) << ToString(method);
        // the motion is a parabola, which the method integrates but for round-off of 100 steps
        EXPECT_NEAR(turn->back(), -2.0 - a * 2.0 / 0.25, 1e-8) << ToString(method);
        if (x == nullptr) continue;  // the rail is cut
        EXPECT_NEAR(x->back(), 0.5 + a * 2.0, 1e-9) << ToString(method);
      }
    }
  });
}

TEST(OtherKinds, AreReadAndRefusedAsOthersAre) {
  InChild([] {
    own::RegisterRackAndPinion();
    RegisterForce<own::Friction>();
    const auto mistake = [](std::string text, const std::string& from, const std::string& to) {
      text.replace(text.find(from), from.size(), to);
      return MessageOf([&] { ParseMechanism(text, "wheel.json"); });
    };
    const std::string wheel = WheelOnRack("planar");
    ExpectPart(mistake(wheel, R"("radius": -0.25,)", ""), "\"radius\"");
    ExpectPart(mistake(wheel, "revolute\"", "revolute\", \"radius\": 1"),
               "no radius on a revolute joint");
    ExpectPart(mistake(wheel, "rack-and-pinion", "rack-and-pinon"), "rack-and-pinion");
    const auto force = [](const std::string& rest) {
      return R"("forces": [{"type": "joint_friction", )" + rest + R"(}], "space")";
    };
    ExpectPart(mistake(wheel, "\"space\"", force(R"("joint": "rail", "effort": 1)")), "\"speed\"");
    ExpectPart(mistake(wheel, "\"space\"", force(R"("joint": "rail", "effort": -1, "speed": 1)")),
               "effort");
    EXPECT_EQ(mistake(wheel, "\"space\"", force(R"("joint": "rail", "effort": 1, "speed": 1)")),
              "");
  });
}

/// The example's mechanism in all formulations: energy, which has friction in its balance, and
/// agreement.
TEST(OtherKinds, TheExampleKeepsItsBalance) {
  InChild([] {
    own::RegisterRackAndPinion();
    RegisterForce<own::Friction>();
    const MechanismFile file = ReadMechanism(std::filesystem::path(LOOPBENCH_SOURCE_DIR) /
                                             "examples/own-parts/mechanism.json");
    for (const Method& method : RankRevealingMethods()) {
      const Record record = RunFile(file, method, 1e-9, 2.0);
      ASSERT_EQ(record.Text("outcome"), "finished") << record.Text("message");
      // 1e3 tolerances, for the some hundred steps of a motion with sharp friction
      EXPECT_LE(record.Number("energy_error_max"), 1e-6) << ToString(method);
      EXPECT_GT(record.Number("energy_dissipated"), 0.01);
    }
  });
}

}  // namespace kinds_test
}  // namespace loopbench::harness
