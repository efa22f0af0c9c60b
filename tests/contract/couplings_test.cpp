// Couplings of joint coordinates and rotors: every formulation, level, solver, coordinate set and
// space against an independent dense KKT system of the bodies' planar coordinates, and bad input.
#include "mechanism/description/library.h"
#include "mechanism/description/transforms.h"
#include "mechanism/formulation/forward_jacobian.h"
#include "mechanism/loops/tree_dynamics.h"
#include "mechanism/start/assembly.h"
#include "tests/contract/contract.h"

namespace loopbench::testing {
namespace {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;

BodyDescription Body(const std::string& name, double mass, double inertia, const Vector3& com) {
  BodyDescription body;
  body.name = name;
  body.mass = mass;
  body.com = com;
  body.inertia = inertia * Eigen::Matrix3d::Identity();
  return body;
}

/// A gripper: a rack slides along x and drives the cranks of two parallelograms, which turn against
/// each other. The second parallelogram's coupled crank closes its loop.
MechanismDescription Gripper() {
  MechanismDescription d;
  d.name = "gripper";
  d.gravity = {0.5, -9.81, 0.0};
  d.bodies.push_back(Body("rack", 0.7, 0.01, {0.1, 0.02, 0.0}));
  for (const std::string side : {"left", "right"}) {
    const double s = side == "left" ? 1.0 : -1.0;
    const int crank = static_cast<int>(d.bodies.size()), follower = crank + 1, finger = crank + 2;
    d.bodies.push_back(Body(side + " crank", 0.3, 0.004, {0.12, 0.01, 0.0}));
    d.bodies.push_back(Body(side + " follower", 0.2, 0.003, {0.1, -0.02, 0.0}));
    d.bodies.push_back(Body(side + " finger", 0.4, 0.006, {0.05, 0.1, 0.0}));
    d.joints.push_back(Revolute(side + " A", 0, {0.0, 0.3 * s, 0.0}, crank, Vector3::Zero()));
    d.joints.push_back(Revolute(side + " B", crank, {0.25, 0.0, 0.0}, finger, Vector3::Zero()));
    d.joints.push_back(Revolute(side + " C", 0, {0.0, 0.45 * s, 0.0}, follower, Vector3::Zero()));
    d.joints.push_back(
        Revolute(side + " D", follower, {0.25, 0.0, 0.0}, finger, {0.0, 0.15 * s, 0.0}));
  }
  JointDescription slide;
  slide.name = "slide";
  slide.type = JointType::kPrismatic;
  slide.to.body = 1;
  d.joints.push_back(slide);
  // joints: left 0-3, right 4-7, slide 8
  d.joints[4].cut = true;
  d.couplings.push_back({"mirror", {{0, 1.0}, {4, 1.0}}, 0.0});
  d.couplings.push_back({"pinion", {{8, 1.0}, {0, -0.04}}, 0.01});
  d.forces.push_back(JointTorque{.joint = 2, .value = Polynomial{{0.8}}});
  d.initial.coordinates.push_back({0, {0.4}});
  d.initial.held.push_back(0);
  d.initial.coordinates.push_back({2, {0.4}});
  d.initial.coordinates.push_back({6, {-0.4}});
  d.initial.speeds.push_back({8, {0.06}});
  return d;
}

/// Rotors on a pin of Ground, a pin between moving bodies, a joint that closes a loop and the
/// slide.
MechanismDescription GripperWithRotors() {
  MechanismDescription d = Gripper();
  for (const auto& [joint, inertia] : {std::pair{0, 0.05}, {1, 0.02}, {4, 0.3}, {8, 1.5}}) {
    d.joints[joint].rotor_inertia = inertia;
  }
  return d;
}

/// Accelerations [x'', y'', angle''] of all bodies: M A - C^T mu = F, C A = gamma, written for
/// pins, slides along x of Ground, couplings, rotors and a torque on a joint, from positions and
/// speeds alone.
class Kkt {
 public:
  Kkt(const MechanismDescription& description, const Kinematics<Planar, double>& at)
      : d_(description), at_(at), n_(3 * (static_cast<int>(d_.bodies.size()) - 1)) {
    M_.setZero(n_, n_);
    F_.setZero(n_);
    for (int b = 1; b < static_cast<int>(d_.bodies.size()); ++b) {
      M_.diagonal().segment<3>(3 * b - 3) << d_.bodies[b].mass, d_.bodies[b].mass,
          d_.bodies[b].inertia(2, 2);
      F_.segment<2>(3 * b - 3) = d_.bodies[b].mass * d_.gravity.head<2>();
    }
    for (const JointDescription& joint : d_.joints) {
      AddJoint(joint);
      Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(n_);
      AddCoordinate(row, joint, 1.0);
      M_ += joint.rotor_inertia * row.transpose() * row;
    }
    for (const CouplingDescription& coupling : d_.couplings) {
      Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(n_);
      for (const auto& [j, ratio] : coupling.parts) AddCoordinate(row, d_.joints[j], ratio);
      Add(row, 0.0);
    }
    const auto& torque = std::get<JointTorque>(d_.forces[0]);
    const double value = std::get<Polynomial>(torque.value).coefficients[0];
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(n_);
    AddTo(row, d_.joints[torque.joint].to.body, 2, value);
    F_ += row.transpose();
  }

  Eigen::VectorXd Solve() const {
    const int m = static_cast<int>(rows_.size());
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n_ + m, n_ + m);
    Eigen::VectorXd rhs(n_ + m);
    K.topLeftCorner(n_, n_) = M_;
    for (int i = 0; i < m; ++i) {
      K.row(n_ + i).head(n_) = rows_[i];
      K.col(n_ + i).head(n_) = -rows_[i].transpose();
      rhs[n_ + i] = gamma_[i];
    }
    rhs.head(n_) = F_;
    return Eigen::FullPivLU<Eigen::MatrixXd>(K).solve(rhs);
  }
  int size() const { return n_; }

 private:
  void AddTo(Eigen::RowVectorXd& row, int body, int component, double value) const {
    if (body != kGround) row[3 * body - 3 + component] += value;
  }
  /// Adds the derivative of a joint's coordinate, times `factor`.
  void AddCoordinate(Eigen::RowVectorXd& row, const JointDescription& joint, double factor) const {
    const int component = joint.type == JointType::kPrismatic ? 0 : 2;
    AddTo(row, joint.to.body, component, factor);
    AddTo(row, joint.from.body, component, -factor);
  }
  void Add(const Eigen::RowVectorXd& row, double gamma) {
    rows_.push_back(row);
    gamma_.push_back(gamma);
  }
  /// From the centre of mass, in ground axes.
  Vector2 Arm(const JointSide& side) const {
    const double a = side.body == kGround ? 0.0 : at_.poses()[side.body].angle;
    const Vector2 r = (side.position - d_.bodies[side.body].com).head<2>();
    return {std::cos(a) * r.x() - std::sin(a) * r.y(), std::sin(a) * r.x() + std::cos(a) * r.y()};
  }
  void AddJoint(const JointDescription& joint) {
    if (joint.type == JointType::kPrismatic) {
      for (const int component : {1, 2}) {
        Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(n_);
        AddTo(row, joint.to.body, component, 1.0);
        Add(row, 0.0);
      }
      return;
    }
    for (const int k : {0, 1}) {
      Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(n_);
      double gamma = 0.0;
      for (const auto& [side, sign] : {std::pair{&joint.to, 1.0}, std::pair{&joint.from, -1.0}}) {
        if (side->body == kGround) continue;
        const Vector2 r = Arm(*side);
        const double w = at_.motions()[side->body].angular[0];
        AddTo(row, side->body, k, sign);
        AddTo(row, side->body, 2, sign * (k == 0 ? -r.y() : r.x()));
        gamma += sign * w * w * r[k];
      }
      Add(row, gamma);
    }
  }

  const MechanismDescription& d_;
  const Kinematics<Planar, double>& at_;
  int n_;
  Eigen::MatrixXd M_;
  Eigen::VectorXd F_;
  std::vector<Eigen::RowVectorXd> rows_;
  std::vector<double> gamma_;
};

/// Accelerations of the bodies at the start by the KKT system.
Eigen::VectorXd Expected(const MechanismDescription& description, double* size) {
  const Mechanism<Planar, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Planar>(description, mechanism);
  EXPECT_EQ(start.outcome, Outcome::kFinished) << start.message;
  Kinematics<Planar, double> kinematics(mechanism);
  kinematics.UpdatePosition(start.q);
  kinematics.UpdateVelocity(start.u);
  EXPECT_GT(start.u.norm(), 0.1);
  for (int c = 0; c < static_cast<int>(mechanism.couplings().size()); ++c) {
    // 45 eps of angles of at most 1; ten times that of speeds up to 1.5
    EXPECT_NEAR(kinematics.CouplingMismatch(c), 0.0, 1e-14);
    EXPECT_NEAR(kinematics.CouplingSpeed(c), 0.0, 1e-13);
  }
  const Kkt kkt(description, kinematics);
  const Eigen::VectorXd A = kkt.Solve().head(kkt.size());
  *size = A.lpNorm<Eigen::Infinity>();
  return A;
}

/// A formulation that has started where the mechanism assembles.
template <class Space>
struct Started {
  Started(const MechanismDescription& description, const std::string& formulation,
          Coordinates coordinates = Coordinates::kJoint, const FormulationOptions& options = {})
      : mechanism(description, coordinates),
        start(Assemble<Space>(description, mechanism)),
        system(harness::MakeFormulation<Space>(formulation, mechanism, options)) {
    EXPECT_EQ(start.outcome, Outcome::kFinished) << start.message;
    EXPECT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
    y.resize(static_cast<std::size_t>(system->state_size()));
    ydot = y;
    system->ToState(start.q, start.u, y);
  }
  Outcome Evaluate(double t = 0.0) { return system->Evaluate(t, start.q, start.u, udot); }

  const Mechanism<Space, double> mechanism;
  const Start<double> start;
  const std::unique_ptr<System<Space, double>> system;
  std::vector<double> y, ydot;
  VectorX<double> udot;
};

template <class Space>
void ExpectAccelerations(const Case& c, const MechanismDescription& description,
                         const Eigen::VectorXd& expected, double size) {
  Started<Space> at(description, c.formulation, c.coordinates,
                    {.enforcement = c.enforcement, .solver = c.solver, .gains = c.gains});
  auto& [mechanism, start, system, y, ydot, udot] = at;
  ASSERT_EQ(system->Derivative(0.0, y, ydot), Outcome::kFinished) << system->Why();
  ASSERT_EQ(system->Examine(0.0, y, ydot), Outcome::kFinished);
  TreeDynamics<Space, double> dynamics(mechanism);
  std::vector<Acceleration<Space, double>> A(static_cast<std::size_t>(mechanism.num_bodies()));
  dynamics.BodyAccelerations(system->kinematics(), system->udot(), A);
  // 100 eps times some 30 unknowns over a condition of the loops of 1e-3
  const double bound = 1e-9 * size;
  for (int b = 1; b < mechanism.num_bodies(); ++b) {
    const Eigen::Vector3d wanted = expected.segment<3>(3 * b - 3);
    EXPECT_NEAR(A[b].linear[0], wanted[0], bound) << mechanism.body_names()[b];
    EXPECT_NEAR(A[b].linear[1], wanted[1], bound) << mechanism.body_names()[b];
    EXPECT_NEAR(A[b].angular[Space::kRot - 1], wanted[2], bound) << mechanism.body_names()[b];
  }
  // multipliers balance: M udot + h - J^T lambda - G^T mu = 0, J udot = gamma, G udot = 0
  VectorX<double> force, rows;
  const VectorX<double> lambda = system->Multipliers();
  ASSERT_EQ(lambda.size(), mechanism.num_equations());
  dynamics.Residual(system->kinematics(), system->udot(), lambda, force, rows);
  EXPECT_LE(force.template lpNorm<Eigen::Infinity>(), bound);
  EXPECT_LE(rows.template lpNorm<Eigen::Infinity>(), bound);
}

class CouplingTest : public ::testing::TestWithParam<Case> {};

TEST_P(CouplingTest, AccelerationsAgreeWithADenseSystemOfTheBodies) {
  const Case& c = GetParam();
  for (const MechanismDescription& planar : {Gripper(), GripperWithRotors()}) {
    double size = 0.0;
    const Eigen::VectorXd expected = Expected(planar, &size);
    if (c.space == SpaceKind::kPlanar) {
      ExpectAccelerations<Planar>(c, planar, expected, size);
    } else {
      ExpectAccelerations<Spatial>(c, InSpace(planar, Vector3::Zero()), expected, size);
    }
  }
}

/// As published, planar loops in space are singular.
bool IsOfGripper(const Case& c) {
  return c.space == SpaceKind::kPlanar || c.solver == SolverKind::kRankRevealing;
}

INSTANTIATE_TEST_SUITE_P(All, CouplingTest, ::testing::ValuesIn(CasesThat(IsOfGripper)), NameOf);

/// A chain in space of all joints with one coordinate, about axes without order.
MechanismDescription SpatialChain() {
  MechanismDescription d;
  d.name = "spatial-chain";
  d.space = SpaceKind::kSpatial;
  d.gravity = {1.0, -2.0, -9.0};
  const JointType types[] = {JointType::kRevolute, JointType::kRevolute, JointType::kPrismatic,
                             JointType::kHelical};
  const Vector3 axes[] = {{0.0, 0.0, 1.0}, {0.6, 0.0, 0.8}, {0.0, 0.6, -0.8}, {0.48, 0.64, 0.6}};
  for (int i = 0; i < 4; ++i) {
    BodyDescription body = Body("body " + std::to_string(i), 1.0 + i, 0.1, {0.2, 0.1 * i, -0.1});
    body.inertia.diagonal() << 0.1, 0.12, 0.15 + 0.02 * i;
    d.bodies.push_back(body);
    JointDescription joint;
    joint.name = "joint " + std::to_string(i);
    joint.type = types[i];
    joint.axis = axes[i];
    joint.parameter = types[i] == JointType::kHelical ? 0.2 : 0.0;
    joint.from = {i, {0.3, 0.0, 0.1 * i}, {0.1, 0.2, 0.3 * i}};
    joint.to = {i + 1, {-0.1, 0.05, 0.0}, {0.0, 0.4, -0.1 * i}};
    d.joints.push_back(joint);
  }
  d.couplings.push_back({"of three", {{0, 1.0}, {1, 0.5}, {3, -0.7}}, 0.2});
  d.couplings.push_back({"rack", {{2, 1.0}, {0, 0.1}}, 0.0});
  d.initial.coordinates = {{0, {0.7}}, {1, {-0.4}}};
  d.initial.speeds = {{0, {2.0}}, {1, {-1.5}}};
  return d;
}

/// Joint coordinates have couplings as constant rows, absolute ones measure all joints.
TEST(Couplings, OfMeasuredJointsAreThoseOfCoordinates) {
  const MechanismDescription d = SpatialChain();
  std::vector<Acceleration<Spatial, double>> first;
  for (const Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    for (const std::string name : {"odca", "lagrange", "reduction"}) {
      Started<Spatial> at(d, name, coordinates);
      ASSERT_EQ(at.Evaluate(), Outcome::kFinished);
      std::vector<Acceleration<Spatial, double>> A(5);
      TreeDynamics<Spatial, double>(at.mechanism)
          .BodyAccelerations(at.system->kinematics(), at.udot, A);
      if (first.empty()) first = A;
      double size = 0.0, apart = 0.0;
      for (std::size_t b = 1; b < A.size(); ++b) {
        size = std::max(size, A[b].norm());
        apart = std::max(apart, (A[b] - first[b]).norm());
      }
      EXPECT_GT(size, 10.0);
      // 100 eps times 24 unknowns, over a condition of 1e-1
      EXPECT_LE(apart, 1e-11 * size) << name;
    }
  }
}

/// Discs on parallel pins, coupled: teeth[i] q_i + teeth[i + 1] q_{i + 1} = 0.
MechanismDescription GearTrain(const std::vector<double>& teeth, double torque) {
  MechanismDescription d;
  d.name = "gear-train";
  for (std::size_t i = 0; i < teeth.size(); ++i) {
    const double r = teeth[i] / 100;
    d.bodies.push_back(Body("gear " + std::to_string(i + 1), 1.0 + static_cast<double>(i),
                            0.5 * (1.0 + static_cast<double>(i)) * r * r, Vector3::Zero()));
    d.joints.push_back(Revolute("pin " + std::to_string(i + 1), 0,
                                {0.7 * static_cast<double>(i), 0.0, 0.0}, static_cast<int>(i) + 1,
                                Vector3::Zero()));
  }
  for (int i = 0; i + 1 < static_cast<int>(teeth.size()); ++i) {
    d.couplings.push_back(
        {"mesh " + std::to_string(i + 1), {{i, teeth[i]}, {i + 1, teeth[i + 1]}}, 0.0});
  }
  d.forces.push_back(JointTorque{.joint = 0, .value = Polynomial{{torque}}});
  return d;
}

TEST(Couplings, GearTrainsHaveTheReducedInertia) {
  for (const std::vector<double>& teeth :
       {std::vector<double>{20, 35}, std::vector<double>{20, 35, 12}}) {
    const MechanismDescription d = GearTrain(teeth, 3.0);
    double inertia = 0.0;
    for (std::size_t i = 0; i < teeth.size(); ++i) {
      const double rate = teeth[0] / teeth[i];
      inertia += d.bodies[i + 1].inertia(2, 2) * rate * rate;
    }
    for (const std::string name : {"odca", "lagrange", "reduction"}) {
      Started<Planar> at(d, name);
      ASSERT_EQ(at.Evaluate(), Outcome::kFinished);
      for (std::size_t i = 0; i < teeth.size(); ++i) {
        const double sign = i % 2 == 0 ? 1.0 : -1.0;
        const double wanted = sign * teeth[0] / teeth[i] * 3.0 / inertia;
        EXPECT_NEAR(at.udot[static_cast<Eigen::Index>(i)], wanted, 64 * kEps * std::abs(wanted));
      }
      // the first mesh carries all but the torque of the first gear, up to 150 eps of 3 N m
      const double first = d.bodies[1].inertia(2, 2) * at.udot[0];
      EXPECT_NEAR(at.system->Multipliers()[0] * teeth[0], first - 3.0, 1e-13) << name;
    }
  }
}

/// Bevel differential: q_left + q_right = 2 q_carrier. With Lagrange's equations of the two wheels,
/// (I + C/4) w_l' + C/4 w_r' = tau/2 + t_l, and the same for the right wheel.
TEST(Couplings, ADifferentialSplitsTheTorque) {
  MechanismDescription d;
  d.name = "differential";
  const double I = 0.3, C = 0.8, tau = 5.0, t_left = -1.0;
  for (const auto& [name, inertia] : {std::pair{"left", I}, {"right", I}, {"carrier", C}}) {
    d.bodies.push_back(Body(name, 1.0, inertia, Vector3::Zero()));
    d.joints.push_back(
        Revolute(name, 0, Vector3::Zero(), static_cast<int>(d.bodies.size()) - 1, Vector3::Zero()));
  }
  d.couplings.push_back({"bevel", {{0, 1.0}, {1, 1.0}, {2, -2.0}}, 0.0});
  for (const auto& [joint, value] : {std::pair{2, tau}, {0, t_left}}) {
    d.forces.push_back(JointTorque{.joint = joint, .value = Polynomial{{value}}});
  }
  Eigen::Matrix2d M;
  M << I + C / 4, C / 4, C / 4, I + C / 4;
  const Vector2 wanted = M.inverse() * Vector2(tau / 2 + t_left, tau / 2);
  for (const std::string name : {"odca", "lagrange", "reduction"}) {
    Started<Planar> at(d, name, Coordinates::kAbsolute);
    ASSERT_EQ(at.Evaluate(), Outcome::kFinished);
    // 450 eps: nine coordinates, two eliminations
    EXPECT_NEAR(at.udot[0], wanted[0], 1e-13 * wanted.norm()) << name;
    EXPECT_NEAR(at.udot[3], wanted[1], 1e-13 * wanted.norm()) << name;
    EXPECT_NEAR(at.udot[6], 0.5 * wanted.sum(), 1e-13 * wanted.norm()) << name;
  }
}

/// A pendulum with a rotor: (J + m r^2 + I) q'' = -m g r sin q, whatever its formulation.
TEST(Rotors, AddToTheInertiaOfAPendulum) {
  MechanismDescription d;
  d.name = "pendulum";
  d.gravity = {0.0, -9.81, 0.0};
  d.bodies.push_back(Body("rod", 2.0, 0.05, {0.3, 0.0, 0.0}));
  d.joints.push_back(Revolute("pin", 0, Vector3::Zero(), 1, Vector3::Zero()));
  d.initial.coordinates.push_back({0, {0.7}});
  for (const double inertia : {1e-9, 0.4, 1e9}) {
    d.joints[0].rotor_inertia = inertia;
    ASSERT_EQ(Validate(d), "");
    const double wanted = -2.0 * 9.81 * 0.3 * std::cos(0.7) / (0.05 + 2.0 * 0.09 + inertia);
    for (const std::string name : {"odca", "lagrange", "reduction"}) {
      Started<Planar> at(d, name);
      ASSERT_EQ(at.Evaluate(), Outcome::kFinished);
      // x0 and Y mu cancel to the share of the bodies' inertia
      const double cancelled = 1.0 + inertia / 0.23;
      EXPECT_NEAR(at.udot[0], wanted, 64 * kEps * cancelled * std::abs(wanted)) << name << inertia;
    }
  }
}

/// The energy with the rotors' part is constant, the energy of the bodies alone is not.
TEST(Rotors, HaveKineticEnergy) {
  Started<Planar> at(GripperWithRotors(), "odca");
  ASSERT_EQ(at.system->Examine(0.0, at.y, at.ydot), Outcome::kFinished);
  const auto rate_in = [&](const Mechanism<Planar, double>& of) {
    Kinematics<Planar, double> kinematics(of);
    const double h = 1e-5;
    double rate = 0.0;
    for (const double step : {h, -h}) {
      std::vector<double> moved = at.y;
      for (std::size_t i = 0; i < moved.size(); ++i) moved[i] += step * at.ydot[i];
      kinematics.UpdatePosition(VectorX<double>::Map(moved.data(), of.num_q()));
      kinematics.UpdateVelocity(VectorX<double>::Map(moved.data() + of.num_q(), of.num_u()));
      rate += ComputeEnergy(kinematics).total() / (2 * step);
    }
    return rate;
  };
  // h^2 of the third derivative, eps / h of round-off of some 10 J
  EXPECT_NEAR(rate_in(at.mechanism), 0.0, 1e-8);
  EXPECT_GT(std::abs(rate_in({Gripper(), Coordinates::kJoint})), 0.01);
}

TEST(Rotors, UnusableOnesAreRejected) {
  MechanismDescription d = GearTrain({20, 35}, 3.0);
  d.joints[0].rotor_inertia = -0.1;
  EXPECT_EQ(Validate(d),
            "gear-train: joint \"pin 1\": rotor_inertia must be finite and not negative");
  d.joints[0].rotor_inertia = 0.1;
  d.joints[0].type = JointType::kFree;
  d.couplings.clear();
  d.forces.clear();
  EXPECT_EQ(Validate(d), "gear-train: joint \"pin 1\": a rotor needs a joint with one coordinate");
}

TEST(Couplings, RacksKeepTheirUnitsWhenLengthsScale) {
  MechanismDescription d = Gripper();
  const MechanismDescription large = AtScale(d, 8.0);
  EXPECT_EQ(large.couplings[0].parts[1].ratio, 1.0);
  EXPECT_EQ(large.couplings[1].parts[0].ratio, 1.0);
  EXPECT_EQ(large.couplings[1].parts[1].ratio, -0.32);
  EXPECT_EQ(large.couplings[1].offset, 0.08);
  const MechanismDescription rotors = AtScale(GripperWithRotors(), 8.0);
  EXPECT_EQ(rotors.joints[0].rotor_inertia, 64 * 0.05);
  EXPECT_EQ(rotors.joints[8].rotor_inertia, 1.5);
}

/// The Jacobian by forward differentiation against central differences of the right-hand side.
template <class Space>
void ExpectJacobian(const MechanismDescription& description, Coordinates coordinates,
                    Enforcement level) {
  FormulationOptions options{.enforcement = level};
  if (level == Enforcement::kBaumgarte) options.gains = BaumgarteGains{3.0, 4.0};
  const Started<Space> at(description, "odca", coordinates, options);
  const auto& [mechanism, start, system, y, ydot, udot] = at;
  const std::size_t n = y.size();
  std::vector<double> up(n), down(n);
  ASSERT_EQ(system->Examine(0.0, y, up), Outcome::kFinished);
  MatrixX<double> jacobian(n, n);
  ForwardJacobian<Space>(description, *system).Evaluate(jacobian);
  const double h = 1e-6, size = jacobian.cwiseAbs().maxCoeff();
  for (std::size_t k = 0; k < n; ++k) {
    std::vector<double> moved = y;
    moved[k] = y[k] + h;
    ASSERT_EQ(system->Examine(0.0, moved, up), Outcome::kFinished);
    moved[k] = y[k] - h;
    ASSERT_EQ(system->Examine(0.0, moved, down), Outcome::kFinished);
    for (std::size_t i = 0; i < n; ++i) {
      // h^2 of the third derivative, eps / h of round-off
      EXPECT_NEAR(jacobian(i, k), (up[i] - down[i]) / (2 * h), 1e-7 * size) << i << " " << k;
    }
  }
}

TEST(Couplings, HaveAnExactJacobian) {
  for (const Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    for (const Enforcement level : {Enforcement::kAcceleration, Enforcement::kBaumgarte}) {
      ExpectJacobian<Planar>(Gripper(), coordinates, level);
      ExpectJacobian<Planar>(GripperWithRotors(), coordinates, level);
    }
  }
}

/// Adds a coupling that the loop of the left parallelogram implies: both cranks turn alike.
MechanismDescription WithRedundantCoupling() {
  MechanismDescription d = Gripper();
  d.couplings.push_back({"parallel", {{0, 1.0}, {2, -1.0}}, 0.0});
  return d;
}

TEST(Couplings, RedundantOnesChangeNothingOrEndAsSingular) {
  double size = 0.0;
  const Eigen::VectorXd expected = Expected(Gripper(), &size);
  for (const std::string name : {"odca", "lagrange", "reduction"}) {
    for (const Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
      Case c{name, Enforcement::kAcceleration, SolverKind::kRankRevealing, coordinates,
             SpaceKind::kPlanar};
      ExpectAccelerations<Planar>(c, WithRedundantCoupling(), expected, size);
      Started<Planar> at(WithRedundantCoupling(), name, coordinates,
                         {.solver = SolverKind::kAsPublished});
      EXPECT_EQ(at.Evaluate(), Outcome::kSingular) << name;
      EXPECT_EQ(at.system->Why(), "coupling \"parallel\" depends on the other constraints");
    }
  }
}

TEST(Couplings, ContradictoryOnesDoNotAssemble) {
  MechanismDescription d = GearTrain({20, 35}, 3.0);
  d.couplings.push_back({"second", d.couplings[0].parts, 1.0});
  const Mechanism<Planar, double> mechanism(d, Coordinates::kJoint);
  const Start<double> start = Assemble<Planar>(d, mechanism);
  EXPECT_EQ(start.outcome, Outcome::kInconsistentStart);
  EXPECT_NE(start.message.find("coupling \"mesh 1\""), std::string::npos) << start.message;
  EXPECT_NE(start.message.find("coupling \"second\""), std::string::npos) << start.message;
  // with other ratios nothing can turn
  d.couplings[1] = {"second", {{0, 1.0}, {1, 1.0}}, 0.0};
  const Mechanism<Planar, double> locked(d, Coordinates::kJoint);
  const Start<double> stuck = Assemble<Planar>(d, locked);
  EXPECT_EQ(stuck.outcome, Outcome::kLocked);
  EXPECT_NE(stuck.message.find("2 constraints take all 2 speeds"), std::string::npos)
      << stuck.message;
}

TEST(Couplings, ContradictoryMotionsAreInconsistent) {
  MechanismDescription d = GearTrain({20, 35}, 3.0);
  d.forces.clear();
  d.joints[0].motions = {{0, Polynomial{{0.0, 0.0, 1.0}}}};
  EXPECT_EQ(Validate(d), "");
  d.joints[1].motions = {{0, Polynomial{{0.0, 0.0, 1.0}}}};
  EXPECT_NE(Validate(d).find("all of its joints have prescribed motions"), std::string::npos);
  // the motion of the first gear determines the two others
  MechanismDescription three = GearTrain({20, 35, 12}, 3.0);
  three.couplings[1].parts.push_back({0, 1.0});
  three.joints[0].motions = d.joints[0].motions;
  Started<Planar> determined(three, "odca");
  ASSERT_EQ(determined.Evaluate(), Outcome::kFinished);
  // 45 eps of accelerations of 1
  EXPECT_NEAR(determined.udot[0], -2.0 * 20 / 35, 1e-14);
  EXPECT_NEAR(determined.udot[1], -(35 * determined.udot[0] + 2.0) / 12, 1e-14);
  // a motion of the last gear that the meshes contradict
  MechanismDescription driven = GearTrain({20, 35, 12}, 3.0);
  driven.forces.clear();
  driven.joints[0].motions = driven.joints[2].motions = d.joints[0].motions;
  // contradicted at 1 s, but not at 0: an evaluation does not depend on those before
  MechanismDescription late = driven;
  late.joints[0].motions = {{0, Polynomial{{0.0, 1.0}}}};
  late.joints[2].motions = {{0, Polynomial{{0.0, 20.0 / 12.0, 0.0, 1.0}}}};
  Started<Planar> twice(late, "odca");
  EXPECT_EQ(twice.Evaluate(1.0), Outcome::kInconsistentMotion);
  EXPECT_EQ(twice.Evaluate(0.0), Outcome::kFinished);
  const Mechanism<Planar, double> stuck(driven, Coordinates::kJoint);
  const Start<double> at_rest = Assemble<Planar>(driven, stuck);
  const auto contradicted = harness::MakeFormulation<Planar>("odca", stuck, {});
  VectorX<double> udot;
  ASSERT_EQ(contradicted->Start(0.0, at_rest.q, at_rest.u), Outcome::kFinished);
  EXPECT_EQ(contradicted->Evaluate(0.0, at_rest.q, at_rest.u, udot), Outcome::kInconsistentMotion);
}

TEST(Couplings, UnusableOnesAreRejected) {
  const auto error = [](const CouplingDescription& coupling) {
    MechanismDescription d = GearTrain({20, 35}, 3.0);
    JointDescription free;
    free.name = "free";
    free.type = JointType::kFree;
    free.to.body = 1;
    d.joints.push_back(free);
    d.couplings = {coupling};
    return Validate(d);
  };
  EXPECT_EQ(error({"a", {{0, 1.0}, {1, 2.0}}, 0.0}), "");
  EXPECT_EQ(error({"a", {{0, 1.0}}, 0.0}),
            "gear-train: coupling \"a\": a coupling needs two or more joints");
  EXPECT_EQ(error({"a", {{0, 1.0}, {7, 2.0}}, 0.0}),
            "gear-train: coupling \"a\": joint index 7 does not exist");
  EXPECT_EQ(error({"a", {{0, 1.0}, {2, 2.0}}, 0.0}),
            "gear-train: coupling \"a\": joint \"free\" is free, expected a joint with one "
            "coordinate");
  EXPECT_EQ(error({"a", {{0, 1.0}, {1, 0.0}}, 0.0}),
            "gear-train: coupling \"a\": the coefficient of joint \"pin 2\" must be finite and not "
            "0");
  EXPECT_EQ(error({"a", {{0, 1.0}, {0, 2.0}}, 0.0}),
            "gear-train: coupling \"a\": joint \"pin 1\" appears twice");
}

}  // namespace
}  // namespace loopbench::testing
