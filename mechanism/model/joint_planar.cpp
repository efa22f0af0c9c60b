#include "mechanism/algebra/instantiate.h"
#include "mechanism/model/joint_kinds.h"

namespace loopbench {

namespace {

template <class S>
struct Kinds {
  using P = Pose<Planar, S>;

  /// The kind whose free directions are the first `kNumU` of these axes of F: the turn (0) or none,
  /// then shifts.
  template <int kNumU, int... kAxes>
  static JointKind<Planar, S> Along() {
    static constexpr int kAxis[] = {kAxes...};
    static constexpr int kTurns = kNumU > 0 && kAxis[0] == 0 ? 1 : 0;
    JointKind<Planar, S> kind;
    kind.num_q = kind.num_u = kNumU;
    kind.axes = {kAxes...};
    kind.rotation_invariant = kNumU == kTurns;
    kind.transform = [](const S* q, P& X, S) {
      X.angle = kTurns == 1 ? q[0] : S(0);
      X.p.setZero();
      for (int i = kTurns; i < kNumU; ++i) X.p[kAxis[i] - 1] = q[i];
    };
    kind.coordinates = [](const P& X, S* q, S) {
      if constexpr (kTurns == 1) q[0] = X.angle;
      for (int i = kTurns; i < kNumU; ++i) q[i] = X.p[kAxis[i] - 1];
    };
    kind.rates = SameRates<S, kNumU>;
    return kind;
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
  return {K::template Along<1, 0, 1, 2>(),  // revolute
          K::template Along<1, 1, 0, 2>(),  // prismatic
          K::template Along<0, 0, 1, 2>(),  // weld
          K::template Along<3, 0, 1, 2>(),  // free
          K::template Along<2, 0, 1, 2>(),  // pin-in-slot
          K::Rod()};
}

#define LOOPBENCH_INSTANTIATE(S) template std::vector<JointKind<Planar, S>> PlanarKinds();
LOOPBENCH_FOR_EACH_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
