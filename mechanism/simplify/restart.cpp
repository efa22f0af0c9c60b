#include "mechanism/simplify/restart.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "mechanism/algebra/symmetric_eigen.h"
#include "mechanism/loops/excursion.h"
#include "mechanism/loops/scaled_loops.h"
#include "mechanism/simplify/attach.h"
#include "mechanism/start/assembly.h"

namespace loopbench {

namespace {

std::string KeyOf(const MechanismDescription& description, int body) {
  return body == kGround ? "" : description.bodies[body].name;
}

template <class Space>
BodyStart StartOf(const Kinematics<Space, double>& kinematics, int body,
                  const Eigen::Vector3d& com) {
  BodyStart start;
  const Velocity<Space, double>& V = kinematics.motions()[body];
  start.X = OriginOf(kinematics.poses()[body], com);
  start.w.tail<Space::kRot>() = V.angular.eigen();
  start.v.head<Space::kLin>() = V.linear.eigen();
  if constexpr (Space::kRot == 1) start.angle = kinematics.poses()[body].angle;
  start.v += start.w.cross(start.X.R * -com);
  return start;
}

/// Positions and speeds of bodies on free joints of their own.
template <class Space>
void SetAbsolute(const MechanismDescription& description, const BodyStarts& starts,
                 const Mechanism<Space, double>& absolute, VectorX<double>* q, VectorX<double>* u) {
  q->setZero(absolute.num_q());
  u->setZero(absolute.num_u());
  for (const TreeStep& step : absolute.tree()) {
    const Joint<Space, double>& joint = absolute.joints()[step.joint];
    const BodyStart& start = starts.at(KeyOf(description, step.child));
    const Eigen::Vector3d arm = start.X.R * description.bodies[step.child].com;
    const Eigen::Vector3d p = start.X.p + arm, v = start.v + start.w.cross(arm);
    double* to_q = q->data() + joint.q_offset;
    double* to_u = u->data() + joint.u_offset;
    if constexpr (Space::kRot == 1) {
      to_q[0] = start.angle;
    } else {
      ToQuaternion(Rotation<Spatial, double>(start.X.R), to_q);
    }
    for (int i = 0; i < Space::kLin; ++i) {
      to_q[joint.kind->num_q - Space::kLin + i] = p[i];
      to_u[Space::kRot + i] = v[i];
    }
    for (int i = 0; i < Space::kRot; ++i) to_u[i] = start.w[3 - Space::kRot + i];
  }
}

/// An explicit free joint, to the body's origin, for each part that floats.
void AddFreeJoints(MechanismDescription* description) {
  for (const TreeEdge& edge : BuildTopology(*description, Coordinates::kJoint).edges) {
    if (edge.joint >= 0) continue;
    JointDescription free;
    free.name = UnusedJointName(*description, description->bodies[edge.child].name, " (free)");
    free.type = JointType::kFree;
    free.to.body = edge.child;
    description->joints.push_back(free);
  }
}

/// All followed joints, with their coordinates and speeds.
template <class Space>
InitialDescription InitialIn(const MechanismDescription& description, const BodyStarts& starts) {
  const Mechanism<Space, double> absolute(description, Coordinates::kAbsolute);
  const Mechanism<Space, double> joints(description, Coordinates::kJoint);
  VectorX<double> q, u;
  SetAbsolute<Space>(description, starts, absolute, &q, &u);
  Kinematics<Space, double> from(absolute), to(joints);
  from.UpdatePosition(q);
  from.UpdateVelocity(u);
  const VectorX<double> joint_q = from.CoordinatesIn(joints);
  to.UpdatePosition(joint_q);
  const VectorX<double> joint_u = from.SpeedsIn(to);
  InitialDescription initial;
  for (const TreeStep& step : joints.tree()) {
    const Joint<Space, double>& joint = joints.joints()[step.joint];
    if (joint.description < 0 || joint.num_u() == 0) continue;
    // coordinates that follow a given motion have a place, and any value
    const auto values = [&](const double* numbers, int count) {
      std::vector<double> all(count, 0.0);
      joints.ForEachFree(joint, count, [&](int i, int free) { all[i] = numbers[free]; });
      return all;
    };
    initial.coordinates.push_back(
        {joint.description, values(joint_q.data() + joint.q_offset, joint.kind->num_q)});
    initial.speeds.push_back(
        {joint.description, values(joint_u.data() + joint.u_offset, joint.kind->num_u)});
  }
  return initial;
}

template <class Space>
std::string AssemblyFault(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  if (start.outcome != Outcome::kFinished) return start.message;
  return start.has_given_speeds ? "" : "the given speeds contradict each other";
}

template <class Space>
std::string StartIn(const BodyStarts& starts, MechanismDescription* changed) {
  const InitialDescription given = changed->initial;
  changed->initial = {};
  AddFreeJoints(changed);
  const InitialDescription all = InitialIn<Space>(*changed, starts);
  const auto followed = [&](int joint) {
    return std::ranges::find(all.coordinates, joint, &JointValues::joint) != all.coordinates.end();
  };
  std::vector<int> held = given.held;
  std::erase_if(held, [&](int joint) { return !followed(joint); });
  std::vector<JointValues> given_speeds = given.speeds;
  std::erase_if(given_speeds, [&](const JointValues& speed) { return !followed(speed.joint); });
  std::string fault;
  for (const InitialDescription& tried : {InitialDescription{all.coordinates, all.speeds, held},
                                          InitialDescription{all.coordinates, given_speeds, held},
                                          InitialDescription{all.coordinates, given_speeds, {}},
                                          InitialDescription{all.coordinates, {}, {}}}) {
    changed->initial = tried;
    const std::string message = AssemblyFault<Space>(*changed);
    if (message.empty()) return "";
    if (fault.empty()) fault = message;
  }
  return fault;
}

}  // namespace

BodyStarts AssembledStart(const MechanismDescription& description, std::string* why) {
  why->clear();
  return ForSpace(description.space, [&]<class Space>(Space) {
    const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
    const Start<double> start = Assemble<Space>(description, mechanism);
    BodyStarts starts;
    if (start.outcome != Outcome::kFinished) {
      *why = start.message;
      return starts;
    }
    Kinematics<Space, double> kinematics(mechanism);
    kinematics.UpdatePosition(start.q);
    kinematics.UpdateVelocity(start.u);
    for (int body = 0; body < mechanism.num_bodies(); ++body) {
      const Eigen::Vector3d com =
          body == kGround ? Eigen::Vector3d::Zero() : description.bodies[body].com;
      starts[KeyOf(description, body)] = StartOf<Space>(kinematics, body, com);
    }
    starts[""] = {};
    return starts;
  });
}

std::string UnusedJointName(const MechanismDescription& description, std::string name,
                            const std::string& ending) {
  const auto taken = [&](const JointDescription& joint) { return joint.name == name; };
  while (std::ranges::any_of(description.joints, taken)) name += ending;
  return name;
}

std::string StartAt(const BodyStarts& starts, MechanismDescription* changed) {
  return ForSpace(changed->space,
                  [&]<class Space>(Space) { return StartIn<Space>(starts, changed); });
}

MechanismDescription WithAssembledStart(const MechanismDescription& description, std::string* why) {
  const BodyStarts starts = AssembledStart(description, why);
  if (!why->empty()) return description;
  MechanismDescription whole = description;
  *why = StartAt(starts, &whole);
  return why->empty() ? whole : description;
}

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

template <class Space>
class Measuring {
 public:
  explicit Measuring(const MechanismDescription& description)
      : description_(description),
        mechanism_(description, Coordinates::kJoint),
        kinematics_(mechanism_) {}

  Freedom Run() {
    Freedom freedom;
    freedom.length = mechanism_.length();
    freedom.shares.assign(description_.bodies.size(), 0.0);
    freedom.mobility.assign(description_.forces.size(), 0.0);
    freedom.travel = freedom.mobility;
    if (mechanism_.num_u() > kMaxAnalysedSpeeds) {
      freedom.why = "it has more than " + std::to_string(kMaxAnalysedSpeeds) + " speeds";
      return freedom;
    }
    const Start<double> start = Assemble<Space>(description_, mechanism_);
    if (start.outcome != Outcome::kFinished) {
      freedom.why = start.message;
      return freedom;
    }
    kinematics_.UpdatePosition(start.q);
    kinematics_.UpdateVelocity(start.u);
    freedom.rate = Rate();
    for (std::size_t i = 0; i < description_.forces.size(); ++i) {
      freedom.travel[i] = Coordinate(description_.forces[i]);
    }
    Permit();
    freedom.speeds = static_cast<int>(permitted_.cols());
    if (freedom.speeds == 0) return freedom;
    for (std::size_t body = 1; body < freedom.shares.size(); ++body) {
      freedom.shares[body] = Share(static_cast<int>(body));
    }
    for (std::size_t i = 0; i < freedom.mobility.size(); ++i) {
      freedom.mobility[i] = Mobility(description_.forces[i]);
    }
    return freedom;
  }

 private:
  double Rate() const {
    double rate = std::sqrt(description_.gravity.norm() / mechanism_.length());
    for (int body = 1; body < mechanism_.num_bodies(); ++body) {
      const Velocity<Space, double>& V = kinematics_.motions()[body];
      rate = std::max({rate, V.angular.norm(), V.linear.norm() / mechanism_.length()});
    }
    for (const Drive& drive : mechanism_.drives()) {
      const auto* swing = std::get_if<Harmonic>(&drive.value.description());
      if (swing != nullptr) rate = std::max(rate, std::abs(swing->omega));
    }
    return rate;
  }

  /// The permitted speeds, and the motions of all bodies along each of them.
  void Permit() {
    permitted_ = ScaleLoops(kinematics_).to_u;
    const VectorX<double> none = VectorX<double>::Zero(mechanism_.num_u());
    kinematics_.UpdateVelocity(none);  // given motions alone
    const std::vector<Velocity<Space, double>> given = kinematics_.motions();
    const std::vector<double> given_rates = SpringRates();
    for (Eigen::Index i = 0; i < permitted_.cols(); ++i) {
      kinematics_.UpdateVelocity(permitted_.col(i));
      motions_.push_back(kinematics_.motions());
      rates_.push_back(SpringRates());
      for (std::size_t b = 0; b < given.size(); ++b) motions_.back()[b] -= given[b];
      for (std::size_t f = 0; f < given_rates.size(); ++f) rates_.back()[f] -= given_rates[f];
    }
    MatrixXd G = MatrixXd::Zero(permitted_.cols(), permitted_.cols());
    for (int body = 1; body < mechanism_.num_bodies(); ++body) G += Energies(body);
    whole_.compute(G);
  }

  /// Returns the matrix E of a body; x^T E x is twice its kinetic energy.
  MatrixXd Energies(int body) const {
    const Eigen::Index n = permitted_.cols();
    MatrixXd G(n, n);
    const auto I = kinematics_.RotationalInertia(mechanism_.bodies()[body], body);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Velocity<Space, double>& V = motions_[static_cast<std::size_t>(i)][body];
      const auto turning = I * V.angular;
      for (Eigen::Index k = 0; k < n; ++k) {
        const Velocity<Space, double>& W = motions_[static_cast<std::size_t>(k)][body];
        G(i, k) = W.angular.dot(turning) + mechanism_.bodies()[body].mass * W.linear.dot(V.linear);
      }
    }
    return 0.5 * (G + G.transpose());
  }

  double Share(int body) const {
    MatrixXd scaled = whole_.matrixL().solve(Energies(body));
    scaled = whole_.matrixL().solve(MatrixXd(scaled.transpose()));
    return SymmetricEigenvalues(scaled).maxCoeff();
  }

  double Mobility(const ForceDescription& force) const {
    const std::size_t index = static_cast<std::size_t>(&force - description_.forces.data());
    VectorXd r(permitted_.cols());
    for (Eigen::Index i = 0; i < r.size(); ++i) r[i] = rates_[static_cast<std::size_t>(i)][index];
    return r.dot(whole_.solve(r));
  }

  /// Returns the arm from the centre of mass to a point in body axes, in ground axes.
  Linear<Space, double> Arm(const BodyPoint& point) const {
    Eigen::Vector3d from_com = point.at;
    if (point.body != kGround) from_com -= description_.bodies[point.body].com;
    Linear<Space, double> arm;
    for (int i = 0; i < Space::kLin; ++i) arm[i] = from_com[i];
    return kinematics_.poses()[point.body].R * arm;
  }

  Linear<Space, double> Between(const SpringDamper& spring) const {
    return kinematics_.poses()[spring.to.body].p + Arm(spring.to) -
           kinematics_.poses()[spring.from.body].p - Arm(spring.from);
  }

  /// Returns a spring's coordinate less its free one; 0 for other forces.
  double Coordinate(const ForceDescription& force) const {
    if (const auto* joint = std::get_if<JointSpring>(&force); joint && joint->stiffness > 0.0) {
      return kinematics_.JointCoordinate(joint->joint) - FreeCoordinate(*joint);
    }
    if (const auto* spring = std::get_if<SpringDamper>(&force); spring && spring->stiffness > 0.0) {
      return Between(*spring).norm() - FreeCoordinate(*spring);
    }
    return 0.0;
  }

  /// Returns, by force, the rate of a spring's coordinate at the current speeds.
  std::vector<double> SpringRates() const {
    std::vector<double> rates;
    for (const ForceDescription& force : description_.forces) {
      double& rate = rates.emplace_back(0.0);
      if (const auto* joint = std::get_if<JointSpring>(&force)) {
        rate = kinematics_.JointSpeed(joint->joint);
      } else if (const auto* spring = std::get_if<SpringDamper>(&force)) {
        const Linear<Space, double> way = Between(*spring);
        const auto velocity = [&](const BodyPoint& point) {
          return ShiftMotion<Space, double>(kinematics_.motions()[point.body], Arm(point)).linear;
        };
        const double distance = way.norm();
        if (distance > 0.0)
          rate = way.dot(velocity(spring->to) - velocity(spring->from)) / distance;
      }
    }
    return rates;
  }

  const MechanismDescription& description_;
  Mechanism<Space, double> mechanism_;
  Kinematics<Space, double> kinematics_;
  MatrixXd permitted_;
  std::vector<std::vector<Velocity<Space, double>>> motions_;  ///< by permitted speed and body
  std::vector<std::vector<double>> rates_;                     ///< by permitted speed and force
  Eigen::LLT<MatrixXd> whole_;
};

/// Relative speed of a joint's bodies that counts as rest, per unit speed of the whole.
constexpr double kStillJoint = 1e-8;

/// Returns the description at its start with prescribed motions free, from their values at t = 0.
MechanismDescription WithoutMotions(MechanismDescription description) {
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    JointDescription& joint = description.joints[j];
    const int count = NumValues(joint.type, description.space, false);
    if (joint.motions.empty()) continue;
    for (auto* list : {&description.initial.coordinates, &description.initial.speeds}) {
      std::erase_if(*list,
                    [&](const JointValues& values) { return values.joint == static_cast<int>(j); });
    }
    if (count == 1) {
      const double value = TimeFunction(joint.motions[0].value).At(0.0).value;
      description.initial.coordinates.push_back({static_cast<int>(j), {value}});
    }
    joint.motions.clear();
  }
  return description;
}

Freedom Measure(const MechanismDescription& description) {
  return ForSpace(description.space,
                  [&]<class Space>(Space) { return Measuring<Space>(description).Run(); });
}

}  // namespace

std::vector<bool> FindStill(const MechanismDescription& driven) {
  const MechanismDescription description = WithoutMotions(driven);
  return ForSpace(description.space, [&]<class Space>(Space) {
    const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
    std::vector<bool> still(description.joints.size(), false);
    if (mechanism.num_u() > kMaxAnalysedSpeeds) return still;
    const Start<double> start = Assemble<Space>(description, mechanism);
    if (start.outcome != Outcome::kFinished) return still;
    Kinematics<Space, double> kinematics(mechanism);
    kinematics.UpdatePosition(start.q);
    const MatrixXd permitted = ScaleLoops(kinematics).to_u;
    still.assign(still.size(), true);
    for (Eigen::Index i = 0; i < permitted.cols(); ++i) {
      kinematics.UpdateVelocity(permitted.col(i));
      for (std::size_t j = 0; j < still.size(); ++j) {
        Velocity<Space, double> V = kinematics.joints()[j].V_rel;
        V.angular *= mechanism.length();
        if (V.norm() > kStillJoint) still[j] = false;
      }
    }
    return still;
  });
}

Freedom MeasureFreedom(const MechanismDescription& description) {
  Freedom freedom = Measure(description);
  const bool is_driven = std::ranges::any_of(
      description.joints, [](const JointDescription& joint) { return !joint.motions.empty(); });
  if (!is_driven || !freedom.why.empty()) return freedom;
  // bodies that follow a prescribed motion move and have energy
  Freedom free = Measure(WithoutMotions(description));
  if (free.why.empty()) freedom.shares = std::move(free.shares);
  return freedom;
}

double FreeCoordinate(const JointSpring& spring) {
  return spring.rest + spring.preload / spring.stiffness;
}

double FreeCoordinate(const SpringDamper& spring) {
  return spring.length - spring.preload / spring.stiffness;
}

}  // namespace loopbench
