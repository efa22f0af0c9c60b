#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "harness/base/text.h"
#include "harness/observers/trajectory.h"

namespace loopbench::harness {
namespace {

using Columns = std::vector<TrajectoryColumn>;

/// Adds columns "x y z" or "x y".
void AddVector(const std::string& kind, const std::string& name, const std::string& prefix,
               const std::string& unit, bool planar, Columns* columns) {
  for (const char* axis : {"x", "y", "z"}) {
    if (planar && *axis == 'z') continue;
    columns->push_back({kind, name, prefix + axis, unit});
  }
}

/// Returns the unit of an effort along a coordinate.
std::string EffortUnit(bool is_length) { return is_length ? "N" : "N m"; }

bool IsLength(const MechanismDescription& user, int joint) {
  const auto words = ValueWords(user.joints[joint].type, user.space, false);
  return !words.empty() && words.front().is_length();
}

void AddReaction(const MechanismDescription& user, const JointDescription& joint, bool planar,
                 Columns* columns) {
  if (joint.type == JointType::kFree) return;
  const std::string name = LabelName(joint.name);
  AddVector("reaction", name, "f", "N", planar, columns);
  if (planar) {
    columns->push_back({"reaction", name, "mz", "N m"});
  } else {
    AddVector("reaction", name, "m", "N m", planar, columns);
  }
  const auto words = ValueWords(joint.type, user.space, false);
  for (const PrescribedMotion& motion : joint.motions) {
    const ValueWord& word = words[motion.coordinate];
    columns->push_back({"drive", name, std::string(word.name), EffortUnit(word.is_length())});
  }
}

void AddForce(const MechanismDescription& user, std::size_t index, bool planar, Columns* columns) {
  ForceDescription force = user.forces[index];
  const ForceParts parts = PartsOf(force);
  const std::string name = fmt::format("{}:{}", index, LabelName(parts.name));
  if (parts.joint != nullptr) {
    columns->push_back({"force", name + ":" + LabelName(user.joints[*parts.joint].name), "effort",
                        EffortUnit(IsLength(user, *parts.joint))});
  } else if (parts.points.size() == 2) {
    columns->push_back({"force", name, "tension", "N"});
  } else {
    AddVector("force", name, "f", "N", planar, columns);
  }
}

}  // namespace

std::string TrajectoryColumn::Label() const {
  if (kind == component) return fmt::format("{} [{}]", kind, unit);
  return fmt::format("{}{}:{} [{}]", kind, name.empty() ? "" : ":" + name, component, unit);
}

std::string LabelName(std::string_view name) {
  std::string marked;
  for (const char c : name) {
    if (c == ':' || c == '\\') marked += '\\';
    marked += c;
  }
  return EscapeTerminal(marked);
}

std::optional<TrajectoryColumn> ParseLabel(std::string_view label) {
  const std::size_t bracket = label.rfind(" [");
  if (bracket == std::string_view::npos || !label.ends_with(']')) return std::nullopt;
  TrajectoryColumn column;
  column.unit = label.substr(bracket + 2, label.size() - bracket - 3);
  label = label.substr(0, bracket);
  // components have no colon; colons in names follow a backslash
  const std::size_t first = label.find(':'), last = label.rfind(':');
  column.kind = label.substr(0, first);
  column.component = first == std::string_view::npos ? label : label.substr(last + 1);
  if (first == std::string_view::npos && label != "t") return std::nullopt;
  if (first != last) column.name = label.substr(first + 1, last - first - 1);
  if (column.kind.empty() || column.component.empty()) return std::nullopt;
  return column;
}

std::vector<TrajectoryColumn> JointColumns(const MechanismDescription& user, std::size_t j) {
  Columns columns;
  const JointDescription& joint = user.joints[j];
  const std::string name = LabelName(joint.name);
  for (const ValueWord& word : ValueWords(joint.type, user.space, false)) {
    columns.push_back(
        {"joint", name, std::string(word.name), word.unit.empty() ? "1" : std::string(word.unit)});
  }
  for (const ValueWord& word : ValueWords(joint.type, user.space, true)) {
    // speeds of rotations without coordinates of their own already have such names
    const bool is_speed = word.name.starts_with('w');
    columns.push_back({"joint", name, std::string(word.name) + (is_speed ? "" : " speed"),
                       std::string(word.unit)});
  }
  return columns;
}

std::vector<TrajectoryColumn> BodyColumns(const MechanismDescription& user, std::size_t b) {
  const bool planar = user.space == SpaceKind::kPlanar;
  const std::string name = LabelName(user.bodies[b].name);
  Columns columns;
  AddVector("body", name, "", "m", planar, &columns);
  if (planar) {
    columns.push_back({"body", name, "angle", "rad"});
  } else {
    for (const char* part : {"qw", "qx", "qy", "qz"}) columns.push_back({"body", name, part, "1"});
  }
  AddVector("body", name, "v", "m/s", planar, &columns);
  if (planar) {
    columns.push_back({"body", name, "w", "rad/s"});
  } else {
    AddVector("body", name, "w", "rad/s", planar, &columns);
  }
  return columns;
}

std::vector<TrajectoryColumn> TrajectoryColumns(const MechanismDescription& user,
                                                const OutputOptions& output) {
  const bool planar = user.space == SpaceKind::kPlanar;
  Columns columns = {{"t", "", "t", "s"}};
  const auto add = [&](const Columns& more) {
    columns.insert(columns.end(), more.begin(), more.end());
  };
  if (output.Has(OutputPart::kJoints)) {
    for (std::size_t j = 0; j < user.joints.size(); ++j) add(JointColumns(user, j));
  }
  for (std::size_t b = 1; b < user.bodies.size(); ++b) {
    if (output.Has(OutputPart::kBodies)) add(BodyColumns(user, b));
    if (!output.Has(OutputPart::kPoints)) continue;
    for (const auto& [point, at] : user.bodies[b].points) {
      const std::string name = LabelName(user.bodies[b].name) + ":" + LabelName(point);
      AddVector("point", name, "", "m", planar, &columns);
      AddVector("point", name, "v", "m/s", planar, &columns);
    }
  }
  if (output.Has(OutputPart::kReactions)) {
    for (const JointDescription& joint : user.joints) AddReaction(user, joint, planar, &columns);
    for (const CouplingDescription& coupling : user.couplings) {
      for (const auto& [j, ratio] : coupling.parts) {
        columns.push_back({"coupling",
                           LabelName(coupling.name) + ":" + LabelName(user.joints[j].name),
                           "effort", EffortUnit(IsLength(user, j))});
      }
    }
  }
  if (output.Has(OutputPart::kForces)) {
    for (std::size_t f = 0; f < user.forces.size(); ++f) AddForce(user, f, planar, &columns);
  }
  if (output.Has(OutputPart::kEnergy)) {
    for (const char* part : {"kinetic", "potential", "supplied", "dissipated"}) {
      columns.push_back({"energy", "", part, "J"});
    }
  }
  return columns;
}
namespace {

/// Returns `angle` plus the full turns that bring it closest to `near`.
double Unwrapped(double angle, double near) {
  return near + std::remainder(angle - near, 2 * std::numbers::pi);
}

/// Chooses the sign of q, which has no influence on the rotation, closest to `last`.
void KeepSign(const double* last, double* q) {
  double product = 0.0;
  for (int i = 0; i < 4; ++i) product += last[i] * q[i];
  for (int i = 0; product < 0.0 && i < 4; ++i) q[i] = -q[i];
}

template <class Space>
class RowOf final : public RowWriter {
 public:
  RowOf(const MechanismDescription& user, const OutputOptions& output)
      : user_(user),
        output_(output),
        mechanism_(user),
        reactions_(mechanism_),
        A_(user.bodies.size(), Acceleration<Space, double>::Zero()),
        applied_(user.bodies.size(), Wrench<Space, double>::Zero()) {}

  void Write(const RunSample& moment, std::vector<double>* row) override {
    row_ = row;
    row->assign(1, moment.t);
    mechanism_.Set(moment.t, moment.bodies, moment.followed);
    if (output_.Has(OutputPart::kJoints)) Joints(moment);
    for (std::size_t b = 1; b < user_.bodies.size(); ++b) {
      if (output_.Has(OutputPart::kBodies)) Body(moment.bodies[b]);
      if (!output_.Has(OutputPart::kPoints)) continue;
      for (const auto& [name, at] : user_.bodies[b].points) {
        Push(moment.bodies[b].PointAt(at));
        Push(moment.bodies[b].VelocityAt(at));
      }
    }
    if (output_.Has(OutputPart::kReactions)) Bearings(moment);
    if (output_.Has(OutputPart::kForces)) Forces();
    if (output_.Has(OutputPart::kEnergy)) {
      const Energy<double> energy = ComputeEnergy(mechanism_.kinematics());
      for (const double value :
           {energy.kinetic, energy.potential, moment.supplied, moment.dissipated}) {
        row->push_back(value);
      }
    }
    last_ = *row;
  }

  std::vector<std::pair<std::string, std::int64_t>> Open() const override {
    std::vector<std::pair<std::string, std::int64_t>> open;
    const std::vector<TrajectoryColumn> columns = TrajectoryColumns(user_, output_);
    for (std::size_t i = 0; i < open_.size(); ++i) {
      if (open_[i] > 0) open.emplace_back(columns[i].Label(), open_[i]);
    }
    return open;
  }

 private:
  void Push(const Eigen::Vector3d& v) {
    row_->insert(row_->end(), v.data(), v.data() + Space::kLin);
  }

  void Joints(const RunSample& moment) {
    for (std::size_t j = 0; j < user_.joints.size(); ++j) {
      const auto words = ValueWords(user_.joints[j].type, user_.space, false);
      if (words.empty()) continue;
      double q[7], u[6];
      mechanism_.Measure(static_cast<int>(j), q, u);
      const auto& kind = *mechanism_.mechanism().joints()[j].kind;
      Continue(j, words, moment.followed[j], q);
      row_->insert(row_->end(), q, q + kind.num_q);
      row_->insert(row_->end(), u, u + kind.num_u);
    }
  }

  /// Makes angles and quaternions continuous with the last row. The first row is continuous with
  /// the initial values. In the plane Measure() counts turns, but not from the initial value.
  void Continue(std::size_t j, const std::vector<ValueWord>& words, double followed, double* q) {
    const auto& joint = mechanism_.mechanism().joints()[j];
    const double* last = last_.empty() ? nullptr : last_.data() + row_->size();
    if (joint.kind->has_quaternion() && last != nullptr) KeepSign(last, q);
    first_turns_.resize(std::max(first_turns_.size(), row_->size() + words.size()), 0.0);
    for (std::size_t i = 0; i < words.size(); ++i) {
      // a helical joint contains its full turns
      if (words[i].unit != "rad" || joint.kind->parameter != 0.0) continue;
      const int drive = mechanism_.mechanism().DriveOf(joint, static_cast<int>(i));
      double& turns = first_turns_[row_->size() + i];
      if (drive >= 0) {
        q[i] = mechanism_.kinematics().drives()[drive].value;
      } else if (words.size() == 1) {
        if (Space::kRot == 1) continue;
        if (std::isfinite(followed) || last != nullptr) {
          q[i] = Unwrapped(q[i], std::isfinite(followed) ? followed : last[i]);
        }
      } else if (last == nullptr) {
        turns = Unwrapped(q[i], user_.initial.GuessOf(static_cast<int>(j), i)) - q[i];
        q[i] += turns;
      } else {
        q[i] = Space::kRot == 1 ? q[i] + turns : Unwrapped(q[i], last[i]);
      }
    }
  }

  void Body(const BodyMotion& body) {
    Push(body.pose.p);
    if (Space::kRot == 1) {
      row_->push_back(body.angle);
    } else {
      double q[4];
      ToQuaternion(Rotation<Spatial, double>(body.pose.R), q);
      if (!last_.empty()) KeepSign(last_.data() + row_->size(), q);
      row_->insert(row_->end(), q, q + 4);
    }
    Push(body.velocity);
    if (Space::kRot == 1) {
      row_->push_back(body.angular_velocity.z());
    } else {
      Push(body.angular_velocity);
    }
  }

  void Bearings(const RunSample& moment) {
    for (std::size_t b = 1; b < user_.bodies.size(); ++b) {
      const Eigen::Vector3d a = moment.bodies[b].AccelerationAt(user_.bodies[b].com);
      const Eigen::Vector3d& alpha = moment.bodies[b].angular_acceleration;
      for (int i = 0; i < Space::kLin; ++i) A_[b].linear[i] = a[i];
      for (int i = 0; i < Space::kRot; ++i) A_[b].angular[i] = alpha[Space::kRot == 1 ? 2 : i];
    }
    AppliedForces<Space, double>(mechanism_.kinematics(), applied_);
    reactions_.Solve(A_, applied_);
    for (std::size_t j = 0; j < user_.joints.size(); ++j) {
      if (user_.joints[j].type != JointType::kFree) Bearing(static_cast<int>(j));
    }
    for (std::size_t c = 0; c < user_.couplings.size(); ++c) {
      for (std::size_t i = 0; i < user_.couplings[c].parts.size(); ++i) {
        PushOrOpen(reactions_.CouplingOf(static_cast<int>(c), static_cast<int>(i)));
      }
    }
  }

  void Bearing(int j) {
    Rotation<Space, double> axes = Rotation<Space, double>::Identity();
    const auto& joint = mechanism_.mechanism().joints()[j];
    if (output_.axes == OutputAxes::kJoint) {
      axes = mechanism_.kinematics().poses()[joint.from].R * joint.X_PF.R;
    }
    const Wrench<Space, double> F = reactions_.Of(j, axes);
    for (int i = 0; i < Space::kLin; ++i) PushOrOpen(F.linear[i]);
    for (int i = 0; i < Space::kRot; ++i) PushOrOpen(F.angular[i]);
    for (const PrescribedMotion& motion : user_.joints[j].motions) {
      PushOrOpen(reactions_.DriveOf(j, motion.coordinate));
    }
  }

  /// Appends a component of a reaction; counts missing values.
  void PushOrOpen(double value) {
    if (open_.size() <= row_->size()) open_.resize(row_->size() + 1, 0);
    open_[row_->size()] += std::isnan(value);
    row_->push_back(value);
  }

  /// Appends each force separately, from the bodies that it acts on.
  void Forces() {
    std::size_t f = 0;
    std::ranges::fill(applied_, Wrench<Space, double>::Zero());
    const Kinematics<Space, double>& kinematics = mechanism_.kinematics();
    mechanism_.mechanism().forces().ForEach([&](const auto& element) {
      element.AddWrenches(kinematics, applied_);
      ForceDescription force = user_.forces[f++];
      const ForceParts parts = PartsOf(force);
      if (parts.joint != nullptr) {
        const auto& joint = mechanism_.mechanism().joints()[*parts.joint];
        const auto& state = kinematics.joints()[*parts.joint];
        const Wrench<Space, double> F = ShiftForce<Space, double>(applied_[joint.to], -state.r_Q);
        row_->push_back(F.dot(mechanism_.DirectionOfSpeed(*parts.joint, 0)));
        applied_[joint.to].setZero();
        applied_[joint.from].setZero();
        return;
      }
      const BodyPoint& last = *parts.points.back();
      const Linear<Space, double> on_last = applied_[last.body].linear;
      if (parts.points.size() == 2) {
        row_->push_back(Tension(*parts.points.front(), last, on_last));
      } else {
        for (int i = 0; i < Space::kLin; ++i) row_->push_back(on_last[i]);
      }
      for (const BodyPoint* point : parts.points) applied_[point->body].setZero();
    });
  }

  /// Returns the pull of a force on the second point towards the first; 0 for coincident points.
  double Tension(const BodyPoint& first, const BodyPoint& second,
                 const Linear<Space, double>& on_second) const {
    const auto at = [&](const BodyPoint& point) {
      return PointOfBody<Space, double>(point, user_).StateIn(mechanism_.kinematics()).p;
    };
    const Linear<Space, double> between = at(first) - at(second);
    const double distance = between.norm();
    return distance > 0.0 ? on_second.dot(between) / distance : 0.0;
  }

  const MechanismDescription& user_;
  const OutputOptions& output_;
  UserMechanism<Space> mechanism_;
  Reactions<Space> reactions_;
  std::vector<Acceleration<Space, double>> A_;
  std::vector<Wrench<Space, double>> applied_;
  std::vector<double>* row_ = nullptr;
  std::vector<double> last_;         ///< row
  std::vector<double> first_turns_;  ///< by column: of the first row, beyond measured angles
  std::vector<std::int64_t> open_;   ///< by column: number of rows without a value
};

}  // namespace

std::unique_ptr<RowWriter> MakeRowWriter(const MechanismDescription& user,
                                         const OutputOptions& output) {
  if (user.space == SpaceKind::kPlanar) return std::make_unique<RowOf<Planar>>(user, output);
  return std::make_unique<RowOf<Spatial>>(user, output);
}

}  // namespace loopbench::harness
