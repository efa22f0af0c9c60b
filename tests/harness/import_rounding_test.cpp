// Angles and directions with few digits stand for exact ones, and nothing else does.
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_rounding_test {

using import_mjcf_texts::kEps;
using std::numbers::pi;

const ImportOptions kKept = {.keeps_digits = true};

Imported Urdf(const std::string& rpy, const std::string& axis, const ImportOptions& options = {}) {
  return ImportOf(
      "<robot name='r'><link name='world'/><link name='a'><inertial><mass value='1'/><inertia "
      "ixx='1' iyy='1' izz='1'/></inertial></link>\n<joint name='j' type='continuous'><origin "
      "rpy='" +
          rpy + "'/><axis xyz='" + axis +
          "'/><parent link='world'/><child link='a'/></joint></robot>",
      options);
}

double AngleOf(const std::string& word, const ImportOptions& options = {}) {
  return Urdf("0 0 " + word, "0 0 1", options).description.joints[0].from.rotation.z();
}

TEST(ImportRounding, AnglesStandForMultiplesOfFifteenDegrees) {
  const std::vector<std::pair<std::string, double>> words = {
      {"1.5708", pi / 2},      {"1.570796", pi / 2},     {"1.57079", pi / 2},
      {"1.5707963", pi / 2},   {"1.571", pi / 2},        {"1.57", pi / 2},
      {"-1.5708", -pi / 2},    {"+1.5708", pi / 2},      {"15708e-4", pi / 2},
      {"3.14159", pi},         {"3.1416", pi},           {"3.14", pi},
      {"0.785398", pi / 4},    {"0.7854", pi / 4},       {"0.785", pi / 4},
      {"2.35619", 3 * pi / 4}, {"-2.3562", -3 * pi / 4}, {"1.0472", pi / 3},
      {"1.047198", pi / 3},    {"0.5236", pi / 6},       {"0.523598", pi / 6},
      {"2.0944", 2 * pi / 3},  {".52360", pi / 6},       {"0.2618", pi / 12},
      {"1.3090", 5 * pi / 12}};
  for (const auto& [word, angle] : words) {
    // a turn by pi may come out as one by -pi
    const double read = AngleOf(word);
    EXPECT_NEAR(std::abs(read), std::abs(angle), 4 * kEps) << word;
    EXPECT_TRUE(read * angle > 0.0 || std::abs(angle) > 3.0) << word;
    EXPECT_NEAR(std::remainder(AngleOf(word, kKept) - std::stod(word), 2 * pi), 0.0, 4 * kEps);
  }
}

TEST(ImportRounding, OtherAnglesStayWhatTheyAre) {
  for (const char* word :
       {"1.5709", "1.572", "1.58", "1.5700", "1.570797", "1.57079634", "0.79", "0.52", "1.05",
        "1.0", "0.001", "0.0001", "1.2", "0.5", "1.04", "1.570796326790"}) {
    EXPECT_NEAR(AngleOf(word), std::stod(word), 2 * kEps) << word;
  }
}

TEST(ImportRounding, TheNoteCountsThemAndShowsTheFirst) {
  const Imported imported = Urdf("1.5708 0 -1.5708", "0 0.70711 0.70711");
  ExpectNote(imported, "<origin> rpy", "1.5708 is taken as 1.5707963267948966;");
  ExpectNote(imported, "<origin> rpy", "rounded angles or directions: 2 (--keep-digits");
  EXPECT_EQ(std::ranges::count_if(imported.notes,
                                  [](const ImportNote& note) {
                                    return note.reason.find("--keep-digits") != std::string::npos;
                                  }),
            1);
  EXPECT_FALSE(HasNote(Urdf("1.5708 0 0", "0 0 1", kKept), "<origin>", "taken as"));
  // exact values, and other angles, need no note
  EXPECT_FALSE(HasNote(Urdf("1.5707963267948966 0.3 0", "1 1 0"), "", "taken as"));
}

TEST(ImportRounding, DirectionsHaveTheirSquaresInTwelfths) {
  const std::vector<std::pair<std::string, Eigen::Vector3d>> words = {
      {"0.70711 0 0.70711", {std::sqrt(0.5), 0, std::sqrt(0.5)}},
      {"0 0.707 -0.707", {0, std::sqrt(0.5), -std::sqrt(0.5)}},
      {"0.57735 0.57735 0.57735", Eigen::Vector3d::Constant(1 / std::sqrt(3.0))},
      {"0.866 0 -0.5", {std::sqrt(0.75), 0, -0.5}},
      {"0.5 0.5 0.7071", {0.5, 0.5, std::sqrt(0.5)}},
      {"0.8165 -0.40825 0.40825", {std::sqrt(2 / 3.0), -1 / std::sqrt(6.0), 1 / std::sqrt(6.0)}}};
  for (const auto& [word, direction] : words) {
    const Imported imported = Urdf("0 0 0", word);
    EXPECT_LE((imported.description.joints[0].axis - direction).norm(), kEps) << word;
    EXPECT_TRUE(HasNote(imported, "<axis> xyz", "directions: 1 ")) << word;
  }
  for (const std::string word : {"0.6 0.8 0", "0.7 0.714 0", "1 1 0", "0 0 2", "0.70711 0 0.7072",
                                 "0.71 0 0.71", "0.9 0.4359 0"}) {
    const Imported imported = Urdf("0 0 0", word);
    EXPECT_FALSE(HasNote(imported, "<axis>", "rounded")) << word;
    EXPECT_EQ(imported.description.joints[0].axis,
              Urdf("0 0 0", word, kKept).description.joints[0].axis);
  }
}

Eigen::Matrix3d TurnOf(const std::string& quaternion, const ImportOptions& options = {}) {
  const std::string text =
      import_mjcf_texts::Model("<joint/>", "", "", "quat='" + quaternion + "'");
  return PoseOf(ImportOf(text, options).description.joints[0].from).R;
}

std::string Digits(const Eigen::Quaterniond& q, const char* format) {
  char text[200];
  std::snprintf(text, sizeof text, format, q.w(), q.x(), q.y(), q.z());
  return text;
}

TEST(ImportRounding, QuaternionsOfSuchTurnsAreExact) {
  std::set<double> angles;
  for (int i = -4; i < 5; ++i) angles.insert(i * pi / 4);
  for (int i = -6; i < 7; ++i) angles.insert(i * pi / 6);
  for (const double x : angles) {
    for (const double y : {-pi / 2, -pi / 6, 0.0, pi / 4, pi / 3, pi / 2}) {
      for (const double z : {0.0, pi / 6, pi / 4, pi / 2, -2 * pi / 3, pi}) {
        const Eigen::Quaterniond q = Eigen::AngleAxisd(z, Eigen::Vector3d::UnitZ()) *
                                     Eigen::AngleAxisd(y, Eigen::Vector3d::UnitY()) *
                                     Eigen::AngleAxisd(x, Eigen::Vector3d::UnitX());
        for (const char* format : {"%.4f %.4f %.4f %.4f", "%.6g %.6g %.6g %.6g"}) {
          // tiny numbers of round-off are printed as such by %g
          const Eigen::Quaterniond clean(
              q.coeffs().unaryExpr([](double c) { return std::abs(c) < 1e-15 ? 0.0 : c; }).eval());
          const std::string text = Digits(clean, format);
          // a rotation vector and back: some units of rounding of a matrix of order one
          EXPECT_LE((TurnOf(text) - q.toRotationMatrix()).norm(), 32 * kEps) << text;
        }
      }
    }
  }
}

TEST(ImportRounding, ProductsOfRoundedTurnsAreExact) {
  // as programs print them that have multiplied turns by 1.5708 and 3.1416 out
  const Eigen::Matrix3d quarter(Eigen::AngleAxisd(pi / 2, Eigen::Vector3d::UnitX()));
  for (const std::string text : {"0.707105 0.707108 0 0", "-0.7071054825 -0.7071080799 0 0"}) {
    EXPECT_LE((TurnOf(text) - quarter).norm(), 4 * kEps) << text;
  }
  EXPECT_EQ(TurnOf("1 -3.67321e-06 0 0"), Eigen::Matrix3d::Identity());
  EXPECT_EQ(Urdf("0 0 0", "7.34641e-06 1 -3.67321e-06").description.joints[0].axis,
            Eigen::Vector3d::UnitY());
  EXPECT_NE(TurnOf("1 -3.67321e-05 0 0"), Eigen::Matrix3d::Identity());
}

TEST(ImportRounding, OtherQuaternionsStayWhatTheyAre) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Quaterniond q =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
            .normalized();
    const std::string text = Digits(q, "%.4f %.4f %.4f %.4f");
    EXPECT_EQ(TurnOf(text), TurnOf(text, kKept)) << text;
  }
  EXPECT_EQ(TurnOf("0.7071 0.70720 0 0"), TurnOf("0.7071 0.70720 0 0", kKept));
}

TEST(ImportRounding, AllFormsOfOrientationsAreLookedAt) {
  const std::string radian = "<compiler angle='radian'/>";
  const Eigen::Matrix3d half(Eigen::AngleAxisd(pi / 4, Eigen::Vector3d::UnitX()));
  const auto mjcf = [&](const std::string& form) {
    const Imported imported =
        import_mjcf_texts::Read("<joint axis='0 0.86603 0.5'/>", radian, "", form);
    EXPECT_TRUE(HasNote(imported, "<body", "directions: 2 ")) << form;
    return PoseOf(imported.description.joints[0].from).R;
  };
  EXPECT_LE((mjcf("euler='0.7854 0 0'") - half).norm(), 4 * kEps);
  EXPECT_LE((mjcf("axisangle='1 0 0 0.7854'") - half).norm(), 4 * kEps);
  EXPECT_LE((mjcf("xyaxes='1 0 0 0 0.707 0.707'") - half).norm(), 4 * kEps);
  EXPECT_LE((mjcf("zaxis='0 -0.707 0.707'") - half).norm(), 4 * kEps);
  const auto sdf = [&](const std::string& pose) {
    return ImportOf("<sdf version='1.9'><model name='m'><link name='a'>" + pose +
                    "</link><joint name='j' "
                    "type='revolute'><parent>world</parent><child>a</child><axis><xyz>0 "
                    "0.86603 0.5</xyz></axis></joint></model></sdf>");
  };
  for (const std::string pose :
       {"<pose>0 0 0 0.7854 0 0</pose>",
        "<pose rotation_format='quat_xyzw'>0 0 0 0.38268 0 0 0.92388</pose>"}) {
    const Imported imported = sdf(pose);
    EXPECT_LE((PoseOf(imported.description.joints[0].from).R - half).norm(), 4 * kEps);
    ExpectNote(imported, "<pose", "directions: 2 ");
    EXPECT_EQ(imported.description.joints[0].axis.y(), std::sqrt(0.75));
  }
  // degrees are as they are, and so are places
  EXPECT_FALSE(
      HasNote(sdf("<pose degrees='true'>1.5708 0.7854 0 1.5708 0 0</pose>"), "<pose", "taken as"));
}

TEST(ImportRounding, AxesThatARoundedTurnMadeLeanAreParallel) {
  const Imported imported = ImportOf(
      "<robot name='r'><link name='world'/><link name='a'/><link name='b'><inertial><mass "
      "value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link><joint name='A' "
      "type='fixed'><parent link='world'/><child link='a'/><origin rpy='1.5708 0 "
      "0'/></joint><joint name='B' type='continuous'><parent link='a'/><child link='b'/><axis "
      "xyz='0 0 1'/></joint></robot>");
  const JointDescription& joint = imported.description.joints[0];
  const Eigen::Vector3d axis =
      PoseOf(joint.from).R * AxisAlignment(joint) * Eigen::Vector3d::UnitZ();
  EXPECT_LE((axis + Eigen::Vector3d::UnitY()).norm(), 2 * kEps);
}

}  // namespace loopbench::harness::import_rounding_test
