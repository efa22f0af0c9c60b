// convert: documents that stand on their own, names as they are, refusals by name.
#include "harness/exchange/export_names.h"
#include "harness/exchange/import.h"
#include "harness/exchange/model.h"
#include "mechanism/description/library.h"
#include "mechanism/simplify/restart.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/xml_fault.h"

namespace loopbench::harness::export_test {

using exchange::ExportedFile;
using exchange::ExportFormat;
using exchange::ExportFormats;

/// Returns the parts of a mechanism that `format` does not support.
std::vector<std::string> Missing(const MechanismDescription& mechanism,
                                 const ExportFormat& format) {
  try {
    exchange::Export(mechanism, format);
  } catch (const exchange::Unsupported& missing) {
    return missing.parts();
  }
  return {};
}

bool Says(const std::vector<exchange::Note>& notes, const std::string& words) {
  return std::ranges::any_of(
      notes, [&](const auto& note) { return note.text.find(words) != std::string::npos; });
}

TEST(Export, OfShippedMechanismsIsWholeAndTheSameEachTime) {
  for (const std::string& name : ShippedNames()) {
    const MechanismDescription mechanism = Shipped(name).description;
    for (const ExportFormat& format : ExportFormats()) {
      if (!Missing(mechanism, format).empty()) continue;
      const ExportedFile file = exchange::Export(mechanism, format);
      EXPECT_EQ(file.text, exchange::Export(mechanism, format).text) << name;
      EXPECT_EQ(file.text.find("nan"), std::string::npos) << name;
      EXPECT_EQ(file.text.find("inf,"), std::string::npos) << name;
      if (format.name == "mjcf") {
        EXPECT_EQ(FaultOfXml(file.text), "") << name;
      }
      // each body, joint and point by its name; those of the shipped ones need no escape
      for (const BodyDescription& body : mechanism.bodies) {
        EXPECT_TRUE(body.name == "ground" || file.text.find(body.name) != std::string::npos)
            << name << body.name;
        for (const auto& [point, at] : body.points) {
          const std::string words = format.name == "mjcf" ? "\"" + body.name + "." + point + "\""
                                                          : "\\\"name\\\":\\\"" + point + "\\\"";
          EXPECT_NE(file.text.find(words), std::string::npos) << name << words;
        }
      }
      for (const JointDescription& joint : mechanism.joints) {
        EXPECT_NE(file.text.find("\"" + joint.name), std::string::npos) << name << joint.name;
      }
    }
  }
}

TEST(Export, NamesAllThatAFormatDoesNotHave) {
  const ExportFormat &mjcf = ExportFormats().front(), &simbody = ExportFormats().back();
  EXPECT_EQ(Missing(Shipped("driven-four-bar").description, mjcf),
            std::vector<std::string>{"joint \"OA\": a prescribed motion"});
  EXPECT_EQ(Missing(Shipped("screw-jack").description, mjcf),
            (std::vector<std::string>{"joint_torque along joint \"bearing\", which depends on time",
                                      "joint \"thread\": helical",
                                      "joint \"guide\": prismatic, which closes a loop"}));
  MechanismDescription mechanism = Shipped("four-bar").description;
  const std::string cut = mechanism.joints.back().name;
  mechanism.joints.back().cut = true;
  const int last = static_cast<int>(mechanism.joints.size()) - 1;
  mechanism.forces = {JointDamper{.joint = last, .damping = 1.0},
                      Drag{.point = {.body = 1}, .linear = 1.0},
                      JointTorque{.joint = 0, .value = Polynomial{{0.0, 1.0}}},
                      PointForce{.point = {.body = 1}, .force = {1, 0, 0}, .in_body_axes = true}};
  std::vector<std::string> expected = {
      "joint_damper along joint \"" + cut + "\", which closes a loop",
      "drag on body \"" + mechanism.bodies[1].name + "\"",
      "joint_torque along joint \"" + mechanism.joints[0].name + "\", which depends on time"};
  EXPECT_EQ(Missing(mechanism, mjcf), expected);
  expected.push_back("point_force on body \"" + mechanism.bodies[1].name + "\", in its axes");
  EXPECT_EQ(Missing(mechanism, simbody), expected);
}

TEST(Export, JointsThatMjcfHasAsSeveralComeBackAsOne) {
  const ExportFormat &mjcf = ExportFormats().front(), &simbody = ExportFormats().back();
  for (const auto& [type, q] : {std::pair{JointType::kTranslation, std::vector{0.1, -0.2, 0.3}},
                                {JointType::kSchoenflies, {0.5, 0.1, -0.2, 0.3}},
                                {JointType::kPointOnLine, {0.8, 0.2, -0.4, 0.4, 0.3}},
                                {JointType::kPointInPlane, {0.8, 0.2, -0.4, 0.4, 0.3, -0.1}}}) {
    MechanismDescription mechanism;
    mechanism.name = "one";
    mechanism.space = SpaceKind::kSpatial;
    BodyDescription& body = mechanism.bodies.emplace_back();
    body.name = "b";
    body.mass = 2.0;
    body.com = {0.1, 0.2, -0.1};
    body.inertia = Eigen::Vector3d(0.1, 0.2, 0.25).asDiagonal();
    JointDescription joint;
    joint.name = "j";
    joint.type = type;
    joint.from = {0, {0.1, 0.2, 0.3}, {0.3, -0.2, 0.5}};
    joint.to = {1, {0.05, 0.0, 0.1}, {0.2, 0.4, -0.1}};
    mechanism.initial.coordinates = {{0, q}};
    mechanism.initial.held = {0};
    const auto speeds = static_cast<std::size_t>(NumValues(type, mechanism.space, true));
    mechanism.initial.speeds = {{0, std::vector<double>(speeds, 0.7)}};
    for (const bool reversed : {false, true}) {
      SCOPED_TRACE(std::string(ToString(type)) + (reversed ? ", reversed" : ""));
      if (reversed) std::swap(joint.from, joint.to);
      mechanism.joints = {joint};
      const MechanismDescription back =
          ImportText(exchange::Export(mechanism, mjcf).text, "m.xml").description;
      EXPECT_EQ(back.joints.at(0).type, type);
      std::string why;
      const BodyStart ours = AssembledStart(mechanism, &why).at("b"),
                      theirs = AssembledStart(back, &why).at("b");
      EXPECT_EQ(why, "");
      EXPECT_LE((ours.X.p - theirs.X.p).norm(), 1e-14);
      EXPECT_LE((ours.X.R - theirs.X.R).norm(), 1e-14);
      EXPECT_LE((ours.v - theirs.v).norm(), 1e-14);
      EXPECT_LE((ours.w - theirs.w).norm(), 1e-14);
      const std::string missing = "joint \"j\": " + std::string(ToString(type));
      EXPECT_EQ(Missing(mechanism, simbody), type == JointType::kTranslation
                                                 ? std::vector<std::string>()
                                                 : std::vector{missing});
    }
  }
}

TEST(Export, CouplingsAndRotorsAreParts) {
  MechanismDescription mechanism = Shipped("geared-five-bar").description;
  const ExportFormat &mjcf = ExportFormats().front(), &simbody = ExportFormats().back();
  // 40 A + 20 E is constant, and coordinates are counted from the start
  ExpectWords(exchange::Export(mechanism, mjcf).text,
              {"<joint name=\"gears\" joint1=\"A\" joint2=\"E\" polycoef=\"0.0 -0.5 "
               "0.0 0.0 0.0\"/>"});
  ExpectWords(exchange::Export(mechanism, simbody).text,
              {"  // coupling \"gears\"\n"
               "  Couple({{body[1], 40.0}, {body[2], 20.0}}, 0.0);\n"});
  mechanism.joints[0].rotor_inertia = 0.05;
  const ExportedFile rotor = exchange::Export(mechanism, simbody);
  ExpectWords(rotor.text, {"  Couple({{body[5], 1.0}, {body[1], -1.0}}, 0.0);\n"});
  EXPECT_TRUE(Says(rotor.notes, "rotor_inertia of joint \"A\" is a flywheel on Ground"));
  mechanism.couplings[0].parts.push_back({3, 5.0});
  const std::string three = exchange::Export(mechanism, mjcf).text;
  ExpectWords(three,
              {"<joint joint=\"D\" coef=\"5.0\"/>", "<tendon name=\"gears\" tendon1=\"gears\"/>"});
  mechanism.couplings[0].parts[2].joint = 4;
  mechanism.joints[4].rotor_inertia = 0.05;
  for (const ExportFormat& format : ExportFormats()) {
    EXPECT_EQ(Missing(mechanism, format),
              (std::vector<std::string>{"rotor of joint \"C\", which closes a loop",
                                        "coupling \"gears\" of joint \"C\", which closes a "
                                        "loop"}));
  }
}

TEST(Export, NamesBodiesThatOtherProgramsRefuse) {
  MechanismDescription mechanism = Shipped("spatial-four-bar").description;
  mechanism.bodies[1].inertia = Eigen::Vector3d(1.0, 1.0, 3.0).asDiagonal();
  for (const ExportFormat& format : ExportFormats()) {
    const std::vector<std::string> missing = Missing(mechanism, format);
    ASSERT_EQ(missing.size(), 1u);
    EXPECT_EQ(missing[0],
              "body \"" + mechanism.bodies[1].name +
                  "\": principal moments of inertia 1, 1 and 3 kg m^2, which no body has: the "
                  "largest is above the sum of the others");
  }
  // a plate is one, whatever rounding says of its principal moments
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Eigen::Matrix3d plate = Eigen::Vector3d(0.1, 0.2, 0.1 + 0.2).asDiagonal();
  mechanism.bodies[1].inertia = turn * plate * turn.transpose();
  mechanism.bodies[1].inertia = 0.5 * (mechanism.bodies[1].inertia +
                                       Eigen::Matrix3d(mechanism.bodies[1].inertia.transpose()));
  for (const ExportFormat& format : ExportFormats()) {
    EXPECT_TRUE(Missing(mechanism, format).empty());
  }
  mechanism.bodies[1].mass = 1e-16;
  EXPECT_EQ(Missing(mechanism, ExportFormats().front()).size(), 1u);
  // nested deeper than MuJoCo's parser goes
  const std::vector<std::string> deep = Missing(Chain(200), ExportFormats().front());
  ASSERT_EQ(deep.size(), 1u);
  ExpectWords(deep[0], {"more than 89 bodies between it and Ground"});
  EXPECT_TRUE(Missing(Chain(200), ExportFormats().back()).empty());
}

TEST(Export, SaysWhatIsSaidInOtherWords) {
  const ExportFormat &mjcf = ExportFormats().front(), &simbody = ExportFormats().back();
  const ExportedFile soft = exchange::Export(Shipped("slider-crank").description, mjcf);
  EXPECT_TRUE(Says(soft.notes, "joint \"A\" (revolute) closes a loop: a pair of points"));
  EXPECT_TRUE(Says(soft.notes, "joints \"S.shift\", \"S.angle\" of one body"));
  EXPECT_TRUE(Says(soft.notes, "The plane is z = 0 of space"));
  EXPECT_EQ(std::ranges::count(soft.notes, true, &exchange::Note::loss), 1);
  for (const exchange::Note& note : soft.notes) {
    // in the file too, where lines are broken
    EXPECT_NE(soft.text.find(note.text.substr(0, 40)), std::string::npos) << note.text;
  }
  const ExportedFile welded = exchange::Export(Shipped("welded-four-bar").description, mjcf);
  EXPECT_EQ(std::ranges::count(welded.notes, true, &exchange::Note::loss), 1);
  // a tree loses nothing
  const ExportedFile tree = exchange::Export(Shipped("pendulum").description, mjcf);
  EXPECT_EQ(std::ranges::count(tree.notes, true, &exchange::Note::loss), 0);
  const ExportedFile released = exchange::Export(Shipped("bennett").description, simbody);
  EXPECT_TRUE(Says(released.notes, "follows from the others"));
  EXPECT_EQ(std::ranges::count(released.notes, true, &exchange::Note::loss), 0);
}

TEST(Export, EscapesWhatWouldAct) {
  EXPECT_EQ(exchange::QuoteCpp("a\"b\\c\nd\?\?/\xc3\xbc"), R"("a\"b\\c\012d\?\?/\303\274")");
  EXPECT_EQ(exchange::QuoteCpp(std::string(1, '\0') + "1"), R"("\0001")");
  EXPECT_EQ(exchange::EscapeXmlAttribute("<\"&'>\n\t\x01"),
            R"(&lt;&quot;&amp;&#39;&gt;&#10;&#9;\x01)");
  for (const std::string text : {"a--b---c", "*/", "ends with \\", "\?\?/", "line\nline", "-"}) {
    const std::string line = exchange::EscapeComment(text);
    for (const char* bad : {"--", "*/", "\?\?", "\n"}) {
      ExpectNone(line, {bad});
    }
    EXPECT_NE(line.back(), '\\');
    EXPECT_NE(line.back(), '-');
  }
  EXPECT_EQ(exchange::NumberText(0.1), "0.1");
  EXPECT_EQ(exchange::NumberText(1.0), "1.0");
  EXPECT_EQ(exchange::NumberText(1e300), "1e+300");
  EXPECT_EQ(exchange::NumberText(4e-320), "0.0");
  exchange::UniqueNames names({"world"});
  EXPECT_EQ(names.Take("world"), "world_2");
  EXPECT_EQ(names.Take(""), "unnamed");
  EXPECT_EQ(names.Take(""), "unnamed_2");
}

TEST(Export, KeepsHostileNamesOutOfDocuments) {
  MechanismDescription mechanism = Shipped("four-bar").description;
  for (const std::string name : {"--><evil a='", "\"/>&", "*/ \\", "\x01\n#error", "world"}) {
    mechanism.name = name;
    mechanism.bodies[1].name = name;
    mechanism.bodies[1].points[name] = Eigen::Vector3d::Zero();
    mechanism.joints[0].name = name;
    const std::string document = exchange::Export(mechanism, ExportFormats().front()).text;
    EXPECT_EQ(FaultOfXml(document), "") << document;
    // a program of lines of ASCII, in which none but its own begin with #
    const std::string program = exchange::Export(mechanism, ExportFormats().back()).text;
    ExpectNone(program, {"\n#error", "\\\n"});
  }
}

using ConvertTest = CommandLineTest;

TEST_F(ConvertTest, WritesTheFileAndSaysWhatItSays) {
  Expect("export-mechanism four-bar.json --to mjcf", 0,
         {"wrote four-bar.xml: 3 bodies, 4 joints", "closes a loop", "With a loss: "});
  EXPECT_EQ(FaultOfXml(ReadFile(folder_ / "four-bar.xml")), "");
  ExpectEnding(
      Call("export-mechanism four-bar.json --to mjcf --step 1e-5 --out deep/er.xml --json"), 0,
      {R"({"file":"four-bar.json","name":"four-bar","to":"mjcf","out":"deep/er.xml",)",
       R"("missing":[],"notes":[{"loss":false,)", R"({"loss":true,"text":"MuJoCo's)"});
  ExpectWords(ReadFile(folder_ / "deep/er.xml"), {"timestep=\"1e-05\""});
  Expect("export-mechanism four-bar.json --to simbody", 0, {"wrote four-bar.cpp"});
  ExpectWords(ReadFile(folder_ / "four-bar.cpp"), {"int main("});
}

TEST_F(ConvertTest, RefusesByNameAndWritesNothing) {
  Write("jack.json", ReadFile(kConfigs / "mechanisms/screw-jack.json"));
  Expect("export-mechanism jack.json --to simbody", 2,
         {"jack.json: found what simbody does not have, so nothing is written:",
          "joint_torque along joint \"bearing\", which depends on time"});
  Expect("export-mechanism jack.json --to mjcf --json", 2,
         {R"("missing":["joint_torque along joint \"bearing\", which depends on time",)"});
  EXPECT_FALSE(fs::exists(folder_ / "jack.cpp"));
  EXPECT_FALSE(fs::exists(folder_ / "jack.xml"));
  Expect("export-mechanism four-bar.json --to urdf", 2, {"urdf", "mjcf"});
  Expect("export-mechanism none.json --to mjcf", 2, {"none.json"});
  Expect("export-mechanism four-bar.json --to mjcf --out ./four-bar.json", 2,
         {"found an input of this command"});
  EXPECT_EQ(ReadFile(folder_ / "four-bar.json"), mechanism_);
  // bars that do not reach each other
  EditMechanism("\"C\": [1.5, 0.0]", "\"C\": [9.0, 0.0]");
  Expect("export-mechanism four-bar.json --to mjcf", 2,
         {"four-bar.json: its initial assembly fails: four-bar: "});
  EXPECT_FALSE(fs::exists(folder_ / "four-bar.xml"));
}

}  // namespace loopbench::harness::export_test
