#include "mechanism/formulation/forward_jacobian.h"

#include <algorithm>

#include "mechanism/description/registration.h"

namespace loopbench {

template <class Space>
ForwardJacobian<Space>::ForwardJacobian(const MechanismDescription& description,
                                        System<Space, double>& system)
    : system_(system),
      mechanism_(description, system.mechanism().coordinates()),
      kinematics_(mechanism_),
      dynamics_(mechanism_),
      drives_(mechanism_),
      q_(VectorX<Dual>::Zero(mechanism_.num_q())),
      u_(VectorX<Dual>::Zero(mechanism_.num_u())),
      qdot_(q_),
      udot_(u_),
      lambda_(VectorX<Dual>::Zero(mechanism_.num_equations())),
      force_left_(u_),
      constraint_left_(lambda_),
      lambda_now_(VectorX<double>::Zero(mechanism_.num_equations())),
      force_(VectorX<double>::Zero(mechanism_.num_u())),
      target_(lambda_now_),
      x_(force_),
      lambda_x_(lambda_now_) {
  const LevelTraits& level = TraitsOf(system.options().enforcement);
  if (!level.has_derivative) {
    RefuseRow("level", level.name, "a forward Jacobian", "difference quotients: no derivative");
  }
}

template <class Space>
int ForwardJacobian<Space>::evaluations() const {
  return (system_.state_size() + Dual::kWidth - 1) / Dual::kWidth;
}

template <class Space>
void ForwardJacobian<Space>::Evaluate(Eigen::Ref<MatrixX<double>> jacobian) {
  kinematics_.SetTime(system_.kinematics().time());
  kinematics_.CountTurnsLike(system_.kinematics());
  if (const auto& released = system_.kinematics().released(); released != kinematics_.released()) {
    kinematics_.Release(released);
  }
  lambda_now_ = system_.Multipliers();
  const int size = system_.state_size();
  for (int first = 0; first < size; first += Dual::kWidth) {
    const int count = std::min(Dual::kWidth, size - first);
    Seed(first, count);
    kinematics_.UpdatePosition(q_);
    if (const auto* stress = system_.stress()) stress->Turn(kinematics_);
    kinematics_.UpdateVelocity(u_);
    if (system_.level().changes_speeds()) ProjectSpeeds(count);
    if (mechanism_.num_u() > 0) Accelerate(count);
    Write(first, count, jacobian);
  }
}

template <class Space>
void ForwardJacobian<Space>::Seed(int first, int count) {
  q_ = system_.q().template cast<Dual>();
  u_ = system_.u().template cast<Dual>();
  for (int k = 0; k < count; ++k) {
    const int i = first + k - mechanism_.num_q();
    (i < 0 ? q_[first + k] : u_[system_.state_speed(i)]).SetPartial(k, 1.0);
  }
}

template <class Space>
void ForwardJacobian<Space>::ProjectSpeeds(int count) {
  for (int index : mechanism_.constraints()) {
    const int row = mechanism_.joints()[index].row;
    const int rows = mechanism_.joints()[index].num_constraints();
    constraint_left_.segment(row, rows) = kinematics_.ConstraintSpeed(index).head(rows);
  }
  for (int c = 0; c < static_cast<int>(mechanism_.couplings().size()); ++c) {
    constraint_left_[mechanism_.num_rows() + c] = kinematics_.CouplingSpeed(c);
  }
  for (int k = 0; k < count && mechanism_.num_u() > 0; ++k) {
    for (int r = 0; r < target_.size(); ++r) target_[r] = -constraint_left_[r].partial(k);
    system_.solver().Correct(target_, x_);
    for (int i = 0; i < x_.size(); ++i) u_[i].SetPartial(k, u_[i].partial(k) + x_[i]);
  }
  kinematics_.UpdateVelocity(u_);
}

template <class Space>
void ForwardJacobian<Space>::Accelerate(int count) {
  udot_ = system_.udot().template cast<Dual>();
  lambda_ = lambda_now_.template cast<Dual>();
  dynamics_.Residual(kinematics_, udot_, lambda_, force_left_, constraint_left_);
  const BaumgarteGains& gains = system_.level().gains();
  if (gains != BaumgarteGains()) AddFeedback(kinematics_, gains, constraint_left_);
  for (int k = 0; k < count; ++k) {
    for (int i = 0; i < force_.size(); ++i) force_[i] = -force_left_[i].partial(k);
    for (int r = 0; r < target_.size(); ++r) target_[r] = -constraint_left_[r].partial(k);
    system_.solver().Solve(force_, target_, x_, &lambda_x_);
    for (int i = 0; i < x_.size(); ++i) udot_[i].SetPartial(k, x_[i]);
    for (int r = 0; r < lambda_x_.size(); ++r) lambda_[r].SetPartial(k, lambda_x_[r]);
  }
}

template <class Space>
void ForwardJacobian<Space>::Write(int first, int count, Eigen::Ref<MatrixX<double>> jacobian) {
  const int num_q = mechanism_.num_q(), size = system_.state_size();
  mechanism_.Rates(q_, u_, qdot_);
  for (int i = 0; i < size; ++i) {
    const Dual& rate = i < num_q ? qdot_[i] : udot_[system_.state_speed(i - num_q)];
    for (int k = 0; k < count; ++k) jacobian(i, first + k) = rate.partial(k);
  }
  if (jacobian.rows() == size) return;
  Power<Dual> power = AppliedPower(kinematics_);
  if (!mechanism_.drives().empty()) power.supplied += drives_.Power(kinematics_, udot_, lambda_);
  for (int k = 0; k < count; ++k) {
    jacobian(size, first + k) = power.supplied.partial(k);
    jacobian(size + 1, first + k) = power.dissipated.partial(k);
  }
}

template class ForwardJacobian<Planar>;
template class ForwardJacobian<Spatial>;

}  // namespace loopbench
