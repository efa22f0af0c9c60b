#include "harness/trajectory/recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace loopbench::harness {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::string_view HowOf(const OutputOptions& output) {
  if (output.accepted_steps) return "accepted steps";
  return output.exact ? "exact times" : "dense output";
}

constexpr const char* kOpen =
    "nan, because redundant constraints share a load in no one way, in {} of {} rows: {}";

}  // namespace

template <class Space>
Recorder<Space>::Recorder(const MechanismDescription& user, const Compiled& compiled,
                          const Mechanism<Space, double>& mechanism, const TrajectoryTask& task)
    : user_(user),
      compiled_(compiled),
      task_(task),
      dynamics_(mechanism),
      A_(static_cast<std::size_t>(mechanism.num_bodies())),
      points_(PointsOf(user)),
      rows_(MakeRowWriter(user, task_.output)) {
  moment_.bodies = AtRest(compiled);
  moment_.followed.assign(user.joints.size(), kNaN);
}

template <class Space>
void Recorder<Space>::TakeAt(double t, System<Space, double>& system, std::span<const double> y,
                             std::span<const double> lower) {
  const auto n = static_cast<std::size_t>(system.state_size());
  if (lower.data() != y.data() && system.FromState(t, lower.first(n)) == Outcome::kFinished) {
    lower_.emplace(moment_.bodies);
    EnterPart<Space>(compiled_, 0, system.kinematics(), {}, &*lower_);
  }
  bool has_accelerations = task_.output.Has(OutputPart::kReactions);
  if (has_accelerations) {
    ydot_.resize(n);
    has_accelerations = system.Examine(t, y.first(n), ydot_) == Outcome::kFinished;
  } else {
    system.FromState(t, y.first(n));
  }
  Take(t, system, has_accelerations, y.subspan(n));
}

template <class Space>
void Recorder<Space>::Take(double t, const System<Space, double>& system, bool has_accelerations,
                           std::span<const double> work) {
  const Kinematics<Space, double>& kinematics = system.kinematics();
  std::span<const Acceleration<Space, double>> accelerations;
  if (has_accelerations) {
    dynamics_.BodyAccelerations(kinematics, system.udot(), A_);
    accelerations = A_;
  }
  moment_.t = t;
  const double none = system.mechanism().has_power() ? kNaN : 0.0;
  moment_.supplied = work.empty() ? none : work[0];
  moment_.dissipated = work.empty() ? none : work[1];
  EnterPart<Space>(compiled_, 0, kinematics, accelerations, &moment_.bodies);
  const auto& joints = kinematics.mechanism().joints();
  for (std::size_t j = 0; j < compiled_.joints.size(); ++j) {
    const JointImage& image = compiled_.joints[j];
    if (image.part < 0 || joints[image.joint].kind->num_u != 1) continue;
    const double value = kinematics.JointCoordinate(image.joint);
    moment_.followed[j] = image.mirrored ? -value : value;
  }
  for (std::size_t i = 0; lower_ && i < points_.size(); ++i) {
    const auto& [body, at] = points_[i];
    const Eigen::Vector3d apart = (*lower_)[body].PointAt(at) - moment_.bodies[body].PointAt(at);
    interpolation_ = std::max(interpolation_, apart.norm());
  }
  lower_.reset();
  rows_->Write(moment_, &row_);
  if (!file_) Open();
  file_->Write(row_);
}

template <class Space>
void Recorder<Space>::Open() {
  file_.emplace(task_.path, TrajectoryColumns(user_, task_.output), Notes());
}

template <class Space>
std::vector<std::string> Recorder<Space>::Notes() const {
  const OutputOptions& output = task_.output;
  std::vector<std::string> notes = {fmt::format(
      "{}: {}; SI units; bodies at their origins, in ground axes", task_.title, HowOf(output))};
  if (output.Has(OutputPart::kReactions)) {
    notes.push_back(fmt::format(
        "reaction: on the joint's second body, moment about the joint's point there, in {}; "
        "without "
        "drives and joint forces. drive: along the coordinate, power = drive times speed",
        output.axes == OutputAxes::kGround ? "ground axes"
                                           : "axes of the joint's frame on its first body"));
  }
  if (output.Has(OutputPart::kForces)) {
    notes.push_back(
        "force: effort along the coordinate on the joint's second body; tension pulls both points "
        "together; fx fy fz on the body at the point, in ground axes");
  }
  return notes;
}

template <class Space>
void Recorder<Space>::Finish(Record& record) {
  if (!file_) Open();
  const std::int64_t rows = file_->rows();
  // columns without a value in equally many rows share a line
  std::vector<std::string> notes;
  std::int64_t open = 0;
  const auto columns = rows_->Open();
  for (auto at = columns.begin(); at != columns.end();) {
    const auto end = std::find_if(at, columns.end(),
                                  [&](const auto& other) { return other.second != at->second; });
    std::string labels;
    for (auto one = at; one != end; ++one) {
      labels += (labels.empty() ? "" : ", ") + one->first;
      open += one->second;
    }
    notes.push_back(fmt::format(kOpen, at->second, rows, labels));
    at = end;
  }
  const std::string hash = file_->Finish(notes);
  record.Set("trajectory", task_.path.filename().string());
  record.Set("trajectory_hash", hash);
  record.Set("trajectory_output", std::string(HowOf(task_.output)));
  record.Set("trajectory_rows", rows);
  if (open > 0) record.Set("trajectory_open", open);
  if (!task_.output.accepted_steps && !task_.output.exact) {
    record.Set("trajectory_interpolation_max", interpolation_);
  }
}

template class Recorder<Planar>;
template class Recorder<Spatial>;

}  // namespace loopbench::harness
