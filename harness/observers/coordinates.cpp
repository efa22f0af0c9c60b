#include <algorithm>
#include <limits>

#include "harness/observers/observer.h"

namespace loopbench::harness {

template <class Space>
void CoordinateObserver<Space>::Observe(const Sample<Space>& sample) {
  const Kinematics<Space, double>& kinematics = sample.formulation.kinematics();
  const auto& joints = kinematics.mechanism().joints();
  constexpr std::size_t kMostJoints = 1000;
  if (joints.size() > kMostJoints) return;
  const bool first = series_.empty();
  std::size_t s = 0;
  for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
    if (joints[j].description < 0 || joints[j].kind->num_u != 1) continue;
    if (first) {
      // motions have their rotations first; a helix is told by its angle
      const bool shifts = joints[j].kind->axes[0] >= Space::kRot;
      keys_.push_back((shifts ? "displacement." : "angle.") +
                      kinematics.mechanism().joint_names()[j]);
      (shifts ? shifts_ : angles_).push_back(s);
      series_.emplace_back();
    }
    series_[s].t.push_back(sample.t);
    series_[s].value.push_back(kinematics.JointCoordinate(j));
    ++s;
  }
}

template <class Space>
void CoordinateObserver<Space>::WriteOpening(std::size_t samples, const std::string& prefix,
                                             const std::string& time, Record& record) const {
  for (std::size_t s = 0; s < series_.size(); ++s) {
    const TimeSeries thin = Thin(series_[s], points_, samples);
    if (s == 0) record.Set(time, thin.t);
    record.Set(prefix + keys_[s], thin.value);
  }
}

template <class Space>
bool CoordinateObserver<Space>::Shows(const std::vector<std::size_t>& group,
                                      std::size_t samples) const {
  if (samples <= static_cast<std::size_t>(points_)) return true;
  // a hundredth of the axis is four pixels of a figure
  constexpr double kVisible = 0.01;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const std::size_t s : group) {
    for (std::size_t i = 0; i < samples; ++i) {
      low = std::min(low, series_[s].value[i]);
      high = std::max(high, series_[s].value[i]);
    }
  }
  return std::ranges::all_of(group, [&](std::size_t s) {
    return LargestGap(series_[s], points_, samples) <= kVisible * (high - low);
  });
}

template <class Space>
void CoordinateObserver<Space>::Write(Record& record) const {
  if (series_.empty()) return;
  const std::size_t all = series_[0].t.size();
  WriteOpening(all, "series.", "series.t", record);
  std::size_t shown = all;
  while (!Shows(angles_, shown) || !Shows(shifts_, shown)) shown /= 2;
  if (shown < all) WriteOpening(shown, "series.opening.", "series.opening_t", record);
}

template class CoordinateObserver<Planar>;
template class CoordinateObserver<Spatial>;

}  // namespace loopbench::harness
