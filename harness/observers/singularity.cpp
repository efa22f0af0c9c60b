#include <algorithm>

#include "harness/observers/joint_view.h"
#include "harness/observers/observer.h"
#include "mechanism/scaled_loops.h"

namespace loopbench::harness {

namespace {

/// Rows and speeds up to which every accepted step can afford a dense decomposition (some 0.1 ms).
constexpr int kMostRows = 24, kMostSpeeds = 64;

}  // namespace

template <class Space>
struct SingularityObserver<Space>::Work {
  Work(const MechanismDescription& description, const Mechanism<Space, double>& mechanism)
      : view(description, mechanism) {}

  JointView<Space> view;
  /// Of each singular value, the largest first: its smallest ratio to the largest and when.
  std::vector<double> smallest, when;
  int generic_rank = 0;
};

template <class Space>
SingularityObserver<Space>::SingularityObserver(const MechanismDescription& description,
                                                const Mechanism<Space, double>& mechanism)
    : work_(std::make_unique<Work>(description, mechanism)) {}

template <class Space>
SingularityObserver<Space>::~SingularityObserver() = default;

template <class Space>
void SingularityObserver<Space>::Observe(const Sample<Space>& sample) {
  Work& work = *work_;
  const int rows = work.view.mechanism().num_rows(), speeds = work.view.mechanism().num_u();
  if (rows == 0 || rows > kMostRows || speeds == 0 || speeds > kMostSpeeds) return;
  const LoopSpectrum now = SpectrumOfLoops(work.view.At(sample.formulation.kinematics()));
  const std::size_t count = static_cast<std::size_t>(now.singular_values.size());
  if (work.smallest.empty()) {
    work.smallest.assign(count, 1.0);
    work.when.assign(count, sample.t);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const double ratio = now.singular_values[i] / now.largest;
    if (ratio >= work.smallest[i]) continue;
    work.smallest[i] = ratio;
    work.when[i] = sample.t;
  }
  work.generic_rank = std::max(work.generic_rank, now.rank);
}

template <class Space>
void SingularityObserver<Space>::Write(Record& record) const {
  if (work_->generic_rank == 0) return;
  const std::size_t last = static_cast<std::size_t>(work_->generic_rank) - 1;
  record.Set("singularity_distance_min", work_->smallest[last]);
  record.Set("singularity_distance_min_t", work_->when[last]);
}

template class SingularityObserver<Planar>;
template class SingularityObserver<Spatial>;

}  // namespace loopbench::harness
