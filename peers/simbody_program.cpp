// Models in Simbody 3.7 (https://simtk.org/projects/simbody). C++17: its headers do not compile as
// C++20.
#include <Simbody.h>

#include <vector>

#include "harness/exchange/export_simbody.h"
#include "peers/program.h"

namespace loopbench::peers {
namespace {

using namespace SimTK;

Vec3 ToVec3(const exchange::Vec& v) { return {v[0], v[1], v[2]}; }

/// Converts a frame that is already orthogonal to round-off, without changes.
Transform ToTransform(const exchange::Frame& frame) {
  const exchange::Matrix& R = frame.R;
  const Mat33 matrix(R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]);
  return {Rotation(matrix, true), ToVec3(frame.p)};
}

MobilizedBody Mobilize(const exchange::SimbodyMobilizer& one, MobilizedBody& parent) {
  const auto& I = one.inertia;
  const SimTK::Body::Rigid body(
      MassProperties(one.mass, Vec3(0), Inertia(I[0], I[1], I[2], I[3], I[4], I[5])));
  const Transform on_parent = ToTransform(one.on_parent), on_child = ToTransform(one.on_child);
  const auto direction = one.reverse ? MobilizedBody::Reverse : MobilizedBody::Forward;
  const auto make = [&](auto of_type) -> MobilizedBody {
    return decltype(of_type)(parent, on_parent, body, on_child, direction);
  };
  if (one.type == "Pin") return make(MobilizedBody::Pin());
  if (one.type == "Slider") return make(MobilizedBody::Slider());
  if (one.type == "Weld") return MobilizedBody::Weld(parent, on_parent, body, on_child);
  if (one.type == "Cylinder") return make(MobilizedBody::Cylinder());
  if (one.type == "Ball") return make(MobilizedBody::Ball());
  if (one.type == "Universal") return make(MobilizedBody::Universal());
  if (one.type == "Planar") return make(MobilizedBody::Planar());
  if (one.type == "Free") return make(MobilizedBody::Free());
  if (one.type == "Translation") return make(MobilizedBody::Translation());
  if (one.type == "BendStretch") return make(MobilizedBody::BendStretch());
  return MobilizedBody::Screw(parent, on_parent, body, on_child, one.pitch, direction);
}

/// Relation between the coordinates of a mobilizer and of a joint of the Model.
struct Mobilizer {
  MobilizedBody body;
  int q = 0, num_q = 0, u = 0, num_u = 0;  ///< indices of the Model's joint
  double sign = 1.0;                       ///< Model's coordinate = sign * Simbody's
};

/// A Model built in Simbody.
class SimbodyModel {
 public:
  MultibodySystem system;
  SimbodyMatterSubsystem matter{system};
  GeneralForceSubsystem forces{system};
  std::vector<Mobilizer> mobilizers;  ///< flywheels, then in the order of Model::tree

  explicit SimbodyModel(const exchange::Model& model) {
    const exchange::SimbodyParts parts = exchange::MakeSimbodyParts(model);
    mobilized_.assign(parts.mobilizers.size() + 1, MobilizedBodyIndex(0));
    for (const auto& one : parts.mobilizers) Add(one, model.tree[one.joint]);
    for (const auto& one : parts.constraints) Add(one, model.cut[one.joint]);
    for (const auto& one : parts.couplers) Add(one);
    Force::Gravity(forces, matter, ToVec3(model.gravity));
    for (const auto& one : parts.forces) Add(one);
  }
  SimbodyModel(const SimbodyModel&) = delete;
  SimbodyModel& operator=(const SimbodyModel&) = delete;

 private:
  void Add(const exchange::SimbodyMobilizer& mobilizer, const exchange::Joint& joint) {
    MobilizedBody body = Mobilize(mobilizer, BodyAt(mobilizer.parent));
    mobilized_[static_cast<std::size_t>(mobilizer.child)] = body.getMobilizedBodyIndex();
    mobilizers.insert(mobilizer.is_flywheel ? mobilizers.begin() : mobilizers.end(),
                      {body, joint.q, joint.num_q, joint.u, joint.num_u, mobilizer.sign});
  }

  void Add(const exchange::SimbodyConstraint& constraint, const exchange::Joint& joint) {
    using Type = exchange::SimbodyConstraintType;
    MobilizedBody &P = BodyAt(joint.from), &Q = BodyAt(joint.to);
    const Transform F = ToTransform(joint.F), M = ToTransform(joint.M);
    const UnitVec3 on_F = F.R()(constraint.axis_on_F), on_M = M.R()(constraint.axis_on_M);
    switch (constraint.type) {
      case Type::kBall:
        Constraint::Ball(P, F.p(), Q, M.p());
        break;
      case Type::kPointOnLine:
        Constraint::PointOnLine(P, on_F, F.p(), Q, M.p());
        break;
      case Type::kPointInPlane:
        Constraint::PointInPlane(P, on_F, dot(on_F, F.p()), Q, M.p());
        break;
      case Type::kConstantAngle:
        Constraint::ConstantAngle(P, on_F, Q, on_M, Pi / 2);
        break;
      case Type::kConstantOrientation:
        Constraint::ConstantOrientation(P, F.R(), Q, M.R());
        break;
      case Type::kWeld:
        Constraint::Weld(P, F, Q, M);
        break;
      case Type::kRod:
        Constraint::Rod(P, F.p(), Q, M.p(), joint.parameter);
        break;
    }
  }

  void Add(const exchange::SimbodyCoupler& coupler) {
    Array_<MobilizedBodyIndex> bodies;
    Vector coefficients(static_cast<int>(coupler.terms.size()) + 1, coupler.constant);
    for (const auto& [body, factor] : coupler.terms) {
      coefficients[static_cast<int>(bodies.size())] = factor;
      bodies.push_back(mobilized_[static_cast<std::size_t>(body)]);
    }
    const Array_<MobilizerQIndex> first(bodies.size(), MobilizerQIndex(0));
    Constraint::CoordinateCoupler(matter, new Function::Linear(coefficients), bodies, first);
  }

  void Add(const exchange::SimbodyForce& force) {
    using Type = exchange::SimbodyForceType;
    const MobilizedBody &A = BodyAt(force.first), &B = BodyAt(force.second);
    const Vec3 p = ToVec3(force.at_first), q = ToVec3(force.at_second);
    const auto [first, second] = force.numbers;
    switch (force.type) {
      case Type::kMobilityConstantForce:
        Force::MobilityConstantForce(forces, A, 0, first);
        break;
      case Type::kMobilityLinearSpring:
        Force::MobilityLinearSpring(forces, A, 0, first, second);
        break;
      case Type::kMobilityLinearDamper:
        Force::MobilityLinearDamper(forces, A, 0, first);
        break;
      case Type::kConstantForce:
        Force::ConstantForce(forces, A, p, q);
        break;
      case Type::kTwoPointLinearSpring:
        Force::TwoPointLinearSpring(forces, A, p, B, q, first, second);
        break;
      case Type::kTwoPointLinearDamper:
        Force::TwoPointLinearDamper(forces, A, p, B, q, first);
        break;
      case Type::kTwoPointConstantForce:
        Force::TwoPointConstantForce(forces, A, p, B, q, first);
        break;
    }
  }

  MobilizedBody& BodyAt(int body) {
    return matter.updMobilizedBody(mobilized_[static_cast<std::size_t>(body)]);
  }

  std::vector<MobilizedBodyIndex> mobilized_;  ///< by index of Model::bodies, then flywheels
};

class SimbodyProgram final : public Program {
 public:
  explicit SimbodyProgram(const exchange::Model& model) : model_(model) {
    state_ = model_.system.realizeTopology();
    model_.system.realizeModel(state_);
  }

  void Derivative(const double* q, const double* u, double* qdot, double* udot) override {
    Set(q, u, state_);
    model_.system.realize(state_, SimTK::Stage::Acceleration);
    for (const Mobilizer& one : model_.mobilizers) {
      for (int i = 0; i < one.num_q; ++i) {
        qdot[one.q + i] = one.sign * one.body.getOneQDot(state_, i);
      }
      for (int i = 0; i < one.num_u; ++i) {
        udot[one.u + i] = one.sign * one.body.getOneUDot(state_, i);
      }
    }
  }

  void Start(const double* q, const double* u, double tolerance, double t_end) override {
    Set(q, u, state_);
    state_.setTime(0.0);
    integrator_ = std::make_unique<SimTK::RungeKuttaMersonIntegrator>(model_.system);
    integrator_->setAccuracy(tolerance);
    integrator_->setReturnEveryInternalStep(true);
    integrator_->setAllowInterpolation(false);
    integrator_->setFinalTime(t_end);
    integrator_->initialize(state_);
    integrator_->resetAllStatistics();
    t_end_ = t_end;
  }

  void Step() override {
    const double before = time();
    // the first returns only signal the start of the run
    try {
      while (!(time() > before)) {
        const auto status = integrator_->stepTo(t_end_);
        if (status == SimTK::Integrator::EndOfSimulation) return;
      }
    } catch (const std::exception& error) {
      // one exception type for all step failures: its text distinguishes them
      const std::string text = error.what();
      const std::size_t place = text.find("Unable to advance time past");
      if (place == std::string::npos) throw;
      throw StepTooSmall(text.substr(place, text.find('\n', place) - place));
    }
  }

  double time() const override { return integrator_->getAdvancedTime(); }

  void State(double* q, double* u) const override {
    const SimTK::State& state = integrator_->getAdvancedState();
    for (const Mobilizer& one : model_.mobilizers) {
      for (int i = 0; i < one.num_q; ++i) q[one.q + i] = one.sign * one.body.getOneQ(state, i);
      for (int i = 0; i < one.num_u; ++i) u[one.u + i] = one.sign * one.body.getOneU(state, i);
    }
  }

  Counts counts() const override {
    if (!integrator_) return {};
    return {integrator_->getNumStepsTaken(),
            integrator_->getNumStepsAttempted() - integrator_->getNumStepsTaken(),
            integrator_->getNumRealizations(), integrator_->getNumProjections()};
  }

 private:
  void Set(const double* q, const double* u, SimTK::State& state) const {
    for (const Mobilizer& one : model_.mobilizers) {
      for (int i = 0; i < one.num_q; ++i) one.body.setOneQ(state, i, one.sign * q[one.q + i]);
      for (int i = 0; i < one.num_u; ++i) one.body.setOneU(state, i, one.sign * u[one.u + i]);
    }
  }

  SimbodyModel model_;
  SimTK::State state_;
  std::unique_ptr<SimTK::RungeKuttaMersonIntegrator> integrator_;
  double t_end_ = 0.0;
};

}  // namespace

std::unique_ptr<Program> MakeSimbodyProgram(const exchange::Model& model) {
  return std::make_unique<SimbodyProgram>(model);
}

}  // namespace loopbench::peers
