#include "harness/precision/certify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace loopbench::harness {
namespace {

template <class Space, class S>
S AngleBetween(const Pose<Space, S>& a, const Pose<Space, S>& b) {
  using std::abs;
  if constexpr (Space::kRot == 1) {
    return abs(a.angle - b.angle);
  } else {
    using std::asin;
    using std::min;
    using std::sqrt;
    S squares = S(0);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const S off = a.R(i, j) - b.R(i, j);
        squares += off * off;
      }
    }
    return S(2) * asin(min(S(1), S(sqrt(squares / S(8)))));
  }
}

template <class Space, class S>
WideDistance<S> DistanceOf(const Moment<Space, S>& a, const Moment<Space, S>& b) {
  using std::abs;
  using std::max;
  WideDistance<S> d;
  for (std::size_t i = 1; i < a.poses.size(); ++i) {
    d.position = max(d.position, S((a.poses[i].p - b.poses[i].p).norm()));
    d.rotation = max(d.rotation, AngleBetween<Space, S>(a.poses[i], b.poses[i]));
    d.velocity = max(d.velocity, S((a.motions[i].linear - b.motions[i].linear).norm()));
    d.angular_velocity =
        max(d.angular_velocity, S((a.motions[i].angular - b.motions[i].angular).norm()));
  }
  d.energy = abs(a.energy - b.energy);
  return d;
}

template <class S>
WideDistance<S> Larger(const WideDistance<S>& a, const WideDistance<S>& b) {
  using std::max;
  return {max(a.position, b.position), max(a.rotation, b.rotation), max(a.velocity, b.velocity),
          max(a.angular_velocity, b.angular_velocity), max(a.energy, b.energy)};
}

template <class S>
WideDistance<S> Bound(const WideDistance<S>& a, const WideDistance<S>& b) {
  const S safety = S(kSafety);
  WideDistance<S> bound = Larger(a, b);
  for (S* value : {&bound.position, &bound.rotation, &bound.velocity, &bound.angular_velocity,
                   &bound.energy}) {
    *value *= safety;
  }
  return bound;
}

}  // namespace

template <class Space, class S>
Certified<Space, S> Certify(const MechanismDescription& description,
                            const std::vector<double>& times, double cpu_s, PutBack put_back) {
  const S tightest = S(Tightest<S>(put_back)) * std::numeric_limits<S>::epsilon();
  Certified<Space, S> result;
  result.witnesses = put_back == PutBack::kAtStages ? "gragg, stages put back," : "gragg";
  std::vector<double> followed = times;
  const auto follow = [&](const char* formulation, double factor, int fewer) {
    const WitnessOptions<S> options{formulation, S(factor) * tightest, fewer, put_back, cpu_s};
    Witness<Space, S> witness = Follow<Space, S>(description, options, followed);
    result.witnesses += fmt::format(" {} {:.2g}", formulation, double(options.tolerance));
    result.rhs_evaluations += witness.rhs_evaluations;
    result.cpu_s += witness.cpu_s;
    if (witness.outcome != Outcome::kFinished && result.outcome == Outcome::kFinished) {
      result.outcome = witness.outcome;
      result.message = witness.message;
    }
    followed.resize(witness.moments.size());
    return witness;
  };
  result.reference = follow("lagrange", 1.0, 0);
  if (followed.size() < 2) return result;  // nothing moves
  const Witness<Space, S> looser = follow("lagrange", kLooser, 1);
  if (followed.size() < 2) return result;
  const Witness<Space, S> other = follow("odca", kBetween, 2);
  for (std::size_t k = 0; k < followed.size(); ++k) {
    const Moment<Space, S>& own = result.reference.moments[k];
    WideDistance<S> bound = Bound(DistanceOf<Space, S>(own, looser.moments[k]),
                                  DistanceOf<Space, S>(own, other.moments[k]));
    // witnesses may meet by chance; a bound that was reached stays
    if (k > 0) bound = Larger(bound, result.bounds.back());
    result.bounds.push_back(bound);
  }
  return result;
}

#define LOOPBENCH_INSTANTIATE(SPACE, S)                                       \
  template Certified<SPACE, S> Certify<SPACE, S>(const MechanismDescription&, \
                                                 const std::vector<double>&, double, PutBack);
LOOPBENCH_INSTANTIATE(Planar, long double)
LOOPBENCH_INSTANTIATE(Planar, ::loopbench::Float128)
LOOPBENCH_INSTANTIATE(Spatial, long double)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::harness
