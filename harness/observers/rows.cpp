#include <fmt/format.h>

#include <functional>
#include <numbers>

#include "harness/observers/reactions.h"

namespace loopbench::harness {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

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
        applied_(user.bodies.size(), Wrench<Space, double>::Zero()) {
    AddNumber({"t", "", "t", "s"}, [](const RunSample& now) { return now.t; });
    for (std::size_t j = 0; output.Has(OutputPart::kJoints) && j < user.joints.size(); ++j) {
      AddJoint(j);
    }
    for (std::size_t b = 1; b < user.bodies.size(); ++b) {
      const std::string name = LabelName(user.bodies[b].name);
      if (output.Has(OutputPart::kBodies)) AddBody(b, name);
      if (!output.Has(OutputPart::kPoints)) continue;
      for (const auto& [point, place] : user.bodies[b].points) {
        const std::string full = name + ":" + LabelName(point);
        AddVector("point", full, "", "m",
                  [b, at = place](const RunSample& now) { return now.bodies[b].PointAt(at); });
        AddVector("point", full, "v", "m/s",
                  [b, at = place](const RunSample& now) { return now.bodies[b].VelocityAt(at); });
      }
    }
    if (output.Has(OutputPart::kReactions)) {
      Add({}, [this](const RunSample& now) { Solve(now); });
      for (int j = 0; j < std::ssize(user.joints); ++j) {
        if (user.joints[j].type != JointType::kFree) AddReaction(j);
      }
      for (int c = 0; c < std::ssize(user.couplings); ++c) AddCoupling(c);
    }
    if (output.Has(OutputPart::kForces)) AddForces();
    if (output.Has(OutputPart::kEnergy)) {
      const auto energy = [this] { return ComputeEnergy(mechanism_.kinematics()); };
      AddNumber({"energy", "", "kinetic", "J"},
                [energy](const RunSample&) { return energy().kinetic; });
      AddNumber({"energy", "", "potential", "J"},
                [energy](const RunSample&) { return energy().potential; });
      AddNumber({"energy", "", "supplied", "J"}, [](const RunSample& now) { return now.supplied; });
      AddNumber({"energy", "", "dissipated", "J"},
                [](const RunSample& now) { return now.dissipated; });
    }
  }

  const std::vector<TrajectoryColumn>& columns() const override { return columns_; }

  void Write(const RunSample& moment, std::vector<double>* row) override {
    row_ = row;
    row->clear();
    mechanism_.Set(moment.t, moment.bodies, moment.followed);
    is_regularized_ = moment.is_regularized;
    for (const auto& write : parts_) write(moment);
    last_ = *row;
  }

  std::int64_t OpenByRegularization() const override { return open_by_regularization_; }
  std::vector<std::pair<std::string, std::int64_t>> Open() const override {
    std::vector<std::pair<std::string, std::int64_t>> open;
    for (std::size_t i = 0; i < open_.size(); ++i) {
      if (open_[i] > 0) open.emplace_back(columns_[i].Label(), open_[i]);
    }
    return open;
  }

 private:
  using Columns = std::vector<TrajectoryColumn>;

  /// Adds columns, and the function that appends their values.
  void Add(const Columns& columns, std::function<void(const RunSample&)> write) {
    columns_.insert(columns_.end(), columns.begin(), columns.end());
    parts_.push_back(std::move(write));
  }
  template <class Value>
  void AddNumber(const TrajectoryColumn& column, Value value) {
    Add({column}, [this, value](const RunSample& now) { row_->push_back(value(now)); });
  }
  template <class Value>
  void AddVector(const char* kind, const std::string& name, const std::string& prefix,
                 const char* unit, Value value) {
    Add(Axes(kind, name, prefix, unit), [this, value](const RunSample& now) {
      const Eigen::Vector3d v = value(now);
      row_->insert(row_->end(), v.data(), v.data() + Space::kLin);
    });
  }

  /// Columns "x y z" or "x y".
  static Columns Axes(const char* kind, const std::string& name, const std::string& prefix,
                      const char* unit) {
    Columns columns;
    for (int i = 0; i < Space::kLin; ++i) columns.push_back({kind, name, prefix + "xyz"[i], unit});
    return columns;
  }
  /// Unit of an effort along a coordinate.
  static const char* EffortUnit(bool is_length) { return is_length ? "N" : "N m"; }
  std::string JointName(int j) const { return LabelName(user_.joints[j].name); }

  void AddJoint(std::size_t j) {
    const JointType type = user_.joints[j].type;
    const std::string name = JointName(static_cast<int>(j));
    Columns columns;
    for (const ValueWord& word : ValueWords(type, user_.space, false)) {
      const std::string unit(word.unit);
      columns.push_back({"joint", name, std::string(word.name), unit.empty() ? "1" : unit});
    }
    for (const ValueWord& word : ValueWords(type, user_.space, true)) {
      // speeds of rotations without coordinates of their own already have such names
      const char* const suffix = word.name.starts_with('w') ? "" : " speed";
      columns.push_back({"joint", name, std::string(word.name) + suffix, std::string(word.unit)});
    }
    Add(columns, [this, j](const RunSample& now) { Joint(j, now.followed[j]); });
  }

  void AddBody(std::size_t b, const std::string& name) {
    AddVector("body", name, "", "m", [b](const RunSample& now) { return now.bodies[b].pose.p; });
    if constexpr (Space::kRot == 1) {
      AddNumber({"body", name, "angle", "rad"},
                [b](const RunSample& now) { return now.bodies[b].angle; });
    } else {
      Columns columns;
      for (const char* part : {"qw", "qx", "qy", "qz"})
        columns.push_back({"body", name, part, "1"});
      Add(columns, [this, b](const RunSample& now) {
        double q[4];
        ToQuaternion(Rotation<Spatial, double>(now.bodies[b].pose.R), q);
        if (!last_.empty()) KeepSign(last_.data() + row_->size(), q);
        row_->insert(row_->end(), q, q + 4);
      });
    }
    AddVector("body", name, "v", "m/s",
              [b](const RunSample& now) { return now.bodies[b].velocity; });
    if constexpr (Space::kRot == 1) {
      AddNumber({"body", name, "w", "rad/s"},
                [b](const RunSample& now) { return now.bodies[b].angular_velocity.z(); });
    } else {
      AddVector("body", name, "w", "rad/s",
                [b](const RunSample& now) { return now.bodies[b].angular_velocity; });
    }
  }

  void AddReaction(int j) {
    const std::string name = JointName(j);
    Columns columns = Axes("reaction", name, "f", "N");
    for (int i = 0; i < Space::kRot; ++i) {
      columns.push_back({"reaction", name, {'m', "xyz"[Space::kRot == 1 ? 2 : i]}, "N m"});
    }
    Add(columns, [this, j](const RunSample&) { Reaction(j); });
    const auto words = ValueWords(user_.joints[j].type, user_.space, false);
    for (const PrescribedMotion& motion : user_.joints[j].motions) {
      const ValueWord& word = words[motion.coordinate];
      Add({{"drive", name, std::string(word.name), EffortUnit(word.is_length())}},
          [this, j, i = motion.coordinate](const RunSample&) {
            PushOrOpen(reactions_.DriveOf(j, i));
          });
    }
  }

  void AddCoupling(int c) {
    const CouplingDescription& coupling = user_.couplings[c];
    for (int i = 0; i < std::ssize(coupling.parts); ++i) {
      const int j = coupling.parts[i].joint;
      Add({{"coupling", LabelName(coupling.name) + ":" + JointName(j), "effort",
            EffortUnit(IsLength(user_, j))}},
          [this, c, i](const RunSample&) { PushOrOpen(reactions_.CouplingOf(c, i)); });
    }
  }

  void AddForces() {
    Columns columns;
    for (std::size_t f = 0; f < user_.forces.size(); ++f) {
      ForceDescription force = user_.forces[f];
      const ForceParts parts = PartsOf(force);
      const std::string name = fmt::format("{}:{}", f, LabelName(parts.name));
      if (parts.joint != nullptr) {
        columns.push_back({"force", name + ":" + JointName(*parts.joint), "effort",
                           EffortUnit(IsLength(user_, *parts.joint))});
      } else if (parts.points.size() == 2) {
        columns.push_back({"force", name, "tension", "N"});
      } else {
        for (TrajectoryColumn& column : Axes("force", name, "f", "N")) columns.push_back(column);
      }
    }
    Add(columns, [this](const RunSample&) { Forces(); });
  }

  void Joint(std::size_t j, double followed) {
    const auto words = ValueWords(user_.joints[j].type, user_.space, false);
    if (words.empty()) return;
    double q[7], u[6];
    mechanism_.Measure(static_cast<int>(j), q, u);
    const auto& kind = *mechanism_.mechanism().joints()[j].kind;
    Continue(j, words, followed, q);
    row_->insert(row_->end(), q, q + kind.num_q);
    row_->insert(row_->end(), u, u + kind.num_u);
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

  void Solve(const RunSample& moment) {
    for (std::size_t b = 1; b < user_.bodies.size(); ++b) {
      const Eigen::Vector3d a = moment.bodies[b].AccelerationAt(user_.bodies[b].com);
      const Eigen::Vector3d& alpha = moment.bodies[b].angular_acceleration;
      for (int i = 0; i < Space::kLin; ++i) A_[b].linear[i] = a[i];
      for (int i = 0; i < Space::kRot; ++i) A_[b].angular[i] = alpha[Space::kRot == 1 ? 2 : i];
    }
    AppliedForces<Space, double>(mechanism_.kinematics(), applied_);
    reactions_.Solve(A_, applied_);
  }

  void Reaction(int j) {
    Rotation<Space, double> axes = Rotation<Space, double>::Identity();
    const auto& joint = mechanism_.mechanism().joints()[j];
    if (output_.axes == OutputAxes::kJoint) {
      axes = mechanism_.kinematics().poses()[joint.from].R * joint.X_PF.R;
    }
    const Wrench<Space, double> F = reactions_.Of(j, axes);
    for (int i = 0; i < Space::kLin; ++i) PushOrOpen(F.linear[i]);
    for (int i = 0; i < Space::kRot; ++i) PushOrOpen(F.angular[i]);
  }

  /// Appends a component of a reaction; counts missing values.
  void PushOrOpen(double value) {
    if (open_.size() <= row_->size()) open_.resize(row_->size() + 1, 0);
    if (std::isnan(value)) ++(is_regularized_ ? open_by_regularization_ : open_[row_->size()]);
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
  std::vector<TrajectoryColumn> columns_;
  std::vector<std::function<void(const RunSample&)>> parts_;  ///< in the order of the columns
  std::vector<double>* row_ = nullptr;
  std::vector<double> last_;         ///< row
  std::vector<double> first_turns_;  ///< by column: of the first row, beyond measured angles
  std::vector<std::int64_t> open_;   ///< by column: number of rows without a value
  std::int64_t open_by_regularization_ = 0;
  bool is_regularized_ = false;  ///< the current sample
};

}  // namespace

std::unique_ptr<RowWriter> MakeRowWriter(const MechanismDescription& user,
                                         const OutputOptions& output) {
  if (user.space == SpaceKind::kPlanar) return std::make_unique<RowOf<Planar>>(user, output);
  return std::make_unique<RowOf<Spatial>>(user, output);
}

}  // namespace loopbench::harness
