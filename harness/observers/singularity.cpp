#include <algorithm>
#include <array>
#include <cmath>

#include "harness/observers/joint_view.h"
#include "harness/observers/observer.h"
#include "mechanism/loops/scaled_loops.h"

namespace loopbench::harness {

namespace {

/// Rows and speeds up to which every accepted step can afford a dense decomposition (some 0.1 ms).
constexpr int kMostRows = 24, kMostSpeeds = 64;

/// Counts the zeros that a quantity passed of which only the size is seen, sample by sample.
class Passages {
 public:
  void Add(double t, double size) {
    // at the position itself once, however long the run stays
    if (size < kRankRatio) {
      if (num_ == 0 || size_[num_ - 1] >= kRankRatio) ++count_;
      num_ = 0;
    } else if (num_ == 2 && t > t_[1]) {
      const double a = (size_[1] - size_[0]) / (t_[1] - t_[0]), b = (size - size_[1]) / (t - t_[1]);
      // slopes with the sign changed behind the first sample, or behind the second
      const double a_turned = -(size_[1] + size_[0]) / (t_[1] - t_[0]);
      const double b_turned = -(size + size_[1]) / (t - t_[1]);
      const double bend = std::min(std::abs(-b - a_turned), std::abs(b_turned - a));
      if (a <= 0.0 && b >= 0.0 && bend < std::abs(b - a)) ++count_;
    }
    if (num_ == 2) {
      t_[0] = t_[1];
      size_[0] = size_[1];
      num_ = 1;
    }
    t_[num_] = t;
    size_[num_++] = size;
  }
  /// The next value is of another quantity.
  void Forget() { num_ = 0; }
  std::int64_t count() const { return count_; }

 private:
  std::array<double, 2> t_ = {}, size_ = {};
  std::size_t num_ = 0;
  std::int64_t count_ = 0;
};

}  // namespace

template <class Space>
struct SingularityObserver<Space>::Work {
  Work(const MechanismDescription& description, const Mechanism<Space, double>& mechanism)
      : view(description, mechanism, false) {}  // released rows gain rank as they drift

  JointView<Space> view;
  /// Of each singular value, the largest first: its smallest ratio to the largest and when.
  std::vector<double> smallest, when;
  int generic_rank = 0;
  std::vector<Released> released;  ///< of the last sample
  Passages passages;
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
  if (now.rank > work.generic_rank) work.passages = {};  // another quantity from here on
  work.generic_rank = std::max(work.generic_rank, now.rank);
  const std::vector<Released>& released = sample.formulation.kinematics().released();
  if (work.released != released) {
    work.passages.Forget();
    work.released = released;
  }
  if (work.generic_rank == 0) return;
  const auto last = static_cast<Eigen::Index>(work.generic_rank) - 1;
  work.passages.Add(sample.t, now.singular_values[last] / now.largest);
}

template <class Space>
void SingularityObserver<Space>::Write(Record& record) const {
  if (work_->generic_rank == 0) return;
  const std::size_t last = static_cast<std::size_t>(work_->generic_rank) - 1;
  record.Set("singularity_distance_min", work_->smallest[last]);
  record.Set("singularity_distance_min_t", work_->when[last]);
  record.Set("singularity_passages", work_->passages.count());
}

template class SingularityObserver<Planar>;
template class SingularityObserver<Spatial>;

}  // namespace loopbench::harness
