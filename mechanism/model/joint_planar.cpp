#include "mechanism/algebra/instantiate.h"
#include "mechanism/model/joint_kinds.h"

namespace loopbench {

namespace {

template <class S>
struct Kinds {
  using P = Pose<Planar, S>;

  static JointKind<Planar, S> Revolute() {
    return {.num_q = 1,
            .num_u = 1,
            .axes = {0, 1, 2},
            .rotation_invariant = true,
            .transform =
                [](const S* q, P& X, S) {
                  X.angle = q[0];
                  X.p.setZero();
                },
            .coordinates = [](const P& X, S* q, S) { q[0] = X.angle; },
            .rates = SameRates<S, 1>};
  }
  static JointKind<Planar, S> Prismatic() {
    return {.num_q = 1,
            .num_u = 1,
            .axes = {1, 0, 2},
            .rotation_invariant = false,
            .transform =
                [](const S* q, P& X, S) {
                  X.angle = S(0);
                  X.p = {q[0], S(0)};
                },
            .coordinates = [](const P& X, S* q, S) { q[0] = X.p[0]; },
            .rates = SameRates<S, 1>};
  }
  static JointKind<Planar, S> Weld() {
    return {.num_q = 0,
            .num_u = 0,
            .axes = {0, 1, 2},
            .rotation_invariant = true,
            .transform = [](const S*, P& X, S) { X = P(); },
            .coordinates = [](const P&, S*, S) {},
            .rates = SameRates<S, 0>};
  }
  static JointKind<Planar, S> Free() {
    return {.num_q = 3,
            .num_u = 3,
            .axes = {0, 1, 2},
            .rotation_invariant = false,
            .transform =
                [](const S* q, P& X, S) {
                  X.angle = q[0];
                  X.p = {q[1], q[2]};
                },
            .coordinates =
                [](const P& X, S* q, S) {
                  q[0] = X.angle;
                  q[1] = X.p[0];
                  q[2] = X.p[1];
                },
            .rates = SameRates<S, 3>};
  }
  static JointKind<Planar, S> PinInSlot() {
    return {.num_q = 2,
            .num_u = 2,
            .axes = {0, 1, 2},
            .rotation_invariant = false,
            .transform =
                [](const S* q, P& X, S) {
                  X.angle = q[0];
                  X.p = {q[1], S(0)};
                },
            .coordinates =
                [](const P& X, S* q, S) {
                  q[0] = X.angle;
                  q[1] = X.p[0];
                },
            .rates = SameRates<S, 2>};
  }

  static JointKind<Planar, S> Rod() {
    return {.num_q = 0,
            .num_u = 2,
            .axes = {0, 1, 2},
            .rotation_invariant = false,
            .basis =
                [](const P& X, Basis<Planar, S>& basis_F, S) {
                  const Linear<Planar, S> n = X.p.normalized();
                  basis_F[0] = Direction<Planar, S>::Unit(0);
                  basis_F[1] = {Angular<Planar, S>::Zero(), {-n[1], n[0]}};
                  basis_F[2] = {Angular<Planar, S>::Zero(), n};
                },
            .bias = RodBias<Planar, S>};
  }
};

}  // namespace

template <class S>
std::vector<JointKind<Planar, S>> PlanarKinds() {
  using K = Kinds<S>;
  return {K::Revolute(), K::Prismatic(), K::Weld(), K::Free(), K::PinInSlot(), K::Rod()};
}

#define LOOPBENCH_INSTANTIATE(S) template std::vector<JointKind<Planar, S>> PlanarKinds();
LOOPBENCH_FOR_EACH_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
