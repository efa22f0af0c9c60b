// Poses of the bodies of an AssemblySweep at their angles, and violations of cut joints from points
// along the tree.
#include <algorithm>
#include <cmath>

#include "odca/assembly_sweep.h"
#include "odca/sines.h"

namespace loopbench::odca::pins {

template <AssemblySweep::Gaps kGaps>
bool AssemblySweep::Turn() {
  const int places = static_cast<int>(angle_.size());
  if (!SinesAndCosines(angle_.data(), places, sine_.data(), cosine_.data())) return false;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    const double s = sine_[i], c = cosine_[i];
    for (int h = body.first_handle; h < body.first_handle + body.handles; ++h) {
      const Vector& arm = handles_[h];
      arm_[h] = {arm.x * c - arm.y * s, arm.x * s + arm.y * c};
    }
  }
  if (!cuts_.empty()) Close<kGaps>();
  return true;
}

/// A cut joint is imposed at a point of Q; there the arm of P ends (two_handle.h).
template <AssemblySweep::Gaps kGaps>
void AssemblySweep::Close() {
  const auto leads = [&](int body, int handle) {
    const Vector r = Scaled(bodies_[body].link.radius, arm_[handle]);
    return Point<double>{r, Cross(speed_[body], r)};
  };
  for (const Step& step : steps_) {
    reference_[step.child] = reference_[step.parent] + leads(step.parent, step.parent_handle) -
                             leads(step.child, step.child_handle);
  }
  for (CutJoint& cut : cuts_) {
    const auto at = [&](int body, int handle) {
      return body < 0 ? Point<double>{cut.ground, {}} : reference_[body] + leads(body, handle);
    };
    const Point<double> gap = at(cut.body_Q, cut.Q) - at(cut.body_P, cut.P);
    cut.w_P = cut.body_P < 0 ? 0.0 : speed_[cut.body_P];
    cut.v = kGaps == Gaps::kSpeeds ? RelativeVelocity(cut.w_P, gap) : gap.p;
    if (cut.body_P >= 0) {
      arm_[cut.P] = arm_[cut.P] + Scaled(1.0 / bodies_[cut.body_P].link.radius, gap.p);
    }
  }
}

double AssemblySweep::LargestGap() const {
  double largest = 0.0;
  for (const CutJoint& cut : cuts_) {
    largest = std::max(largest, cut.v.x * cut.v.x + cut.v.y * cut.v.y);
  }
  return std::sqrt(largest);
}

template bool AssemblySweep::Turn<AssemblySweep::Gaps::kSpeeds>();
template bool AssemblySweep::Turn<AssemblySweep::Gaps::kPositions>();

}  // namespace loopbench::odca::pins
