// Joints in series through links without mass: the joint that they form, its frames and its start.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "harness/base/text.h"
#include "mechanism/model/kinematics.h"
#include "tests/harness/import_texts.h"

namespace loopbench::harness {
namespace import_chain_test {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

constexpr double kEps = 1e-15;  // some units of rounding for lengths and angles of order one

const std::string kRodMass =
    "<inertial><mass value=\"2\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial>";

/// A joint of URDF: type, origin, axis, and other contents.
struct Step {
  std::string name, type, xyz, axis, inside = "";
};

/// A robot whose joints lead in series from the world through links without mass to "rod".
std::string Series(const std::vector<Step>& steps, const std::string& last = kRodMass) {
  std::string text = "<robot name=\"r\"><link name=\"world\"/>\n";
  std::string from = "world";
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    const bool is_last = i + 1 == steps.size();
    const std::string to = is_last ? "rod" : "cross_" + std::to_string(i + 1);
    text += "<link name=\"" + to + "\">" + (is_last ? last : "") + "</link>\n<joint name=\"" +
            step.name + "\" type=\"" + step.type + "\"><parent link=\"" + from +
            "\"/><child link=\"" + to + "\"/><origin xyz=\"" + step.xyz + "\"/><axis xyz=\"" +
            step.axis + "\"/>" + step.inside + "</joint>\n";
    from = to;
  }
  return text + "</robot>";
}

/// A body of MuJoCo at a place, with several joints.
Imported Mujoco(const std::string& pos, const std::string& joints) {
  return ImportText("<mujoco><worldbody><body name=\"rod\" pos=\"" + pos +
                        "\"><inertial pos=\"0 0 0\" mass=\"2\" diaginertia=\"1 1 1\"/>" + joints +
                        "</body></worldbody></mujoco>",
                    "file.xml");
}

/// Imports with a sidecar of this text.
Imported WithSidecar(const std::string& text, const std::string& json) {
  ImportOptions options;
  options.sidecar = std::filesystem::path(testing::TempDir()) / "loopbench-chain.json";
  WriteFileAtomically(options.sidecar, json);
  return ImportText(text, "file.xml", options);
}

std::string MessageOf(const std::string& text, const std::string& json) {
  try {
    WithSidecar(text, json);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

const Step kX = {"rx", "continuous", "0 0 2", "1 0 0"}, kY = {"ry", "continuous", "0 0 0", "0 1 0"},
           kZ = {"rz", "continuous", "0 0 -0.25", "0 0 1"};

TEST(ImportChain, SeriesFormTheJointOfAnEqualBodyOfMujoco) {
  const Step slide_x = {"x", "prismatic", "0 0 2", "1 0 0"},
             slide_y = {"y", "prismatic", "0 0 0", "0 1 0"},
             slide_z = {"z", "prismatic", "0 0 0", "0 0 1"};
  struct Case {
    std::vector<Step> steps;
    std::string type, pos, joints;
  };
  const Case cases[] = {
      {{kX, kY, kZ},
       "spherical",
       "0 0 1.75",
       "<joint axis=\"1 0 0\" pos=\"0 0 0.25\"/><joint axis=\"0 1 0\" pos=\"0 0 0.25\"/>"
       "<joint axis=\"0 0 1\"/>"},
      {{kX, kY}, "universal", "0 0 2", "<joint axis=\"1 0 0\"/><joint axis=\"0 1 0\"/>"},
      {{slide_x, kX},
       "cylindrical",
       "0 0 4",
       "<joint type=\"slide\" axis=\"1 0 0\"/><joint axis=\"1 0 0\"/>"},
      {{kX, slide_y},
       "pin-in-slot",
       "0 0 2",
       "<joint axis=\"1 0 0\"/><joint type=\"slide\" axis=\"0 1 0\"/>"},
      {{slide_x, slide_y, kZ},
       "planar",
       "0 0 1.75",
       "<joint type=\"slide\" axis=\"1 0 0\"/><joint type=\"slide\" axis=\"0 1 0\"/><joint "
       "axis=\"0 0 1\"/>"},
      {{slide_z, slide_x, slide_y},
       "translation",
       "0 0 2",
       "<joint type=\"slide\" axis=\"0 0 1\"/><joint type=\"slide\" axis=\"1 0 0\"/><joint "
       "type=\"slide\" axis=\"0 1 0\"/>"},
      {{slide_x, kY, slide_z, slide_y},
       "schoenflies",
       "0 0 2",
       "<joint type=\"slide\" axis=\"1 0 0\"/><joint axis=\"0 1 0\"/><joint type=\"slide\" "
       "axis=\"0 0 1\"/><joint type=\"slide\" axis=\"0 1 0\"/>"},
      {{slide_z, kX, kY, kZ},
       "point-on-line",
       "0 0 1.75",
       "<joint type=\"slide\" axis=\"0 0 1\"/><joint axis=\"1 0 0\" pos=\"0 0 0.25\"/><joint "
       "axis=\"0 1 0\" pos=\"0 0 0.25\"/><joint axis=\"0 0 1\"/>"},
      {{kX, kY, kZ, slide_y},
       "point-on-line",
       "0 0 1.75",
       "<joint axis=\"1 0 0\" pos=\"0 0 0.25\"/><joint axis=\"0 1 0\" pos=\"0 0 0.25\"/><joint "
       "axis=\"0 0 1\"/><joint type=\"slide\" axis=\"0 1 0\"/>"},
      {{slide_y, slide_z, kX, kY, kZ},
       "point-in-plane",
       "0 0 1.75",
       "<joint type=\"slide\" axis=\"0 1 0\"/><joint type=\"slide\" axis=\"0 0 1\"/><joint "
       "axis=\"1 0 0\" pos=\"0 0 0.25\"/><joint axis=\"0 1 0\" pos=\"0 0 0.25\"/><joint "
       "axis=\"0 0 1\"/>"},
      {{kX, kY, kZ, slide_z, slide_y},
       "point-in-plane",
       "0 0 1.75",
       "<joint axis=\"1 0 0\" pos=\"0 0 0.25\"/><joint axis=\"0 1 0\" pos=\"0 0 0.25\"/><joint "
       "axis=\"0 0 1\"/><joint type=\"slide\" axis=\"0 0 1\"/><joint type=\"slide\" axis=\"0 1 "
       "0\"/>"},
      {{slide_x, slide_y, slide_z, kY, {"rx", "continuous", "0 0 0", "1 0 0"}, kZ},
       "free",
       "0 0 1.75",
       "<joint type=\"slide\" axis=\"1 0 0\"/><joint type=\"slide\" axis=\"0 1 0\"/><joint "
       "type=\"slide\" axis=\"0 0 1\"/><joint axis=\"0 1 0\" pos=\"0 0 0.25\"/><joint "
       "axis=\"1 0 0\" pos=\"0 0 0.25\"/><joint axis=\"0 0 1\"/>"}};
  for (const Case& one : cases) {
    const Imported chain = ImportText(Series(one.steps), "file.xml"),
                   body = Mujoco(one.pos, one.joints);
    ASSERT_EQ(chain.description.bodies.size(), 2u);
    ASSERT_EQ(chain.description.joints.size(), 1u);
    const JointDescription &is = chain.description.joints[0], &of = body.description.joints[0];
    EXPECT_EQ(ToString(is.type), one.type);
    EXPECT_EQ(is.type, of.type);
    for (const auto& side : {&JointDescription::from, &JointDescription::to}) {
      EXPECT_EQ((is.*side).body, (of.*side).body) << one.type;
      EXPECT_LE(((is.*side).position - (of.*side).position).norm(), kEps) << one.type;
      EXPECT_LE(((is.*side).rotation - (of.*side).rotation).norm(), kEps) << one.type;
    }
    EXPECT_EQ(is.axis, of.axis);
    ExpectNote(chain, "<link name=\"rod\">", "joints are one here: " + one.type);
  }
  // the point where the axes meet, by hand
  const Imported ball = ImportText(Series({kX, kY, kZ}), "file.xml");
  const JointDescription& joint = ball.description.joints[0];
  EXPECT_EQ(joint.name, "rx+ry+rz");
  EXPECT_LE((joint.from.position - Vector3d(0, 0, 2)).norm(), kEps);
  EXPECT_LE((joint.to.position - Vector3d(0, 0, 0.25)).norm(), kEps);
}

TEST(ImportChain, TheStartIsThatOfTheJointsInSeries) {
  const std::string ball = Series({kX, kY, kZ});
  const InitialDescription start =
      WithSidecar(ball, R"({"initial": {"coordinates": {"rx": 0.3, "ry": 0.4, "rz": 0.5},
                             "speeds": {"rx": 1, "ry": 2, "rz": 3}, "fixed": ["rx", "ry", "rz"]}})")
          .description.initial;
  const Eigen::Quaterniond x(AngleAxisd(0.3, Vector3d::UnitX())),
      y(AngleAxisd(0.4, Vector3d::UnitY())), z(AngleAxisd(0.5, Vector3d::UnitZ())), q = x * y * z;
  ASSERT_EQ(start.coordinates.size(), 1u);
  const std::vector<double>& given = start.coordinates[0].values;
  EXPECT_LE((Eigen::Vector4d(given.data()) - Eigen::Vector4d(q.w(), q.x(), q.y(), q.z())).norm(),
            kEps);
  ASSERT_EQ(start.speeds.size(), 1u);
  const Vector3d w =
      1.0 * Vector3d::UnitX() + 2.0 * (x * Vector3d::UnitY()) + 3.0 * (x * y * Vector3d::UnitZ());
  EXPECT_LE((Vector3d(start.speeds[0].values.data()) - w).norm(), 10 * kEps);
  EXPECT_EQ(start.held, std::vector<int>{0});
  // coordinates are guesses, 0 where none is given
  const auto part = WithSidecar(ball, R"({"initial": {"coordinates": {"ry": 0.4}}})");
  EXPECT_NEAR(part.description.initial.coordinates[0].values[2], std::sin(0.2), kEps);
  EXPECT_TRUE(part.description.initial.speeds.empty());
  // values of some joints alone: the others form a joint
  for (const char* some : {R"("speeds": {"rz": 1})", R"("fixed": ["rz"])"}) {
    const auto split =
        WithSidecar(ball, R"({"initial": {"coordinates": {"rz": 0.4}, )" + std::string(some) + "}}")
            .description;
    ASSERT_EQ(split.joints.size(), 2u);
    EXPECT_EQ(ToString(split.joints[0].type), "universal");
    EXPECT_EQ(split.joints[1].name, "rz");
    EXPECT_EQ(split.initial.speeds.size() + split.initial.held.size(), 1u);
    EXPECT_EQ(split.initial.coordinates[0].values, std::vector<double>{0.4});
  }
  const auto planar = WithSidecar(Series({{"x", "prismatic", "0 0 0", "1 0 0"},
                                          {"y", "prismatic", "0 0 0", "0 1 0"},
                                          {"yaw", "continuous", "0 0 0", "0 0 1"}}),
                                  R"({"initial": {"coordinates": {"x": 1, "y": 2, "yaw": 0.5}}})");
  const std::vector<double>& p = planar.description.initial.coordinates[0].values;
  EXPECT_NEAR(p[0], 0.5, kEps);
  EXPECT_NEAR(p[1], 1.0, kEps);
  EXPECT_NEAR(p[2], 2.0, kEps);
}

/// A joint of a series, by MuJoCo's types.
struct Part {
  std::string type, axis, pos;

  std::string Text() const {
    return "<joint type=\"" + type + "\" axis=\"" + axis + "\" pos=\"" + pos + "\"/>";
  }
  /// Its motion at a coordinate, of a ball a quaternion.
  Eigen::Isometry3d At(const double* q) const {
    const Vector3d a = VectorOf(axis).normalized(), p = VectorOf(pos);
    if (type == "slide") return Eigen::Isometry3d(Eigen::Translation3d(q[0] * a));
    const Eigen::Quaterniond turn = type == "ball" ? Eigen::Quaterniond(q[0], q[1], q[2], q[3])
                                                   : Eigen::Quaterniond(AngleAxisd(q[0], a));
    return Eigen::Translation3d(p) * turn.normalized() * Eigen::Translation3d(-p);
  }

 private:
  static Vector3d VectorOf(const std::string& text) {
    std::istringstream in(text);
    Vector3d v;
    in >> v.x() >> v.y() >> v.z();
    return v;
  }
};

/// Initial coordinates and speeds of all joints, without prescribed ones.
std::pair<std::vector<double>, std::vector<double>> StartOf(const MechanismDescription& d) {
  std::pair<std::vector<double>, std::vector<double>> start;
  for (int j = 0; j < std::ssize(d.joints); ++j) {
    for (const auto& [list, all] :
         {std::pair{&d.initial.coordinates, &start.first}, {&d.initial.speeds, &start.second}}) {
      const auto own = std::ranges::find(*list, j, &JointValues::joint);
      if (own == list->end()) throw std::out_of_range("a joint without a start");
      std::vector<double> values = own->values;
      for (const auto& motion : d.joints[j].motions)
        values.erase(values.begin() + motion.coordinate);
      all->insert(all->end(), values.begin(), values.end());
    }
  }
  return start;
}

/// A body with these joints and its start: pose and velocities against their motions by hand.
/// `type`: of the one joint that they form; "": they form several.
void ExpectMotionsOfParts(const std::vector<Part>& parts, const std::string& type, bool reversed) {
  std::vector<double> q, u;
  std::string text;
  for (const Part& part : parts) {
    text += part.Text();
    const double k = 1.0 + static_cast<double>(q.size());
    if (part.type == "ball") {
      for (const double number : {0.8, 0.2, -0.4, 0.4}) q.push_back(number);
      for (const double number : {0.5, -0.3, 0.7}) u.push_back(number);
    } else {
      q.push_back(std::sin(k));
      u.push_back(std::cos(2.0 * k));
    }
  }
  const std::string start =
      fmt::format("qpos=\"{}\" qvel=\"{}\"", fmt::join(q, " "), fmt::join(u, " "));
  const std::string model =
      "<mujoco><compiler angle=\"radian\"/><worldbody><body name=\"rod\" pos=\"0.1 0.2 0.3\">"
      "<inertial pos=\"0 0 0\" mass=\"2\" diaginertia=\"1 1 1\"/>" +
      text + "</body></worldbody><keyframe><key " + start + "/></keyframe></mujoco>";
  const MechanismDescription description = ImportText(model, "file.xml").description;
  SCOPED_TRACE(text);
  if (type.empty()) {
    EXPECT_GT(description.joints.size(), 1u);
  } else {
    ASSERT_EQ(description.joints.size(), 1u);
    EXPECT_EQ(ToString(description.joints[0].type), type);
    EXPECT_EQ(description.joints[0].from.body != kGround, reversed);
  }
  const Mechanism<Spatial, double> mechanism(description, Coordinates::kJoint);
  Kinematics<Spatial, double> kinematics(mechanism);
  const auto [given, rates] = StartOf(description);
  ASSERT_EQ(std::ssize(given), mechanism.num_q());
  kinematics.UpdatePosition(Eigen::Map<const VectorX<double>>(given.data(), mechanism.num_q()));
  kinematics.UpdateVelocity(Eigen::Map<const VectorX<double>>(rates.data(), mechanism.num_u()));

  // balls turn with speeds in axes of the moved body
  const auto place = [&](double t) {
    Eigen::Isometry3d X(Eigen::Translation3d(0.1, 0.2, 0.3));
    const double *position = q.data(), *speed = u.data();
    for (const Part& part : parts) {
      if (part.type == "ball") {
        const Vector3d turn = t * Vector3d(speed);
        const Eigen::Quaterniond moved =
            Eigen::Quaterniond(position[0], position[1], position[2], position[3]).normalized() *
            Eigen::Quaterniond(AngleAxisd(turn.norm(), turn.stableNormalized()));
        const double now[] = {moved.w(), moved.x(), moved.y(), moved.z()};
        X = X * part.At(now);
        position += 4, speed += 3;
      } else {
        const double now = *position++ + t * *speed++;
        X = X * part.At(&now);
      }
    }
    return X;
  };
  const Eigen::Isometry3d X = place(0.0);
  const Vector3d com = description.bodies[1].com;  // not 0 if a link took mass from the body
  EXPECT_LE((kinematics.poses()[1].p.eigen() - X * com).norm(), 10 * kEps);
  EXPECT_LE((kinematics.poses()[1].R.eigen() - X.linear()).norm(), 10 * kEps);
  constexpr double kStep = 1e-5;  // central: truncation 1e-10, round-off eps / step = 2e-11
  const Eigen::Isometry3d ahead = place(kStep), behind = place(-kStep);
  const Eigen::Matrix3d W =
      (ahead.linear() - behind.linear()) * X.linear().transpose() / (2.0 * kStep);
  const Vector3d v = (ahead * com - behind * com) / (2.0 * kStep);
  const Velocity<Spatial, double>& V = kinematics.motions()[1];
  EXPECT_LE((V.linear.eigen() - v).norm(), 1e-9);
  EXPECT_LE((V.angular.eigen() - Vector3d(W(2, 1), W(0, 2), W(1, 0))).norm(), 1e-9);
}

TEST(ImportChain, StartsHaveThePosesAndSpeedsOfTheirParts) {
  const std::string o = "0 0 0", p = "0.2 -0.1 0.3";
  const Part x{"slide", "1 0 0", o}, y{"slide", "0 1 0", o}, z{"slide", "0 0 1", o},
      skew{"slide", "1 2 -2", o}, turn{"hinge", "0 0 1", p}, tilted{"hinge", "2 -1 2", p},
      ball{"ball", "0 0 1", p};
  const std::vector<Part> hinges = {{"hinge", "1 0 0", p}, {"hinge", "0 1 0", p}, turn};
  ExpectMotionsOfParts({x, y, z}, "translation", false);
  ExpectMotionsOfParts({skew, z, x}, "translation", false);
  for (const Part& hinge : {turn, tilted}) {
    ExpectMotionsOfParts({x, y, z, hinge}, "schoenflies", false);
    ExpectMotionsOfParts({hinge, z, skew, y}, "schoenflies", false);
    ExpectMotionsOfParts({x, hinge, z, y}, "schoenflies", false);
  }
  for (const Part& slide : {x, z, skew}) {
    ExpectMotionsOfParts({slide, ball}, "point-on-line", false);
    ExpectMotionsOfParts({ball, slide}, "point-on-line", true);
    ExpectMotionsOfParts({slide, hinges[0], hinges[1], turn}, "point-on-line", false);
    ExpectMotionsOfParts({hinges[0], hinges[1], turn, slide}, "point-on-line", true);
    ExpectMotionsOfParts({slide, y, ball}, "point-in-plane", false);
    ExpectMotionsOfParts({ball, y, slide}, "point-in-plane", true);
    ExpectMotionsOfParts({y, slide, hinges[0], hinges[1], turn}, "point-in-plane", false);
    ExpectMotionsOfParts({hinges[0], hinges[1], turn, slide, y}, "point-in-plane", true);
  }
  // none of the joint types: several joints, with links between
  const Part other{"hinge", "1 0 0", "0.1 0.2 0"};
  for (const std::vector<Part>& mixed :
       std::vector<std::vector<Part>>{{x, ball, y},
                                      {hinges[0], x, hinges[1], turn},
                                      {x, ball, z},
                                      {ball, other},
                                      {x, y, z, turn, other},
                                      {x, y, z, tilted, hinges[0]},
                                      {x, turn, other, ball},
                                      {turn, other, hinges[1], tilted, hinges[0]}}) {
    ExpectMotionsOfParts(mixed, "", false);
  }
}

/// The cross of a universal joint as the child of both joints: the second one leads back.
TEST(ImportChain, JointsThatLeadBackTurnTheOtherWay) {
  const auto link = [](const char* name, const char* mass) {
    return "<link name=\"" + std::string(name) + "\"><inertial><mass>" + mass +
           "</mass><inertia><ixx>" + mass + "</ixx><iyy>" + mass + "</iyy><izz>" + mass +
           "</izz></inertia></inertial></link>";
  };
  const auto joint = [](const char* name, const char* parent, const char* axis, const char* start) {
    return "<joint name=\"" + std::string(name) + "\" type=\"revolute\"><parent>" + parent +
           "</parent><child>cross</child><axis><xyz>" + axis + "</xyz><initial_position>" + start +
           "</initial_position></axis></joint>";
  };
  const Imported imported =
      ImportText("<sdf version=\"1.9\"><model name=\"m\">" + link("cross", "0") + link("rod", "1") +
                     joint("a", "world", "1 0 0", "0.5") + joint("b", "rod", "0 1 0", "0.25") +
                     "</model></sdf>",
                 "file.sdf");
  ASSERT_EQ(imported.description.joints.size(), 1u);
  EXPECT_EQ(imported.description.joints[0].type, JointType::kUniversal);
  EXPECT_EQ(imported.description.bodies[1].name, "rod");
  // the cross turns by 0.25 about y of the rod, hence the rod by -0.25 about y of the cross
  const std::vector<double>& angles = imported.description.initial.coordinates[0].values;
  const Eigen::Matrix3d F = PoseOf(imported.description.joints[0].from).R;
  EXPECT_NEAR(angles[0] * F(0, 0), 0.5, kEps);
  EXPECT_NEAR(angles[1] * F(1, 1), -0.25, kEps);
}

TEST(ImportChain, JointsWithForcesAreNotComposed) {
  Step damped = kY;
  damped.inside = "<dynamics damping=\"0.5\"/>";
  MechanismDescription d = ImportText(Series({kX, damped, kZ}), "file.xml").description;
  ASSERT_EQ(d.forces.size(), 1u);
  ASSERT_EQ(d.joints.size(), 3u);
  EXPECT_EQ(d.joints[*PartsOf(d.forces[0]).joint].name, "ry");
  const MechanismDescription last =
      ImportText(
          Series(
              {kX, kY, kZ, {"r", "continuous", "0 0 1", "0 1 0", "<dynamics damping=\"0.5\"/>"}}),
          "file.xml")
          .description;
  ASSERT_EQ(last.joints.size(), 2u);
  EXPECT_EQ(last.joints[0].name + " " + last.joints[1].name, "rx+ry+rz r");
}

TEST(ImportChain, OtherLinksWithoutMassAreRejected) {
  const std::string found = "found a body without mass that moves";
  // at the end of a chain, and after a floating joint
  ExpectRefusal(Series({kX, kY}, ""), {"<link name=\"cross_1\">: " + found});
  ExpectRefusal(Series({kX}, ""), {"<link name=\"rod\">: " + found});
  ExpectRefusal(Series({{"f", "floating", "0 0 0", "1 0 0"}, kX}), {"<link name=\"cross_1\">"});
  // joints that repeat motions of each other: one axis twice, four hinges that meet
  const Step again = {"again", "continuous", "0 0 0", "1 0 0"};
  ExpectRefusal(Series({kX, again}), {"file.xml:2: <link name=\"cross_1\">: " + found,
                                      "between 2 joints (revolute, ...) that repeat"});
  const Step fourth = {"again", "continuous", "0 0 0.25", "1 1 0"};
  ExpectRefusal(Series({kX, kY, kZ, fourth}), {"<link name=\"cross_1\">: " + found});
  // a link that a force or a third joint needs
  for (
      const char* use :
      {R"("loops": [{"name": "l", "type": "spherical", "from": "cross_1", "to": "ground", "at": [0, 0, 0]}])",
       R"("forces": [{"type": "point_force", "body": "cross_1", "force": [1, 0, 0]}])"}) {
    const std::string message = MessageOf(Series({kX, kY}), "{" + std::string(use) + "}");
    EXPECT_NE(message.find("<link name=\"cross_1\">: " + found), std::string::npos) << message;
  }
}

/// A hinge or slide.
struct Joint {
  Eigen::Vector3d at, axis;
  bool slides = false;
};

/// A body of MuJoCo and its joints, for an independent kinetic energy.
struct Hinged {
  double mass;
  Eigen::Vector3d com, moments;  ///< in body axes
  Eigen::Vector3d place;         ///< of the body in its parent, drawn
  std::vector<Joint> joints;
};

/// Kinetic energy, and height of the centre of mass times mass, of a chain of bodies.
std::pair<double, double> EnergyOf(const std::vector<Hinged>& chain, const VectorX<double>& q,
                                   const VectorX<double>& u) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), w = p, v = p;  // of the body's origin
  double kinetic = 0.0, moment = 0.0;
  int k = 0;
  for (const Hinged& body : chain) {
    v += w.cross(R * body.place);
    p += R * body.place;
    for (const auto& [at, axis, slides] : body.joints) {
      if (slides) {
        const Eigen::Vector3d way = R * axis * q[k];
        v += w.cross(way) + R * axis * u[k++];
        p += way;
        continue;
      }
      const Eigen::Vector3d arm = R * at;
      const Eigen::Matrix3d turn = Eigen::AngleAxisd(q[k], axis).toRotationMatrix();
      const Eigen::Vector3d spin = R * axis * u[k++];
      v += w.cross(arm);  // of the hinge
      w += spin;
      R = R * turn;
      p += arm - R * at;
      v -= w.cross(R * at);
    }
    const Eigen::Vector3d c = R * body.com, vc = v + w.cross(c), W = R.transpose() * w;
    kinetic += 0.5 * (body.mass * vc.squaredNorm() + W.dot(body.moments.cwiseProduct(W)));
    moment += body.mass * (p + c).z();
  }
  return {kinetic, moment};
}

/// `more`: attributes of all joints.
std::string MujocoText(const std::vector<Hinged>& chain, const std::string& more = "") {
  std::string text, end;
  const auto numbers = [](const Eigen::Vector3d& v) {
    std::ostringstream out;
    out << '"' << v.transpose() << '"';
    return out.str();
  };
  for (const Hinged& body : chain) {
    text += "<body pos=" + numbers(body.place) + "><inertial pos=" + numbers(body.com) +
            " mass=\"" + std::to_string(body.mass) + "\" diaginertia=" + numbers(body.moments) +
            "/>";
    for (const auto& [at, axis, slides] : body.joints) {
      text += "<joint type=\"" + std::string(slides ? "slide" : "hinge") + "\" pos=" + numbers(at) +
              " axis=" + numbers(axis) + more + "/>";
    }
    end += "</body>";
  }
  return "<mujoco><worldbody>" + text + end + "</worldbody></mujoco>";
}

/// Compares the energies of an imported chain with the bodies' energies in MuJoCo, at several
/// starts. As functions of coordinates and speeds they determine the motion. `more`: attributes of
/// all joints; `is_exact`: no mass is added; by default the notes decide.
void ExpectEnergies(const std::vector<Hinged>& chain, const std::string& more,
                    std::optional<bool> is_exact = {}) {
  const std::string text = MujocoText(chain, more);
  SCOPED_TRACE(text);
  int n = 0;
  for (const Hinged& body : chain) n += static_cast<int>(body.joints.size());
  double offset = 0.0;  // of the potential energy
  for (int trial = 0; trial < 5; ++trial) {
    VectorX<double> q(n), u(n);
    for (int i = 0; i < n; ++i) {
      q[i] = std::sin(1.7 * trial + i);
      u[i] = 3.0 * std::cos(2.3 * trial - i);
    }
    std::string start = text;
    start.insert(start.find("<worldbody>"),
                 fmt::format("<compiler angle=\"radian\"/><keyframe><key qpos=\"{}\" qvel=\"{}\"/>"
                             "</keyframe>",
                             fmt::join(q, " "), fmt::join(u, " ")));
    const Imported imported = ImportText(start, "file.xml");
    const bool changes = std::ranges::count(imported.notes, true, &ImportNote::changes_motion) > 0;
    EXPECT_EQ(changes, !is_exact.value_or(!changes));
    const Mechanism<Spatial, double> mechanism(imported.description, Coordinates::kJoint);
    Kinematics<Spatial, double> kinematics(mechanism);
    ASSERT_EQ(mechanism.num_u(), n);
    const auto [coordinates, speeds] = StartOf(imported.description);
    ASSERT_EQ(std::ssize(coordinates), mechanism.num_q());
    kinematics.UpdatePosition(
        Eigen::Map<const VectorX<double>>(coordinates.data(), mechanism.num_q()));
    kinematics.UpdateVelocity(Eigen::Map<const VectorX<double>>(speeds.data(), n));
    const auto [kinetic, moment] = EnergyOf(chain, q, u);
    const Energy<double> energy = ComputeEnergy(kinematics);
    // sums of about a hundred products, where mass moved from a body cancels; added: a millionth of
    // the body's mass in each link, within ten of its radii of gyration
    const double rounding = changes ? 1e-4 : 1e-13;
    EXPECT_NEAR(energy.kinetic, kinetic, rounding * kinetic);
    if (trial == 0) offset = energy.potential - 9.81 * moment;
    EXPECT_NEAR(energy.potential, offset + 9.81 * moment,
                rounding * (10.0 + 9.81 * std::abs(moment)));
  }
}

TEST(ImportChain, HingesThatMissEachOtherKeepTheirMotion) {
  using Eigen::Vector3d;
  const Hinged shin = {
      3.0, {0.01, 0.02, -0.2}, {0.04, 0.05, 0.02}, {0, 0, 1}, {{{0, 0, 0}, {0, 1, 0}}}};
  const auto foot = [](const Vector3d& axis, double miss, const Vector3d& place) {
    return Hinged{1.0,
                  {0.05, 0.01, 0},
                  {0.001, 0.003, 0.0035},
                  place,
                  {{{0, 0, 0.08}, {0, 1, 0}}, {{0, 0, 0.08 - miss}, axis}}};
  };
  const Vector3d below(0, 0, -0.4), skew = Vector3d(0.6, 0.8, 0.0);
  const std::vector<std::vector<Hinged>> chains = {
      {foot({1, 0, 0}, 0.04, {0, 0, 0})},     // on the ground
      {shin, foot({1, 0, 0}, 0.04, below)},   // the feet of a humanoid
      {shin, foot(skew, 0.04, below)},        // not perpendicular either
      {shin, foot(skew, 0.0, below)},         // they meet
      {shin, foot({0, 1, 0}, 0.04, below)}};  // parallel
  for (const std::vector<Hinged>& chain : chains) ExpectEnergies(chain, "", true);
}

TEST(ImportChain, AnyJointsOfABodyKeepTheirMotion) {
  const Eigen::Vector3d o(0, 0, 0.1), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1), skew(0.6, 0.8, 0.0);
  const auto slide = [&](const Eigen::Vector3d& axis) { return Joint{o, axis, true}; };
  const auto hinge = [&](const Eigen::Vector3d& axis, const Eigen::Vector3d& at) {
    return Joint{at, axis, false};
  };
  const Hinged cart = {3.0, {0.01, 0.02, -0.2}, {0.04, 0.05, 0.03}, o, {slide(x), hinge(y, o)}};
  struct Case {
    std::vector<Joint> joints;
    bool is_exact, is_exact_damped;  ///< no mass is added; damped joints are single ones
  };
  const Case cases[] = {
      {{slide(x), hinge(y, o)}, true, true},
      {{hinge(z, o), slide(x)}, true, true},
      {{hinge(x, o), hinge(y, o)}, true, true},
      {{slide(x), slide(y)}, true, false},
      {{hinge(x, o), hinge(y, o), hinge(z, o)}, true, false},
      {{slide(x), slide(y), slide(z), hinge(z, o), hinge(x, o)}, true, false},
      {{slide(x), slide(y), slide(z), hinge(z, o), hinge(x, o + x)}, true, false},
      {{slide(x), hinge(y, o), hinge(x, o + z)}, true, false},  // a pin in a slot and a hinge
      {{slide(x), hinge(z, o), hinge(x, o + y)}, true, false},  // the hinge along the slot
      {{slide(z), hinge(z, o), hinge(x, o + y)}, true, false},  // a cylindrical joint and a hinge
      {{slide(x), hinge(y, o), slide(skew), hinge(x, o)}, false, false},
      {{hinge(z, o), hinge(y, o + x), hinge(y, o + z), hinge(x, o), hinge(skew, o), hinge(y, o)},
       false,
       false}};
  for (const Case& one : cases) {
    for (const bool moves : {false, true}) {
      std::vector<Hinged> chain = {
          {1.0, {0.05, 0.01, 0.1}, {0.01, 0.03, 0.025}, {0, 0, 0.5}, one.joints}};
      if (moves) chain.insert(chain.begin(), cart);
      ExpectEnergies(chain, "", one.is_exact);
      ExpectEnergies(chain, " damping=\"0.1\"", one.is_exact_damped);
    }
  }
}

TEST(ImportChain, RandomJointsOfABodyKeepTheirMotion) {
  using Eigen::Vector3d;
  const std::vector<Vector3d> axes = {{1, 0, 0},
                                      {0, 1, 0},
                                      {0, 0, 1},
                                      {0.6, 0, 0.8},
                                      {-0.48, 0.6, 0.64}},
                              points = {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.2, -0.3}};
  std::mt19937 random(7);
  const auto any = [&](const auto& list) { return list[random() % list.size()]; };
  int read = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Hinged body = {1.0, {0.05, 0.01, 0.1}, {0.01, 0.03, 0.025}, {0, 0, 0.5}, {}};
    for (std::size_t count = 2 + random() % 5; count > 0; --count) {
      body.joints.push_back({any(points), any(axes), random() % 2 == 0});
    }
    const std::string damping = random() % 2 == 0 ? "" : " damping=\"0.1\"";
    try {
      ExpectEnergies({body}, damping);
      ++read;
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find("repeat motions of each other"), std::string::npos);
    }
  }
  EXPECT_GT(read, 100);
}

/// A thin disk has no mass to give to a hinge beside its plane: it would be no body any more.
TEST(ImportChain, BodiesThatGiveMassStayBodies) {
  const std::string hinges = "<joint axis=\"1 0 0\" pos=\"0 0.3 0.5\"/><joint axis=\"0 0 1\"/>";
  ImportOptions options;
  options.balances_inertia = true;
  const Imported disk = ImportText(
      "<mujoco><worldbody><body name=\"a\"><inertial pos=\"0 0 0\" mass=\"1\" "
      "diaginertia=\"0.01 0.01 0.02\"/>" +
          hinges + "</body></worldbody></mujoco>",
      "file.xml", options);
  EXPECT_EQ(disk.description.bodies[1].inertia.diagonal(), Vector3d(0.01, 0.01, 0.02));
  // twelve fingers on one palm
  std::string fingers;
  for (int i = 0; i < 12; ++i) {
    fingers += fmt::format(
        "<body pos=\"{} 0 0.1\"><inertial pos=\"0 0 0\" mass=\"0.1\" diaginertia=\"1 1 1\"/>"
        "<joint axis=\"1 0 0\" pos=\"0 0 -0.05\"/><joint axis=\"0 1 0\"/></body>",
        0.1 * i);
  }
  const Imported hand = ImportText(
      "<mujoco><worldbody><body name=\"palm\"><freejoint/><inertial pos=\"0 0 0\" "
      "mass=\"1\" diaginertia=\"0.02 0.025 0.03\"/>" +
          fingers + "</body></worldbody></mujoco>",
      "file.xml");
  EXPECT_EQ(std::ranges::count(hand.notes, true, &ImportNote::changes_motion), 0);
  EXPECT_GT(hand.description.bodies[1].mass, 0.8);
}

TEST(ImportChain, NamesOfLinksAndJointsDoNotCollide) {
  const std::string axes = "<joint name=\"p\" axis=\"1 0 0\"/><joint axis=\"0 1 0\"/>",
                    mass = "<inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>",
                    skew = "<joint axis=\"1 0 0\"/><joint axis=\"0 1 0\" pos=\"0 0 1\"/>";
  const MechanismDescription d =
      ImportText("<mujoco><worldbody><body name=\"a\">" + mass + axes +
                     "</body><body name=\"a link\">" + mass + skew + "</body><body name=\"b\">" +
                     mass + skew + "</body><body name=\"b link\">" + mass +
                     axes.substr(axes.find("/>") + 2) + "</body></worldbody></mujoco>",
                 "file.xml")
          .description;
  EXPECT_EQ(d.joints[0].name, "p");
  std::vector<std::string> names;
  for (const BodyDescription& body : d.bodies) names.push_back(body.name);
  EXPECT_EQ(names, (std::vector<std::string>{"ground", "a", "a link", "a link link", "b",
                                             "b link_2", "b link"}));
}

TEST(ImportChain, TargetsAndWeightsOfASidecarSurvive) {
  const std::string ball = Series({kX, kY, kZ});
  const InitialDescription start =
      WithSidecar(ball, R"({"initial": {"coordinates": {"rx": 0.1}, "weights": {"rx": 5}, "poses":
                            [{"body": "rod", "point": [0, 0, 1], "at": [0, 0.5, 2.5]}]}})")
          .description.initial;
  ASSERT_EQ(start.poses.size(), 1u);
  EXPECT_EQ(start.poses[0].body, 1);
  EXPECT_EQ(start.poses[0].point, Vector3d(0, 0, 1));
  ASSERT_EQ(start.coordinates.size(), 1u);
  EXPECT_EQ(start.coordinates[0].weight, 5.0);
}

TEST(ImportChain, LinksOfSeveralPartsAreOne) {
  const Step weld = {"f", "fixed", "0 0 0", "1 0 0"};
  const Imported imported = ImportText(Series({kX, weld, kY, kZ}), "file.xml");
  ASSERT_EQ(imported.description.joints.size(), 1u);
  EXPECT_EQ(ToString(imported.description.joints[0].type), "spherical");
  const Step again = {"again", "continuous", "0 0 0", "1 0 0"};
  ExpectRefusal(Series({kX, weld, again}), {"that repeat motions of each other"});
}

TEST(ImportChain, JointsThatOthersMoveMayRepeatMotions) {
  // a rotor determines the second angle; without it nothing does
  const auto model = [](const std::string& rotor) {
    return "<mujoco><worldbody><body><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>"
           "<joint axis=\"1 0 0\"/><joint axis=\"1 0 0\"" +
           rotor + "/></body></worldbody></mujoco>";
  };
  ExpectRefusal(model(""), {"that repeat motions of each other"});
  ExpectRefusal(model(" damping=\"1\""), {"that repeat motions of each other"});
  EXPECT_EQ(ImportText(model(" armature=\"0.1\""), "file.xml").description.joints.size(), 2u);
}

TEST(ImportChain, TwoSlidesAreAPlanarJointThatKeepsItsAngle) {
  const Imported table = Mujoco(
      "0 0 1", "<joint type=\"slide\" axis=\"1 0 0\"/><joint type=\"slide\" axis=\"0 1 0\"/>");
  const Mechanism<Spatial, double> mechanism(table.description, Coordinates::kJoint);
  EXPECT_EQ(mechanism.num_u(), 2);
  EXPECT_EQ(table.description.joints[0].type, JointType::kPlanar);
}

}  // namespace import_chain_test
}  // namespace loopbench::harness
