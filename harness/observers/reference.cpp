#include "harness/observers/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>
#include <span>
#include <stdexcept>

#include "harness/base/record.h"
#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Returns true if a body or joint moves in a part (-1: in any).
bool BelongsTo(const auto& image, int part) {
  return image.part >= 0 && (part < 0 || image.part == part);
}

/// The angle of the rotation from one orientation to the other [rad], to the last digit for small
/// ones: |R_a - R_b| = 2 sqrt(2) sin(angle / 2).
double AngleBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return 2 * std::asin(std::min(1.0, (a - b).norm() / (2 * std::numbers::sqrt2)));
}

}  // namespace

bool IsLength(const MechanismDescription& user, std::size_t joint) {
  const auto words = ValueWords(user.joints[joint].type, user.space, false);
  return !words.empty() && words.front().is_length();
}

std::vector<MeasuredPoint> PointsOf(const MechanismDescription& user) {
  std::vector<MeasuredPoint> points;
  for (std::size_t i = 1; i < user.bodies.size(); ++i) {
    points.push_back({i, Eigen::Vector3d::Zero()});
    points.push_back({i, user.bodies[i].com});
    for (const auto& [name, at] : user.bodies[i].points) points.push_back({i, at});
  }
  return points;
}

Snapshot EmptySnapshot(const Measured& measured) {
  Snapshot snapshot;
  snapshot.bodies.resize(measured.user.bodies.size());
  for (std::size_t i = 0; i < measured.compiled.bodies.size(); ++i) {
    const BodyImage& image = measured.compiled.bodies[i];
    if (image.part < 0) snapshot.bodies[i].pose = image.X;
  }
  snapshot.joints.assign(measured.user.joints.size(), kNaN);
  snapshot.rates = snapshot.joints;
  return snapshot;
}

void EnterBody(const Measured& measured, int part, int body, const BodyState& at_centre,
               Snapshot* snapshot) {
  const CompiledPart& own = measured.compiled.parts[static_cast<std::size_t>(part)];
  Eigen::Vector3d com = own.description.bodies[static_cast<std::size_t>(body)].com;
  if (own.description.space == SpaceKind::kPlanar) com.z() = 0.0;
  const Frame at_origin{at_centre.pose.R, at_centre.pose.p - at_centre.pose.R * com};
  for (std::size_t i = 0; i < measured.compiled.bodies.size(); ++i) {
    const BodyImage& image = measured.compiled.bodies[i];
    if (image.part != part || image.body != body) continue;
    const Frame X = at_origin * image.X;
    BodyState& state = snapshot->bodies[i];
    state.pose = {own.R_WC * X.R, own.R_WC * X.p};
    state.angular_velocity = own.R_WC * at_centre.angular_velocity;
    state.velocity =
        own.R_WC * (at_centre.velocity + at_centre.angular_velocity.cross(X.p - at_centre.pose.p));
  }
}

void EnterJoint(const Measured& measured, int part, int joint, double coordinate, double rate,
                Snapshot* snapshot) {
  for (std::size_t j = 0; j < measured.compiled.joints.size(); ++j) {
    const JointImage& image = measured.compiled.joints[j];
    if (image.part != part || image.joint != joint) continue;
    const double sign = image.mirrored && !IsLength(measured.user, j) ? -1.0 : 1.0;
    snapshot->joints[j] = sign * coordinate;
    snapshot->rates[j] = sign * rate;
  }
}

Distance DistanceOf(const Measured& measured, int part, const Snapshot& a, const Snapshot& b) {
  Distance distance;
  distance.energy = std::abs(a.energy - b.energy);
  // every point's shift and b's velocity there
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> shifts;
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    if (!BelongsTo(measured.compiled.bodies[i], part)) continue;
    const BodyState &p = a.bodies[i], &q = b.bodies[i];
    distance.rotation = std::max(distance.rotation, AngleBetween(p.pose.R, q.pose.R));
    distance.angular_velocity =
        std::max(distance.angular_velocity, (p.angular_velocity - q.angular_velocity).norm());
  }
  for (const auto& [i, r] : measured.points.empty() ? PointsOf(measured.user) : measured.points) {
    if (!BelongsTo(measured.compiled.bodies[i], part)) continue;
    const BodyState &p = a.bodies[i], &q = b.bodies[i];
    const Eigen::Vector3d r_p = p.pose.R * r, r_q = q.pose.R * r;
    const Eigen::Vector3d shift = p.pose.p - q.pose.p + r_p - r_q;
    const Eigen::Vector3d velocity = q.velocity + q.angular_velocity.cross(r_q);
    const Eigen::Vector3d difference = p.velocity + p.angular_velocity.cross(r_p) - velocity;
    distance.position = std::max(distance.position, shift.norm());
    distance.velocity = std::max(distance.velocity, difference.norm());
    shifts.emplace_back(shift, velocity);
  }
  for (std::size_t j = 0; j < a.joints.size(); ++j) {
    const double apart = a.joints[j] - b.joints[j];
    if (!BelongsTo(measured.compiled.joints[j], part) || std::isnan(apart)) continue;
    const bool is_length = IsLength(measured.user, j);
    double& largest = is_length ? distance.displacement : distance.angle;
    largest = std::max(largest,
                       std::abs(is_length ? apart : std::remainder(apart, 2 * std::numbers::pi)));
  }
  double along = 0.0, speed = 0.0;
  for (const auto& [shift, velocity] : shifts) {
    along += shift.dot(velocity);
    speed += velocity.squaredNorm();
  }
  distance.late = speed > 0.0 ? -along / speed : kNaN;
  if (!shifts.empty()) distance.speed = std::sqrt(speed / static_cast<double>(shifts.size()));
  for (const auto& [shift, velocity] : shifts) {
    const Eigen::Vector3d left =
        std::isnan(distance.late) ? shift : Eigen::Vector3d(shift + distance.late * velocity);
    distance.shape = std::max(distance.shape, left.norm());
  }
  return distance;
}

Distance Larger(const Distance& a, const Distance& b) {
  const auto larger = [](double x, double y) { return std::isnan(x) || y > x ? y : x; };
  Distance both;
  for (const auto& [name, part] : kDistances) both.*part = larger(a.*part, b.*part);
  both.late = larger(std::abs(a.late), std::abs(b.late));
  both.shape = larger(a.shape, b.shape);
  both.speed = larger(a.speed, b.speed);
  return both;
}

namespace {

/// Version of the file and of its content, raised when either changes.
constexpr int kFormat = 2;

/// Numbers of a body's state in the file: position, two columns of R, velocity, angular velocity.
constexpr std::size_t kStride = 15;

void Push(const BodyState& state, std::vector<double>* numbers) {
  const auto push = [&](const Eigen::Vector3d& v) {
    numbers->insert(numbers->end(), v.data(), v.data() + 3);
  };
  push(state.pose.p);
  push(state.pose.R.col(0));
  push(state.pose.R.col(1));
  push(state.velocity);
  push(state.angular_velocity);
}

BodyState StateFrom(const double* numbers) {
  const auto vector = [&](int i) { return Eigen::Vector3d(numbers + 3 * i); };
  BodyState state;
  state.pose.p = vector(0);
  state.pose.R.col(0) = vector(1);
  state.pose.R.col(1) = vector(2);
  state.pose.R.col(2) = vector(1).cross(vector(2));
  state.velocity = vector(3);
  state.angular_velocity = vector(4);
  return state;
}

std::string BodyKey(const MechanismDescription& user, std::size_t i) {
  return "series.body." + user.bodies[i].name;
}

std::string JointKey(const MechanismDescription& user, std::size_t j) {
  return "series.joint." + user.joints[j].name;
}

/// Returns the record that `read` finds in the text of a file. Throws std::runtime_error, whose
/// text ends with `cure`, for damaged and foreign files.
Record RecordIn(const std::function<std::string()>& read, const std::filesystem::path& file,
                const std::string& id, const char* cure) {
  std::string fault;
  try {
    std::string text = read();
    while (text.ends_with('\n')) text.pop_back();
    const Record record = FromJsonLine(text);
    const std::string found = record.Text("reference");
    if (!found.empty() && found == id) return record;
    fault = fmt::format("found reference \"{}\", expected \"{}\"", found, id);
  } catch (const std::runtime_error& error) {
    fault = error.what();
  }
  throw std::runtime_error(fmt::format("{}: {}{}", file.string(), fault, cure));
}

}  // namespace

std::size_t Reference::NumTrusted() const {
  const auto end = std::ranges::upper_bound(times, trust_horizon);
  return std::min(static_cast<std::size_t>(end - times.begin()), snapshots.size());
}

Distance Reference::Certified() const {
  Distance largest;
  for (std::size_t i = 0; i < NumTrusted(); ++i) largest = Larger(largest, bounds[i]);
  return largest;
}

std::string ReferenceId(const ExperimentProblem& problem, double horizon,
                        const ReferenceOptions& options) {
  return Fnv1a(fmt::format("{}|{}|{}|{}|{}|{}", kFormat, problem.mechanism.canonical, horizon,
                           options.scalar, options.points, options.cpu_s));
}

std::filesystem::path ReferencePath(const std::filesystem::path& store_file,
                                    const std::string& id) {
  return store_file.parent_path() / "references" / (id + ".json");
}

void WriteReference(const std::filesystem::path& path, const std::string& id,
                    const MechanismDescription& user, const Reference& reference) {
  Record record;
  record.Set("reference", id);
  record.Set("mechanism", user.name);
  record.Set("outcome", reference.outcome);
  record.Set("message", reference.message);
  record.Set("scalar", reference.scalar);
  record.Set("reference_runs", reference.witnesses);
  record.Set("reference_valid_until", reference.trust_horizon);
  record.Set("cpu_s", reference.cpu_s);
  record.Set("rhs_evaluations", reference.rhs_evaluations);
  record.Set("series.t", reference.times);
  for (const auto& [name, bound] : kDistances) {
    record.Set(std::string("series.bound.") + name, Mapped<double>(reference.bounds, bound));
  }
  record.Set("series.energy", Mapped<double>(reference.snapshots, &Snapshot::energy));
  for (std::size_t i = 1; i < user.bodies.size(); ++i) {
    std::vector<double> numbers;
    for (const Snapshot& at : reference.snapshots) Push(at.bodies[i], &numbers);
    record.Set(BodyKey(user, i), std::move(numbers));
  }
  for (std::size_t j = 0; j < user.joints.size(); ++j) {
    record.Set(JointKey(user, j), Mapped<double>(reference.snapshots,
                                                 [j](const Snapshot& at) { return at.joints[j]; }));
  }
  WriteFileAtomically(path, ToJsonLine(record) + "\n");
}

std::optional<Reference> ReadReference(const std::filesystem::path& path, const std::string& id,
                                       const MechanismDescription& user) {
  if (!std::filesystem::exists(path)) return std::nullopt;
  constexpr const char* kCure = " (remove it: it is computed again)";
  const Record record = RecordIn([&] { return ReadFile(path); }, path, id, kCure);
  Reference reference;
  reference.outcome = record.Text("outcome");
  reference.message = record.Text("message");
  reference.scalar = record.Text("scalar");
  reference.witnesses = record.Text("reference_runs");
  reference.trust_horizon = record.Number("reference_valid_until");
  reference.cpu_s = record.Number("cpu_s");
  reference.rhs_evaluations = static_cast<std::int64_t>(record.Number("rhs_evaluations"));
  reference.times = record.Numbers("series.t");
  const std::vector<double>& energy = record.Numbers("series.energy");
  const std::size_t count = energy.size();
  const auto column = [&](const std::string& key,
                          std::size_t stride) -> const std::vector<double>& {
    const std::vector<double>& numbers = record.Numbers(key);
    if (numbers.size() != count * stride || count > reference.times.size()) {
      throw std::runtime_error(fmt::format("{}: found {} numbers in \"{}\", expected {}{}",
                                           path.string(), numbers.size(), key, count * stride,
                                           kCure));
    }
    return numbers;
  };
  const Snapshot empty{.bodies = std::vector<BodyState>(user.bodies.size()),
                       .joints = std::vector<double>(user.joints.size())};
  reference.snapshots.assign(count, empty);
  reference.bounds.resize(count);
  for (const auto& [name, bound] : kDistances) {
    const std::vector<double>& values = column(std::string("series.bound.") + name, 1);
    for (std::size_t k = 0; k < count; ++k) reference.bounds[k].*bound = values[k];
  }
  for (std::size_t k = 0; k < count; ++k) reference.snapshots[k].energy = energy[k];
  for (std::size_t i = 1; i < user.bodies.size(); ++i) {
    const std::vector<double>& numbers = column(BodyKey(user, i), kStride);
    for (std::size_t k = 0; k < count; ++k) {
      reference.snapshots[k].bodies[i] = StateFrom(&numbers[k * kStride]);
    }
  }
  for (std::size_t j = 0; j < user.joints.size(); ++j) {
    const std::vector<double>& numbers = column(JointKey(user, j), 1);
    for (std::size_t k = 0; k < count; ++k) reference.snapshots[k].joints[j] = numbers[k];
  }
  return reference;
}
namespace {

namespace fs = std::filesystem;

struct Known {
  fs::path file;
  std::string text = ReadFile(file);
  Record record = RecordIn([this] { return text; }, file, file.stem().string(), "");
};

/// Returns the record as a line, without keys that may differ between computations.
std::string Lasting(const Record& record) {
  Record lasting;
  for (const auto& [key, value] : record.items()) {
    if (key != "cpu_s") lasting.Set(key, value);
  }
  return ToJsonLine(lasting);
}

/// The largest certified error of points, as far as that is certified [m].
double CertifiedTo(const Record& record) {
  const std::vector<double>&t = record.Numbers("series.t"),
        &bounds = record.Numbers("series.bound.position");
  double largest = 0.0;
  for (std::size_t k = 0; k < std::min(t.size(), bounds.size()); ++k) {
    if (t[k] <= record.Number("reference_valid_until")) largest = std::max(largest, bounds[k]);
  }
  return largest;
}

bool IsFiner(const Record& record, const Record& other) {
  const double until = record.Number("reference_valid_until"),
               others = other.Number("reference_valid_until");
  return until != others ? until > others : CertifiedTo(record) < CertifiedTo(other);
}

std::string Shown(const Known& known) {
  return fmt::format("{} (until {} s, to {:.1e} m)", known.file.string(),
                     known.record.Text("reference_valid_until"), CertifiedTo(known.record));
}

}  // namespace

MergedReferences MergeReferences(const std::vector<fs::path>& store_files) {
  std::map<std::string, Known> all;
  MergedReferences merged;
  for (const fs::path& store : store_files) {
    const fs::path folder = ReferencePath(store, "").parent_path();
    if (!fs::is_directory(folder)) continue;
    std::set<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.path().extension() == ".json") files.insert(entry.path());
    }
    for (const fs::path& file : files) {
      Known fresh{file};
      const auto [at, is_new] = all.try_emplace(file.filename().string(), fresh);
      if (is_new || Lasting(at->second.record) == Lasting(fresh.record)) continue;
      if (IsFiner(fresh.record, at->second.record)) std::swap(at->second, fresh);
      merged.notes.push_back(fmt::format("two certificates of one reference: {} is kept, {} is not",
                                         Shown(at->second), Shown(fresh)));
    }
  }
  for (auto& [name, known] : all) merged.texts.emplace(name, std::move(known.text));
  return merged;
}

void WriteReferences(const MergedReferences& references, const fs::path& store_file) {
  const fs::path folder = ReferencePath(store_file, "").parent_path();
  for (const auto& [name, text] : references.texts) {
    OutputFile file(folder / name, Onto::kAnyFile);
    file.Write(text);
    file.Finish();
  }
}

namespace {

class ErrorMeter final : public Meter {
 public:
  ErrorMeter(const Measured& measured, int part, const Reference& reference)
      : measured_(measured),
        part_(part),
        reference_(reference),
        times_(reference.times.begin(),
               reference.times.begin() + static_cast<std::ptrdiff_t>(reference.NumTrusted())) {}

  const std::vector<double>& times() const override { return times_; }

  void Add(std::size_t k, const Snapshot& own, const Snapshot& lower) override {
    if (k >= times_.size()) return;
    if (at_.empty()) first_energy_ = own.energy;
    Distance distance = DistanceOf(measured_, part_, own, reference_.snapshots[k]);
    distance.energy = std::abs(own.energy - first_energy_ - reference_.snapshots[k].energy +
                               reference_.snapshots.front().energy);
    // a run of one subsystem has only its own energy
    if (measured_.compiled.parts.size() > 1 || k == 0 || at_.empty()) {
      distance.energy = k == 0 ? 0.0 : std::nan("");
    }
    at_.push_back(k);
    distances_.push_back(distance);
    interpolation_ = std::max(interpolation_, DistanceOf(measured_, part_, own, lower).position);
  }

  void Write(Record& record) const override {
    if (at_.empty()) return;
    Distance largest;
    double squares = 0.0;
    std::vector<double> t, error;
    for (std::size_t i = 0; i < at_.size(); ++i) {
      largest = Larger(largest, distances_[i]);
      squares += distances_[i].position * distances_[i].position;
      t.push_back(times_[at_[i]]);
      error.push_back(distances_[i].position);
    }
    // time shift is undefined if nearly everything is at rest
    constexpr double kMoves = 0.01;
    double late = 0.0, shape = 0.0;
    for (const Distance& distance : distances_) {
      const bool moves = distance.speed > kMoves * largest.speed;
      if (moves) late = std::max(late, std::abs(distance.late));
      // a shift of zero is permitted, so the path error is at most the distance
      shape =
          std::max(shape, moves ? std::min(distance.shape, distance.position) : distance.position);
    }
    if (times_[at_.back()] == reference_.times.back()) {
      record.Set("error_position_end", error.back());
    }
    record.Set("error_position_max", largest.position);
    record.Set("error_position_rms", std::sqrt(squares / static_cast<double>(at_.size())));
    for (const auto& [name, part] : std::span(kDistances).subspan(1)) {
      if (part == &Distance::energy && measured_.compiled.parts.size() != 1) continue;
      record.Set(fmt::format("error_{}_max", name), largest.*part);
    }
    record.Set("error_phase_max", late);
    record.Set("error_path_max", shape);
    record.Set("error_interpolation_max", interpolation_);
    record.Set("error_points", static_cast<std::int64_t>(at_.size()));
    record.Set("series.error_t", std::move(t));
    record.Set("series.error", std::move(error));
  }

 private:
  Measured measured_;
  int part_;
  const Reference& reference_;
  std::vector<double> times_;
  std::vector<std::size_t> at_;  ///< which of them were added
  std::vector<Distance> distances_;
  double first_energy_ = 0.0, interpolation_ = 0.0;
};

constexpr const char* kPosition = "position";

/// The middle of the keys that a quantity's error and accuracy have: error_*_max.
std::string MeasureOf(const MechanismDescription& user, const PublishedQuantity& quantity) {
  const bool speed = quantity.is_speed;
  if (quantity.kind == PublishedKind::kPoint) return speed ? "velocity" : kPosition;
  if (quantity.kind == PublishedKind::kAngle) return speed ? "angular_velocity" : "rotation";
  const std::string measure = IsLength(user, quantity.index) ? "displacement" : "angle";
  return speed ? measure + "_rate" : measure;
}

bool IsAngle(const MechanismDescription& user, const PublishedQuantity& quantity) {
  if (quantity.is_speed || quantity.kind == PublishedKind::kPoint) return false;
  return quantity.kind == PublishedKind::kAngle || !IsLength(user, quantity.index);
}

/// Returns the maximum of each measure over the quantities, without NaN. The error of a point is
/// the root of the squares over its axes.
template <class ValueOf>
std::map<std::string, double> LargestOf(const MechanismDescription& user,
                                        const PublishedSeries& series, ValueOf value_of) {
  std::map<std::string, double> largest;
  // body, point and speed: the axes of one
  std::map<std::pair<std::string, std::pair<std::string, bool>>, double> squares;
  for (const PublishedQuantity& quantity : series.quantities) {
    double value = value_of(quantity);
    if (std::isnan(value)) continue;
    if (quantity.kind == PublishedKind::kPoint) {
      double& sum = squares[{quantity.body, {quantity.point, quantity.is_speed}}];
      sum += value * value;
      value = std::sqrt(sum);
    }
    double& known = largest.try_emplace(MeasureOf(user, quantity), 0.0).first->second;
    known = std::max(known, value);
  }
  return largest;
}

class SeriesMeter final : public Meter {
 public:
  SeriesMeter(const Measured& measured, int part, const PublishedSeries& series, double horizon)
      : measured_(measured),
        part_(part),
        series_(series),
        horizon_(horizon),
        times_(series.times.begin(),
               series.times.begin() + static_cast<std::ptrdiff_t>(series.NumWithin(horizon))) {}

  const std::vector<double>& times() const override { return times_; }

  void Add(std::size_t k, const Snapshot& own, const Snapshot& lower) override {
    if (k >= times_.size()) return;
    const auto errors = LargestOf(measured_.user, series_, [&](const PublishedQuantity& quantity) {
      const double difference = Difference(quantity, k, own);
      if (difference > over_accuracy_ * quantity.accuracy) {
        over_accuracy_ = difference / quantity.accuracy;
      }
      return difference;
    });
    if (errors.empty()) return;  // all of it belongs to other parts
    ++points_;
    interpolation_ = std::max(interpolation_, DistanceOf(measured_, part_, own, lower).position);
    for (const auto& [measure, error] : errors) {
      double& known = largest_.try_emplace(measure, 0.0).first->second;
      known = std::max(known, error);
      if (measure != kPosition) continue;
      at_.push_back(times_[k]);
      positions_.push_back(error);
    }
  }

  void Write(Record& record) const override {
    if (points_ == 0) return;
    for (const auto& [measure, error] : largest_) record.Set("error_" + measure + "_max", error);
    record.Set("error_over_uncertainty", over_accuracy_);
    record.Set("error_interpolation_max", interpolation_);
    record.Set("error_points", points_);
    if (positions_.empty()) return;
    double squares = 0.0;
    for (const double error : positions_) squares += error * error;
    record.Set("error_position_rms", std::sqrt(squares / static_cast<double>(positions_.size())));
    if (at_.back() == horizon_) record.Set("error_position_end", positions_.back());
    record.Set("series.error_t", at_);
    record.Set("series.error", positions_);
  }

 private:
  /// NaN where the part does not have it.
  double Difference(const PublishedQuantity& quantity, std::size_t k, const Snapshot& own) const {
    const double published = quantity.values[k];
    if (quantity.kind == PublishedKind::kJoint) {
      if (measured_.compiled.joints[quantity.index].part != part_) return std::nan("");
      const double value =
          quantity.is_speed ? own.rates[quantity.index] : own.joints[quantity.index];
      const double apart = value - published;
      return std::abs(
          IsAngle(measured_.user, quantity) ? std::remainder(apart, 2 * std::numbers::pi) : apart);
    }
    if (measured_.compiled.bodies[quantity.index].part != part_) return std::nan("");
    const BodyState& body = own.bodies[quantity.index];
    if (quantity.kind == PublishedKind::kAngle) {
      if (quantity.is_speed) return std::abs(body.angular_velocity.z() - published);
      const double angle = std::atan2(body.pose.R(1, 0), body.pose.R(0, 0));
      return std::abs(std::remainder(angle - published, 2 * std::numbers::pi));
    }
    const Eigen::Vector3d arm = body.pose.R * quantity.at;
    const Eigen::Vector3d vector =
        quantity.is_speed ? Eigen::Vector3d(body.velocity + body.angular_velocity.cross(arm))
                          : Eigen::Vector3d(body.pose.p + arm);
    return std::abs(vector[quantity.along] - published);
  }

  Measured measured_;
  int part_;
  const PublishedSeries& series_;
  double horizon_;
  std::vector<double> times_;
  std::map<std::string, double> largest_;  ///< by key of the record
  std::vector<double> at_, positions_;     ///< times and errors of points there
  double over_accuracy_ = 0.0, interpolation_ = 0.0;
  std::int64_t points_ = 0;
};

}  // namespace

std::unique_ptr<Meter> MakeMeter(const Measured& measured, int part, const Reference& reference) {
  return std::make_unique<ErrorMeter>(measured, part, reference);
}

std::unique_ptr<Meter> MakeMeter(const Measured& measured, int part, const PublishedSeries& series,
                                 double horizon) {
  return std::make_unique<SeriesMeter>(measured, part, series, horizon);
}

void WriteCertificate(const Reference& reference, Record& record) {
  record.Set("reference",
             reference.snapshots.empty()
                 ? fmt::format("none: {}",
                               reference.message.empty() ? reference.outcome : reference.message)
                 : reference.scalar);
  if (reference.snapshots.empty()) return;
  record.Set("reference_runs", reference.witnesses);
  record.Set("reference_error", reference.Certified().position);
  record.Set("reference_valid_until", reference.trust_horizon);
}

void WriteCertificate(const MechanismDescription& user, const PublishedSeries& series,
                      double horizon, Record& record) {
  const std::size_t count = series.NumWithin(horizon);
  if (count == 0) {
    record.Set("reference", fmt::format("none: \"{}\" begins at {} s, behind the horizon",
                                        series.name, series.times.front()));
    return;
  }
  record.Set("reference", std::string(kPublished));
  record.Set("reference_runs", fmt::format("{}: {}", series.name, series.source));
  const auto accuracies =
      LargestOf(user, series, [](const PublishedQuantity& quantity) { return quantity.accuracy; });
  for (const auto& [measure, accuracy] : accuracies) {
    record.Set(measure == kPosition ? "reference_error" : "reference_error_" + measure, accuracy);
  }
  record.Set("reference_valid_until", series.times[count - 1]);
}

}  // namespace loopbench::harness
