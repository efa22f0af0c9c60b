// Joints in series through links without mass: the joint that they form, its frames and its start.
#include "mechanism/model/kinematics.h"
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_chain_test {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

constexpr double kEps = 1e-15;  // some units of rounding for lengths and angles of order one

const std::string kRodMass =
    "<inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1'/></inertial>";

Vector3d VectorOf(const std::string& text) {
  std::istringstream in(text);
  Vector3d v;
  in >> v.x() >> v.y() >> v.z();
  return v;
}

/// A joint of URDF: type, origin, axis, and other contents.
struct Step {
  std::string name, type, xyz, axis, inside = "";
};

/// A robot whose joints lead in series from the world through links without mass to "rod".
std::string Series(const std::vector<Step>& steps, const std::string& last = kRodMass) {
  std::string text = "<robot name='r'><link name='world'/>\n";
  std::string from = "world";
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    const bool is_last = i + 1 == steps.size();
    const std::string to = is_last ? "rod" : "cross_" + std::to_string(i + 1);
    text += "<link name='" + to + "'>" + (is_last ? last : "") + "</link>\n<joint name='" +
            step.name + "' type='" + step.type + "'><parent link='" + from + "'/><child link='" +
            to + "'/><origin xyz='" + step.xyz + "'/><axis xyz='" + step.axis + "'/>" +
            step.inside + "</joint>\n";
    from = to;
  }
  return text + "</robot>";
}

/// A body of MuJoCo at a place, with several joints.
Imported Mujoco(const std::string& pos, const std::string& joints) {
  return ImportOf("<mujoco><worldbody><body name='rod' pos='" + pos +
                  "'><inertial pos='0 0 0' mass='2' diaginertia='1 1 1'/>" + joints +
                  "</body></worldbody></mujoco>");
}

/// Imports with a sidecar of this text.
Imported WithSidecar(const std::string& text, const std::string& json) {
  const auto file = std::filesystem::path(testing::TempDir()) / "loopbench-chain.json";
  WriteFileAtomically(file, json);
  return ImportOf(text, {.sidecar = file});
}

const Step kX = {"rx", "continuous", "0 0 2", "1 0 0"}, kY = {"ry", "continuous", "0 0 0", "0 1 0"},
           kZ = {"rz", "continuous", "0 0 -0.25", "0 0 1"};

/// A body of MuJoCo with the joints of a series, at their places in its axes.
Imported Mujoco(const std::vector<Step>& steps) {
  const auto height = [](const Step& step) { return VectorOf(step.xyz).z(); };
  double end = 0.0, at = 0.0;
  for (const Step& step : steps) end += height(step);
  std::string joints;
  for (const Step& step : steps) {
    at += height(step);
    joints += step.type == "prismatic"
                  ? fmt::format("<joint type='slide' axis='{}'/>", step.axis)
                  : fmt::format("<joint axis='{}' pos='0 0 {}'/>", step.axis, at - end);
  }
  return Mujoco(fmt::format("0 0 {}", end), joints);
}

TEST(ImportChain, SeriesFormTheJointOfAnEqualBodyOfMujoco) {
  const Step x = {"x", "prismatic", "0 0 2", "1 0 0"}, y = {"y", "prismatic", "0 0 0", "0 1 0"},
             z = {"z", "prismatic", "0 0 0", "0 0 1"},
             turn = {"rx", "continuous", "0 0 0", "1 0 0"};
  const std::vector<std::pair<std::vector<Step>, std::string>> cases = {
      {{kX, kY, kZ}, "spherical"},
      {{kX, kY}, "universal"},
      {{x, kX}, "cylindrical"},
      {{kX, y}, "pin-in-slot"},
      {{x, y, kZ}, "planar"},
      {{z, x, y}, "translation"},
      {{x, kY, z, y}, "schoenflies"},
      {{z, kX, kY, kZ}, "point-on-line"},
      {{kX, kY, kZ, y}, "point-on-line"},
      {{y, z, kX, kY, kZ}, "point-in-plane"},
      {{kX, kY, kZ, z, y}, "point-in-plane"},
      {{x, y, z, kY, turn, kZ}, "free"}};
  for (const auto& [steps, type] : cases) {
    SCOPED_TRACE(type);
    const Imported chain = ImportOf(Series(steps)), body = Mujoco(steps);
    ASSERT_EQ(chain.description.bodies.size(), 2u);
    ASSERT_EQ(chain.description.joints.size(), 1u);
    const JointDescription &is = chain.description.joints[0], &of = body.description.joints[0];
    EXPECT_EQ(ToString(is.type), type);
    EXPECT_EQ(is.type, of.type);
    for (const auto& side : {&JointDescription::from, &JointDescription::to}) {
      EXPECT_EQ((is.*side).body, (of.*side).body);
      ExpectNear((is.*side).position, (of.*side).position, kEps);
      ExpectNear((is.*side).rotation, (of.*side).rotation, kEps);
    }
    EXPECT_EQ(is.axis, of.axis);
    ExpectNote(chain, "<link name='rod'>", "joints are one here: " + type);
  }
  // the point where the axes meet, by hand
  const Imported ball = ImportOf(Series({kX, kY, kZ}));
  const JointDescription& joint = ball.description.joints[0];
  EXPECT_EQ(joint.name, "rx+ry+rz");
  ExpectNear(joint.from.position, {0, 0, 2}, kEps);
  ExpectNear(joint.to.position, {0, 0, 0.25}, kEps);
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

/// A joint of MuJoCo: a hinge, slide or ball.
struct Joint {
  Vector3d at, axis;
  std::string type = "hinge";
};

/// A body of MuJoCo and its joints.
struct Jointed {
  double mass;
  Vector3d com, moments;  ///< in body axes
  Vector3d place;         ///< of the body in its parent, drawn
  std::vector<Joint> joints;
};

/// Pose and velocities of a body's origin, by hand.
struct BodyMotion {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Vector3d p = Vector3d::Zero(), w = p, v = p;

  void Shift(const Vector3d& way) {
    v += w.cross(R * way);
    p += R * way;
  }
  /// Adds the motion of a joint, and advances to the numbers of the next one.
  void Add(const Joint& joint, const double*& q, const double*& u) {
    const Vector3d axis = joint.axis.normalized();
    if (joint.type == "slide") {
      Shift(axis * *q++);
      v += R * axis * *u++;
      return;
    }
    Shift(joint.at);
    if (joint.type == "ball") {  // with speeds in axes of the moved body
      R = R * Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
      w += R * Vector3d(u);
      q += 4, u += 3;
    } else {
      w += R * axis * *u++;
      R = R * AngleAxisd(*q++, axis);
    }
    Shift(-joint.at);
  }
};

/// `more`: attributes of all joints.
std::string MujocoText(const std::vector<Jointed>& chain, const std::string& more = "") {
  std::string text, end;
  const auto numbers = [](const Vector3d& v) { return fmt::format("'{}'", fmt::join(v, " ")); };
  for (const Jointed& body : chain) {
    text += fmt::format("<body pos={}><inertial pos={} mass='{}' diaginertia={}/>",
                        numbers(body.place), numbers(body.com), body.mass, numbers(body.moments));
    for (const auto& [at, axis, type] : body.joints) {
      text += fmt::format("<joint type='{}' pos={} axis={}{}/>", type, numbers(at), numbers(axis),
                          more);
    }
    end += "</body>";
  }
  return "<mujoco><compiler angle='radian'/><worldbody>" + text + end + "</worldbody>";
}
/// With a start.
template <class Numbers>
Imported Started(const std::string& text, const Numbers& q, const Numbers& u) {
  return ImportOf(text + fmt::format("<keyframe><key qpos='{}' qvel='{}'/></keyframe></mujoco>",
                                     fmt::join(q, " "), fmt::join(u, " ")));
}

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
void ExpectMotionsOfParts(const std::vector<Joint>& parts, const std::string& type, bool reversed) {
  std::vector<double> q, u;
  for (const Joint& part : parts) {
    const double k = 1.0 + static_cast<double>(q.size());
    if (part.type == "ball") {
      q.insert(q.end(), {0.8, 0.2, -0.4, 0.4});
      u.insert(u.end(), {0.5, -0.3, 0.7});
    } else {
      q.push_back(std::sin(k));
      u.push_back(std::cos(2.0 * k));
    }
  }
  const Jointed body = {2.0, Vector3d::Zero(), Vector3d::Ones(), {0.1, 0.2, 0.3}, parts};
  const std::string text = MujocoText({body});
  SCOPED_TRACE(text);
  const MechanismDescription description = Started(text, q, u).description;
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

  BodyMotion motion;
  motion.Shift(body.place);
  const double *position = q.data(), *speed = u.data();
  for (const Joint& part : parts) motion.Add(part, position, speed);
  motion.Shift(description.bodies[1].com);  // not 0 if a link took mass from the body
  ExpectNear(kinematics.poses()[1].p.eigen(), motion.p, 10 * kEps);
  EXPECT_LE((kinematics.poses()[1].R.eigen() - motion.R).norm(), 10 * kEps);
  const Velocity<Spatial, double>& V = kinematics.motions()[1];
  ExpectNear(V.linear.eigen(), motion.v, 1e-9);
  ExpectNear(V.angular.eigen(), motion.w, 1e-9);
}

TEST(ImportChain, StartsHaveThePosesAndSpeedsOfTheirParts) {
  const Vector3d o(0, 0, 0), p(0.2, -0.1, 0.3);
  const Joint x{o, {1, 0, 0}, "slide"}, y{o, {0, 1, 0}, "slide"}, z{o, {0, 0, 1}, "slide"},
      skew{o, {1, 2, -2}, "slide"}, turn{p, {0, 0, 1}}, tilted{p, {2, -1, 2}},
      ball{p, {0, 0, 1}, "ball"};
  const std::vector<Joint> hinges = {{p, {1, 0, 0}}, {p, {0, 1, 0}}, turn};
  for (const std::vector<Joint>& turns : std::vector<std::vector<Joint>>{hinges, {ball}}) {
    ExpectMotionsOfParts(turns, "spherical", false);
    std::vector<Joint> all = {x, y, z};
    all.insert(all.end(), turns.begin(), turns.end());
    ExpectMotionsOfParts(all, "free", false);
  }
  ExpectMotionsOfParts({turn}, "revolute", false);
  ExpectMotionsOfParts({hinges[0], hinges[1]}, "universal", false);
  ExpectMotionsOfParts({x, y}, "planar", false);
  for (const std::vector<Joint>& planar :
       std::vector<std::vector<Joint>>{{x, y, turn}, {turn, x, y}, {y, turn, x}}) {
    ExpectMotionsOfParts(planar, "planar", false);
  }
  for (const bool reversed : {false, true}) {
    std::vector<Joint> slot = {x, turn}, cylinder = {z, turn};
    if (reversed) std::ranges::reverse(slot);
    if (reversed) std::ranges::reverse(cylinder);
    ExpectMotionsOfParts(slot, "pin-in-slot", reversed);
    ExpectMotionsOfParts(cylinder, "cylindrical", false);
  }
  ExpectMotionsOfParts({x, y, z}, "translation", false);
  ExpectMotionsOfParts({skew, z, x}, "translation", false);
  for (const Joint& hinge : {turn, tilted}) {
    ExpectMotionsOfParts({x, y, z, hinge}, "schoenflies", false);
    ExpectMotionsOfParts({hinge, z, skew, y}, "schoenflies", false);
    ExpectMotionsOfParts({x, hinge, z, y}, "schoenflies", false);
  }
  for (const Joint& slide : {x, z, skew}) {
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
  const Joint other{{0.1, 0.2, 0}, {1, 0, 0}};
  for (const std::vector<Joint>& mixed :
       std::vector<std::vector<Joint>>{{x, ball, y},
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
    return "<link name='" + std::string(name) + "'><inertial><mass>" + mass +
           "</mass><inertia><ixx>" + mass + "</ixx><iyy>" + mass + "</iyy><izz>" + mass +
           "</izz></inertia></inertial></link>";
  };
  const auto joint = [](const char* name, const char* parent, const char* axis, const char* start) {
    return "<joint name='" + std::string(name) + "' type='revolute'><parent>" + parent +
           "</parent><child>cross</child><axis><xyz>" + axis + "</xyz><initial_position>" + start +
           "</initial_position></axis></joint>";
  };
  const Imported imported = ImportOf("<sdf version='1.9'><model name='m'>" + link("cross", "0") +
                                     link("rod", "1") + joint("a", "world", "1 0 0", "0.5") +
                                     joint("b", "rod", "0 1 0", "0.25") + "</model></sdf>");
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
  damped.inside = "<dynamics damping='0.5'/>";
  MechanismDescription d = ImportOf(Series({kX, damped, kZ})).description;
  ASSERT_EQ(d.forces.size(), 1u);
  ASSERT_EQ(d.joints.size(), 3u);
  EXPECT_EQ(d.joints[*PartsOf(d.forces[0]).joint].name, "ry");
  const MechanismDescription last =
      ImportOf(
          Series({kX, kY, kZ, {"r", "continuous", "0 0 1", "0 1 0", "<dynamics damping='0.5'/>"}}))
          .description;
  ASSERT_EQ(last.joints.size(), 2u);
  EXPECT_EQ(last.joints[0].name + " " + last.joints[1].name, "rx+ry+rz r");
}

TEST(ImportChain, OtherLinksWithoutMassAreRejected) {
  const std::string found = "found a body without mass that moves";
  // a link that a force or a third joint needs
  for (
      const char* use :
      {R"("loops": [{"name": "l", "type": "spherical", "from": "cross_1", "to": "ground", "at": [0, 0, 0]}])",
       R"("forces": [{"type": "point_force", "body": "cross_1", "force": [1, 0, 0]}])"}) {
    const auto read = [&] { WithSidecar(Series({kX, kY}), "{" + std::string(use) + "}"); };
    ExpectSaid(MessageOf(read), {"<link name='cross_1'>: " + found});
  }
}

/// Kinetic energy, and height of the centre of mass times mass, of a chain of bodies.
std::pair<double, double> EnergyOf(const std::vector<Jointed>& chain, const double* q,
                                   const double* u) {
  BodyMotion motion;
  double kinetic = 0.0, moment = 0.0;
  for (const Jointed& body : chain) {
    motion.Shift(body.place);
    for (const Joint& joint : body.joints) motion.Add(joint, q, u);
    BodyMotion centre = motion;
    centre.Shift(body.com);
    const Vector3d W = motion.R.transpose() * motion.w;
    kinetic += 0.5 * (body.mass * centre.v.squaredNorm() + W.dot(body.moments.cwiseProduct(W)));
    moment += body.mass * centre.p.z();
  }
  return {kinetic, moment};
}

/// Compares the energies of an imported chain with the bodies' energies in MuJoCo, at several
/// starts. As functions of coordinates and speeds they determine the motion. `more`: attributes of
/// all joints; `is_exact`: no mass is added; by default the notes decide.
void ExpectEnergies(const std::vector<Jointed>& chain, const std::string& more,
                    std::optional<bool> is_exact = {}) {
  const std::string text = MujocoText(chain, more);
  SCOPED_TRACE(text);
  int n = 0;
  for (const Jointed& body : chain) n += static_cast<int>(body.joints.size());
  double offset = 0.0;  // of the potential energy
  for (int trial = 0; trial < 5; ++trial) {
    VectorX<double> q(n), u(n);
    for (int i = 0; i < n; ++i) {
      q[i] = std::sin(1.7 * trial + i);
      u[i] = 3.0 * std::cos(2.3 * trial - i);
    }
    const Imported imported = Started(text, q, u);
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
    const auto [kinetic, moment] = EnergyOf(chain, q.data(), u.data());
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
  const Jointed shin = {
      3.0, {0.01, 0.02, -0.2}, {0.04, 0.05, 0.02}, {0, 0, 1}, {{{0, 0, 0}, {0, 1, 0}}}};
  const auto foot = [](const Vector3d& axis, double miss, const Vector3d& place) {
    return Jointed{1.0,
                   {0.05, 0.01, 0},
                   {0.001, 0.003, 0.0035},
                   place,
                   {{{0, 0, 0.08}, {0, 1, 0}}, {{0, 0, 0.08 - miss}, axis}}};
  };
  const Vector3d below(0, 0, -0.4), skew = Vector3d(0.6, 0.8, 0.0);
  const std::vector<std::vector<Jointed>> chains = {
      {foot({1, 0, 0}, 0.04, {0, 0, 0})},     // on the ground
      {shin, foot({1, 0, 0}, 0.04, below)},   // the feet of a humanoid
      {shin, foot(skew, 0.04, below)},        // not perpendicular either
      {shin, foot(skew, 0.0, below)},         // they meet
      {shin, foot({0, 1, 0}, 0.04, below)}};  // parallel
  for (const std::vector<Jointed>& chain : chains) ExpectEnergies(chain, "", true);
}

TEST(ImportChain, AnyJointsOfABodyKeepTheirMotion) {
  const Eigen::Vector3d o(0, 0, 0.1), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1), skew(0.6, 0.8, 0.0);
  const auto slide = [&](const Eigen::Vector3d& axis) { return Joint{o, axis, "slide"}; };
  const auto hinge = [&](const Eigen::Vector3d& axis, const Eigen::Vector3d& at) {
    return Joint{at, axis};
  };
  const Jointed cart = {3.0, {0.01, 0.02, -0.2}, {0.04, 0.05, 0.03}, o, {slide(x), hinge(y, o)}};
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
      std::vector<Jointed> chain = {
          {1.0, {0.05, 0.01, 0.1}, {0.01, 0.03, 0.025}, {0, 0, 0.5}, one.joints}};
      if (moves) chain.insert(chain.begin(), cart);
      ExpectEnergies(chain, "", one.is_exact);
      ExpectEnergies(chain, " damping='0.1'", one.is_exact_damped);
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
    Jointed body = {1.0, {0.05, 0.01, 0.1}, {0.01, 0.03, 0.025}, {0, 0, 0.5}, {}};
    for (std::size_t count = 2 + random() % 5; count > 0; --count) {
      const auto at = any(points), axis = any(axes);
      body.joints.push_back({at, axis, random() % 2 == 0 ? "slide" : "hinge"});
    }
    const std::string damping = random() % 2 == 0 ? "" : " damping='0.1'";
    try {
      ExpectEnergies({body}, damping);
      ++read;
    } catch (const ConfigError& error) {
      ExpectWords(std::string(error.what()), {"repeat motions of each other"});
    }
  }
  EXPECT_GT(read, 100);
}

/// A thin disk has no mass to give to a hinge beside its plane: it would be no body any more.
TEST(ImportChain, BodiesThatGiveMassStayBodies) {
  const std::string hinges = "<joint axis='1 0 0' pos='0 0.3 0.5'/><joint axis='0 0 1'/>";
  const ImportOptions options{.balances_inertia = true};
  const Imported disk = ImportOf(
      "<mujoco><worldbody><body name='a'><inertial pos='0 0 0' mass='1' diaginertia='0.01 0.01 "
      "0.02'/>" +
          hinges + "</body></worldbody></mujoco>",
      options);
  EXPECT_EQ(disk.description.bodies[1].inertia.diagonal(), Vector3d(0.01, 0.01, 0.02));
  // twelve fingers on one palm
  std::string fingers;
  for (int i = 0; i < 12; ++i) {
    fingers += fmt::format(
        "<body pos='{} 0 0.1'><inertial pos='0 0 0' mass='0.1' diaginertia='1 1 1'/><joint axis='1 "
        "0 0' pos='0 0 -0.05'/><joint axis='0 1 0'/></body>",
        0.1 * i);
  }
  const Imported hand = ImportOf(
      "<mujoco><worldbody><body name='palm'><freejoint/><inertial pos='0 0 0' mass='1' "
      "diaginertia='0.02 0.025 0.03'/>" +
      fingers + "</body></worldbody></mujoco>");
  EXPECT_EQ(std::ranges::count(hand.notes, true, &ImportNote::changes_motion), 0);
  EXPECT_GT(hand.description.bodies[1].mass, 0.8);
}

TEST(ImportChain, NamesOfLinksAndJointsDoNotCollide) {
  const std::string axes = "<joint name='p' axis='1 0 0'/><joint axis='0 1 0'/>",
                    mass = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>",
                    skew = "<joint axis='1 0 0'/><joint axis='0 1 0' pos='0 0 1'/>";
  const MechanismDescription d =
      ImportOf("<mujoco><worldbody><body name='a'>" + mass + axes + "</body><body name='a link'>" +
               mass + skew + "</body><body name='b'>" + mass + skew +
               "</body><body name='b link'>" + mass + axes.substr(axes.find("/>") + 2) +
               "</body></worldbody></mujoco>")
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
  const Imported imported = ImportOf(Series({kX, weld, kY, kZ}));
  ASSERT_EQ(imported.description.joints.size(), 1u);
  EXPECT_EQ(ToString(imported.description.joints[0].type), "spherical");
}

TEST(ImportChain, JointsThatOthersMoveMayRepeatMotions) {
  // a rotor determines the second angle
  const auto model = [](const std::string& rotor) {
    return "<mujoco><worldbody><body><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/><joint "
           "axis='1 0 0'/><joint axis='1 0 0'" +
           rotor + "/></body></worldbody></mujoco>";
  };
  EXPECT_EQ(ImportOf(model(" armature='0.1'")).description.joints.size(), 2u);
}

TEST(ImportChain, TwoSlidesAreAPlanarJointThatKeepsItsAngle) {
  const Imported table =
      Mujoco("0 0 1", "<joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 1 0'/>");
  const Mechanism<Spatial, double> mechanism(table.description, Coordinates::kJoint);
  EXPECT_EQ(mechanism.num_u(), 2);
  EXPECT_EQ(table.description.joints[0].type, JointType::kPlanar);
}

}  // namespace loopbench::harness::import_chain_test
