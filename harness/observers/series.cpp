// Series of a run, and the observers of coordinates, corrections, step lengths and springs.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "harness/observers/observer.h"
#include "mechanism/model/force_elements.h"

namespace loopbench::harness {
namespace {

// Returns the kept indices of `n` samples: evenly spaced, always with the last one.
std::vector<std::size_t> Kept(std::size_t n, int points) {
  const std::size_t count = std::min(n, static_cast<std::size_t>(points));
  std::vector<std::size_t> kept(count);
  for (std::size_t i = 0; i < count; ++i) kept[i] = count == n ? i : i * (n - 1) / (count - 1);
  return kept;
}

}  // namespace

TimeSeries Thin(const TimeSeries& series, int points, std::size_t samples) {
  TimeSeries thin;
  for (const std::size_t k : Kept(std::min(samples, series.t.size()), points)) {
    thin.t.push_back(series.t[k]);
    thin.value.push_back(series.value[k]);
  }
  return thin;
}

namespace {

/// The largest distance of the first `samples` from the line through those that Thin() keeps.
double LargestGap(const TimeSeries& series, int points, std::size_t samples) {
  const std::vector<std::size_t> kept = Kept(samples, points);
  double gap = 0.0;
  for (std::size_t i = 1; i < kept.size(); ++i) {
    const std::size_t a = kept[i - 1], b = kept[i];
    const double slope = (series.value[b] - series.value[a]) / (series.t[b] - series.t[a]);
    for (std::size_t k = a + 1; k < b; ++k) {
      const double line = series.value[a] + slope * (series.t[k] - series.t[a]);
      gap = std::max(gap, std::abs(series.value[k] - line));
    }
  }
  return gap;
}

/// Joint coordinates over time, of mechanisms with few of them, for figures: "series.angle.JOINT"
/// [rad] and "series.displacement.JOINT" [m] over "series.t", for the whole run. These few points
/// may not show the motion: a straight line between two of them misses a sample by more than 1 % of
/// all angles or displacements. Then the same number of points covers its first half, quarter, ...
/// that they do show: "series.opening.angle.JOINT" and so on over "series.opening_t".
template <class Space>
class CoordinateObserver final : public Observer<Space> {
 public:
  explicit CoordinateObserver(int points) : points_(points) {}

  void Observe(const Sample<Space>& sample) override {
    const Kinematics<Space, double>& kinematics = sample.formulation.kinematics();
    const auto& joints = kinematics.mechanism().joints();
    constexpr std::size_t kMaxJoints = 1000;
    if (joints.size() > kMaxJoints) return;
    const bool first = series_.empty();
    std::size_t s = 0;
    for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
      if (joints[j].description < 0 || joints[j].kind->num_u != 1) continue;
      if (first) {
        // motions have their rotations first; a helix is measured by its angle
        const bool shifts = joints[j].kind->axes[0] >= Space::kRot;
        keys_.push_back((shifts ? "displacement." : "angle.") +
                        kinematics.mechanism().joint_names()[j]);
        (shifts ? shifts_ : angles_).push_back(s);
        series_.emplace_back();
      }
      series_[s++].Add(sample.t, kinematics.JointCoordinate(j));
    }
  }

  void Write(Record& record) const override {
    if (series_.empty()) return;
    const std::size_t all = series_[0].t.size();
    WriteOpening(all, "series.", "series.t", record);
    std::size_t shown = all;
    while (!Shows(angles_, shown) || !Shows(shifts_, shown)) shown /= 2;
    if (shown < all) WriteOpening(shown, "series.opening.", "series.opening_t", record);
  }

 private:
  /// Returns true if the points kept of the first `samples` show them, on the group's common axis.
  bool Shows(const std::vector<std::size_t>& group, std::size_t samples) const {
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

  void WriteOpening(std::size_t samples, const std::string& prefix, const std::string& time,
                    Record& record) const {
    for (std::size_t s = 0; s < series_.size(); ++s) {
      const TimeSeries thin = Thin(series_[s], points_, samples);
      if (s == 0) record.Set(time, thin.t);
      record.Set(prefix + keys_[s], thin.value);
    }
  }

  int points_;
  std::vector<std::string> keys_;             ///< "angle.crank", as their series
  std::vector<std::size_t> angles_, shifts_;  ///< which series are
  std::vector<TimeSeries> series_;
};

/// Corrections and cost of projections (levels without drift): the largest violation of points [m],
/// its series, and Newton steps. Writes nothing at other levels.
template <class Space>
class CorrectionObserver final : public Observer<Space> {
 public:
  void Observe(const Sample<Space>& sample) override {
    if (TraitsOf(sample.formulation.options().enforcement).growth != DriftGrowth::kNone) return;
    const Correction<double>& correction = sample.formulation.level().correction();
    largest_ = std::max(largest_, correction.shift);
    iterations_ += correction.iterations;
    series_.Add(sample.t, correction.shift);
  }

  void Write(Record& record) const override {
    if (series_.t.empty()) return;
    record.Set("correction_max", largest_);
    record.Set("projection_iterations", iterations_);
  }

  void Trace(Traces& traces) const override {
    traces.correction = series_;
    traces.projection_steps = iterations_;
  }

 private:
  double largest_ = 0.0;
  std::int64_t iterations_ = 0;
  TimeSeries series_;
};

/// The largest angular frequency [rad/s] of prescribed motions and of forces that are harmonic in
/// time; 0 without any. Tables have knots, at which steps end.
double FastestDrive(const MechanismDescription& description) {
  double fastest = 0.0;
  const auto look = [&](const TimeFunctionDescription& value) {
    const auto* harmonic = std::get_if<Harmonic>(&value);
    if (harmonic == nullptr || harmonic->amplitude == 0.0) return;
    fastest = std::max(fastest, std::abs(harmonic->omega));
  };
  for (const JointDescription& joint : description.joints) {
    for (const PrescribedMotion& motion : joint.motions) look(motion.value);
  }
  for (ForceDescription force : description.forces) {
    if (const TimeFunctionDescription* value = PartsOf(force).value) look(*value);
  }
  return fastest;
}

/// Lengths of accepted steps, and the fastest prescribed function of time: an error estimate does
/// not detect events between the points of a step. The shortest step excludes those clipped by a
/// stop time or the end.
template <class Space>
class StepLengthObserver final : public Observer<Space> {
 public:
  explicit StepLengthObserver(const Watched<Space>& run)
      : stops_(run.stops.begin(), run.stops.end()), fastest_(FastestDrive(run.description)) {}

  void Observe(const Sample<Space>& sample) override {
    if (last_ > 0.0 && !std::ranges::binary_search(stops_, t_) &&
        (shortest_ == 0.0 || last_ < shortest_)) {
      shortest_ = last_;
      shortest_t_ = t_;
    }
    last_ = sample.t - t_;
    t_ = sample.t;
    longest_ = std::max(longest_, last_);
  }

  void Write(Record& record) const override {
    if (longest_ == 0.0) return;
    record.Set("step_longest", longest_);
    if (shortest_ > 0.0) {
      record.Set("step_shortest", shortest_);
      record.Set("step_shortest_t", shortest_t_);
    }
    if (fastest_ > 0.0) record.Set("drive_frequency", fastest_);
  }

 private:
  std::vector<double> stops_;    ///< [s], rising
  double fastest_;               ///< [rad/s]
  double t_ = 0.0, last_ = 0.0;  ///< of the last step, which the end may have clipped
  double longest_ = 0.0, shortest_ = 0.0, shortest_t_ = 0.0;
};

/// Springs with a force at zero length: it jumps where their points coincide. Counts, for
/// each spring, the start and ends of steps there, and steps in which the direction is reversed.
template <class Space>
class SpringObserver final : public Observer<Space> {
 public:
  explicit SpringObserver(const Watched<Space>& run)
      : description_(run.description), coincident_(kCoincident * run.mechanism.length()) {
    for (std::size_t i = 0; i < run.description.forces.size(); ++i) {
      const auto* spring = std::get_if<SpringDamper>(&run.description.forces[i]);
      if (spring == nullptr || TensionAtZeroLength(*spring) == 0.0) continue;
      springs_.push_back(
          {i, {spring->from, run.description}, {spring->to, run.description}, {}, {}});
      springs_.back().apart.setZero();
      springs_.back().speed.setZero();
    }
  }

  void Observe(const Sample<Space>& sample) override {
    const Kinematics<Space, double>& kinematics = sample.formulation.kinematics();
    for (Spring& spring : springs_) {
      const PointState<Space, double> from = spring.from.StateIn(kinematics);
      const PointState<Space, double> to = spring.to.StateIn(kinematics);
      const Linear<Space, double> before = std::exchange(spring.apart, to.p - from.p);
      const Linear<Space, double> speed_before = std::exchange(spring.speed, to.v - from.v);
      const Linear<Space, double> chord = spring.apart - before;
      const double length = spring.apart.norm();
      // a spring that turns with its body moves across the chord, one that passes zero along it
      const auto is_along = [&](const Linear<Space, double>& v) {
        return chord.dot(v) >= 0.5 * chord.norm() * v.norm();
      };
      const bool is_reversed = spring.apart.dot(before) < kReversed * length * before.norm() &&
                               (is_along(speed_before) || is_along(spring.speed));
      if (length > coincident_ && !is_reversed) continue;
      if (reversals_++ > 0) continue;
      first_ = spring.force;
      first_t_ = sample.t;
    }
  }

  void Write(Record& record) const override {
    if (reversals_ == 0) return;
    record.Set("spring_reversals", reversals_);
    record.Set("spring_reversal", NameOfForce(description_, first_));
    record.Set("spring_reversal_t", first_t_);
  }

 private:
  static constexpr double kReversed = -0.9;  ///< cosine of the turn within a step

  struct Spring {
    std::size_t force;
    PointOfBody<Space, double> from, to;
    Linear<Space, double> apart, speed;  ///< at the last step; 0 before the first one
  };
  const MechanismDescription& description_;
  double coincident_;  ///< [m]
  std::vector<Spring> springs_;
  std::int64_t reversals_ = 0;
  std::size_t first_ = 0;
  double first_t_ = 0.0;  ///< [s]
};

}  // namespace

template <class Space>
void AddSeriesObservers(const Watched<Space>& run,
                        std::vector<std::unique_ptr<Observer<Space>>>* all) {
  all->push_back(std::make_unique<CoordinateObserver<Space>>(run.points));
  all->push_back(std::make_unique<CorrectionObserver<Space>>());
  all->push_back(std::make_unique<StepLengthObserver<Space>>(run));
  all->push_back(std::make_unique<SpringObserver<Space>>(run));
}

template void AddSeriesObservers(const Watched<Planar>&,
                                 std::vector<std::unique_ptr<Observer<Planar>>>*);
template void AddSeriesObservers(const Watched<Spatial>&,
                                 std::vector<std::unique_ptr<Observer<Spatial>>>*);

}  // namespace loopbench::harness
