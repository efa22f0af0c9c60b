#include "harness/observers/reference.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

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
  WriteFileAtomically(path, ToJsonLine(record) + '\n', Onto::kAnyFile);
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

}  // namespace loopbench::harness
