#include "harness/reference/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "harness/record/record_json.h"
#include "harness/text/files.h"
#include "harness/text/hash.h"

namespace loopbench::harness {
namespace {

/// Of the file, and of what stands in it: raised when either changes.
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

/// The bounds as series, by name.
template <class Use>
void ForEachBound(Use use) {
  use("position", &Distance::position);
  use("rotation", &Distance::rotation);
  use("velocity", &Distance::velocity);
  use("angular_velocity", &Distance::angular_velocity);
  use("angle", &Distance::angle);
  use("displacement", &Distance::displacement);
  use("energy", &Distance::energy);
}

std::string BodyKey(const MechanismDescription& user, std::size_t i) {
  return "series.body." + user.bodies[i].name;
}
std::string JointKey(const MechanismDescription& user, std::size_t j) {
  return "series.joint." + user.joints[j].name;
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

std::string ReferenceId(const ExperimentScene& scene, double horizon,
                        const ReferenceOptions& options) {
  return Fnv1a(fmt::format("{}|{}|{}|{}|{}|{}", kFormat, scene.mechanism.canonical, horizon,
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
  record.Set("reference_witnesses", reference.witnesses);
  record.Set("trust_horizon", reference.trust_horizon);
  record.Set("cpu_s", reference.cpu_s);
  record.Set("rhs_evaluations", reference.rhs_evaluations);
  record.Set("series.t", reference.times);
  ForEachBound([&](const char* name, double Distance::*bound) {
    std::vector<double> values;
    for (const Distance& at : reference.bounds) values.push_back(at.*bound);
    record.Set(std::string("series.bound.") + name, std::move(values));
  });
  std::vector<double> energy;
  for (const Snapshot& at : reference.snapshots) energy.push_back(at.energy);
  record.Set("series.energy", std::move(energy));
  for (std::size_t i = 1; i < user.bodies.size(); ++i) {
    std::vector<double> numbers;
    for (const Snapshot& at : reference.snapshots) Push(at.bodies[i], &numbers);
    record.Set(BodyKey(user, i), std::move(numbers));
  }
  for (std::size_t j = 0; j < user.joints.size(); ++j) {
    std::vector<double> numbers;
    for (const Snapshot& at : reference.snapshots) numbers.push_back(at.joints[j]);
    record.Set(JointKey(user, j), std::move(numbers));
  }
  WriteFileAtomically(path, ToJsonLine(record) + "\n");
}

std::optional<Reference> ReadReference(const std::filesystem::path& path, const std::string& id,
                                       const MechanismDescription& user) {
  if (!std::filesystem::exists(path)) return std::nullopt;
  const auto refuse = [&](const std::string& why) {
    throw std::runtime_error(
        fmt::format("{}: {} (remove it: it is made anew)", path.string(), why));
  };
  Record record;
  try {
    std::string text = ReadFile(path);
    while (text.ends_with('\n')) text.pop_back();
    record = FromJsonLine(text);
  } catch (const std::runtime_error& error) {
    refuse(error.what());
  }
  if (record.Text("reference") != id) {
    refuse(fmt::format("found reference \"{}\", expected \"{}\"", record.Text("reference"), id));
  }
  Reference reference;
  reference.outcome = record.Text("outcome");
  reference.message = record.Text("message");
  reference.scalar = record.Text("scalar");
  reference.witnesses = record.Text("reference_witnesses");
  reference.trust_horizon = record.Number("trust_horizon");
  reference.cpu_s = record.Number("cpu_s");
  reference.rhs_evaluations = static_cast<std::int64_t>(record.Number("rhs_evaluations"));
  reference.times = record.Numbers("series.t");
  const std::vector<double>& energy = record.Numbers("series.energy");
  const std::size_t count = energy.size();
  const auto column = [&](const std::string& key,
                          std::size_t stride) -> const std::vector<double>& {
    const std::vector<double>& numbers = record.Numbers(key);
    if (numbers.size() != count * stride || count > reference.times.size()) {
      refuse(fmt::format("found {} numbers in \"{}\", expected {}", numbers.size(), key,
                         count * stride));
    }
    return numbers;
  };
  const Snapshot empty{.bodies = std::vector<BodyState>(user.bodies.size()),
                       .joints = std::vector<double>(user.joints.size())};
  reference.snapshots.assign(count, empty);
  reference.bounds.resize(count);
  ForEachBound([&](const char* name, double Distance::*bound) {
    const std::vector<double>& values = column(std::string("series.bound.") + name, 1);
    for (std::size_t k = 0; k < count; ++k) reference.bounds[k].*bound = values[k];
  });
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

}  // namespace loopbench::harness
