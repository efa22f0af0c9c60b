#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <ranges>

#include "harness/observers/trajectory.h"

namespace loopbench::harness {
namespace {

constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);

/// Returns the index of a column, or kNowhere.
std::size_t PlaceOf(const TrajectoryColumn& column, const std::vector<TrajectoryColumn>& columns) {
  const auto at = std::ranges::find(columns, column);
  return at == columns.end() ? kNowhere : static_cast<std::size_t>(at - columns.begin());
}

/// Returns the indices of all of `wanted`; adds absent ones to `missing`.
std::vector<std::size_t> PlacesOf(std::span<const TrajectoryColumn> wanted,
                                  const std::vector<TrajectoryColumn>& columns,
                                  std::vector<std::string>* missing) {
  std::vector<std::size_t> places;
  for (const TrajectoryColumn& column : wanted) {
    places.push_back(PlaceOf(column, columns));
    if (places.back() == kNowhere) missing->push_back(column.Label());
  }
  return places;
}

/// Columns of a mechanism by kind and name of their part.
class PartColumns {
 public:
  explicit PartColumns(const std::vector<TrajectoryColumn>& all) {
    for (const TrajectoryColumn& column : all) parts_[{column.kind, column.name}].push_back(column);
  }
  /// Returns the columns of a part, in their order.
  std::span<const TrajectoryColumn> Of(const std::string& kind, const std::string& name) const {
    const auto found = parts_.find({kind, LabelName(name)});
    if (found == parts_.end()) return {};
    return found->second;
  }

 private:
  std::map<std::pair<std::string, std::string>, std::vector<TrajectoryColumn>> parts_;
};

std::string Listed(const std::vector<std::string>& labels) {
  constexpr std::size_t kMost = 6;
  std::string text = Joined(labels | std::views::take(kMost), ", ",
                            [](const std::string& label) { return '"' + label + '"'; });
  if (labels.size() > kMost) text += fmt::format(" and {} more", labels.size() - kMost);
  return text;
}

/// Mechanism in a position given by joint coordinates.
template <class Space>
struct MotionByJoints {
  MotionByJoints(const MechanismDescription& user, const PartColumns& known,
                 const std::vector<TrajectoryColumn>& all, std::vector<std::string>* missing,
                 std::vector<std::string>* no_speed)
      : compiled(Compile(user, CompileOptions::None())),
        mechanism(Unreleased(user), Coordinates::kJoint),
        kinematics(mechanism),
        q(VectorX<double>::Zero(mechanism.num_q())),
        u(VectorX<double>::Zero(mechanism.num_u())) {
    for (const TreeStep& step : mechanism.tree()) {
      const Joint<Space, double>& joint = mechanism.joints()[step.joint];
      if (joint.description < 0) {
        // only a virtual joint leads there
        missing->push_back("a joint of body " + mechanism.body_names()[step.child]);
        continue;
      }
      const auto columns = known.Of("joint", user.joints[joint.description].name);
      const auto enter = [&](int first, int count, int offset, Places* places, auto* absent) {
        for (int i = 0; i < count; ++i) {
          // prescribed coordinates follow their function; file values are ignored
          if (mechanism.DriveOf(joint, i) >= 0) continue;
          places->emplace_back(offset++, PlacesOf({&columns[first + i], 1}, all, absent).front());
        }
      };
      enter(0, joint.kind->num_q, joint.q_offset, &of_q, missing);
      enter(joint.kind->num_q, joint.kind->num_u, joint.u_offset, &of_u, no_speed);
    }
  }

  void Set(double t, const std::vector<double>& row, bool has_speeds,
           std::vector<BodyMotion>* bodies) {
    for (const auto& [i, column] : of_q) q[i] = row[column];
    for (const auto& [i, column] : of_u) {
      if (has_speeds) u[i] = row[column];
    }
    kinematics.SetTime(t);
    kinematics.UpdatePosition(q);
    kinematics.UpdateVelocity(u);
    EnterPart<Space>(compiled, 0, kinematics, {}, bodies);
  }

  Compiled compiled;
  Mechanism<Space, double> mechanism;
  Kinematics<Space, double> kinematics;
  VectorX<double> q, u;
  using Places = std::vector<std::pair<Eigen::Index, std::size_t>>;
  Places of_q, of_u;  ///< their columns
};

/// Poses of all bodies, row by row. They come from body columns, or from the coordinates of joints
/// that lead to each body (`explain` lists joints that close loops). Speeds are read if complete.
template <class Space>
class MotionReader {
 public:
  /// Throws std::runtime_error with the missing columns.
  MotionReader(const MechanismDescription& user, const PartColumns& known,
               const std::vector<TrajectoryColumn>& columns, const std::string& file)
      : bodies_(user.bodies.size()), of_body_(user.bodies.size()) {
    std::vector<std::string> no_pose, no_speed, no_joint;
    for (std::size_t b = 1; b < user.bodies.size(); ++b) {
      const std::span<const TrajectoryColumn> all = known.Of("body", user.bodies[b].name);
      of_body_[b] = PlacesOf(all.first(kPose), columns, &no_pose);
      const auto speeds = PlacesOf(all.subspan(kPose), columns, &no_speed);
      of_body_[b].insert(of_body_[b].end(), speeds.begin(), speeds.end());
    }
    has_speeds_ = no_speed.empty();
    if (no_pose.empty()) return;
    no_speed.clear();
    joints_.emplace(user, known, columns, &no_joint, &no_speed);
    has_speeds_ = no_speed.empty();
    if (no_joint.empty()) return;
    throw std::runtime_error(
        fmt::format("{}: found neither the poses of all bodies nor the coordinates of joints that "
                    "lead to them, expected {}, or else {}",
                    file, Listed(no_pose), Listed(no_joint)));
  }

  bool from_joints() const { return joints_.has_value(); }
  bool has_speeds() const { return has_speeds_; }

  /// Returns motions by the user's body; speeds are zero if they are not given.
  const std::vector<BodyMotion>& Read(double t, const std::vector<double>& row) {
    if (joints_) {
      joints_->Set(t, row, has_speeds_, &bodies_);
      return bodies_;
    }
    for (std::size_t b = 1; b < bodies_.size(); ++b) {
      const std::vector<std::size_t>& at = of_body_[b];
      BodyMotion& body = bodies_[b];
      body.pose = PoseColumns{at, kPlanar}.At(row.data());
      if (kPlanar) body.angle = row[at[2]];
      if (!has_speeds_) continue;
      const auto value = [&](std::size_t i) { return row[at[kPose + i]]; };
      body.velocity = {value(0), value(1), kPlanar ? 0.0 : value(2)};
      body.angular_velocity = kPlanar ? Eigen::Vector3d(0.0, 0.0, value(2))
                                      : Eigen::Vector3d(value(3), value(4), value(5));
    }
    return bodies_;
  }

 private:
  static constexpr bool kPlanar = Space::kRot == 1;
  static constexpr std::size_t kPose = kPlanar ? 3 : 7;  ///< number of its columns

  std::vector<BodyMotion> bodies_;
  std::vector<std::vector<std::size_t>> of_body_;  ///< pose and speeds
  std::optional<MotionByJoints<Space>> joints_;    ///< for files without the poses
  bool has_speeds_ = false;
};

/// Columns of a position and its speed.
struct Pair {
  std::size_t position, speed;
  bool turns;
  ColumnCheck check;
};

/// Returns the name of the speed of a component, or "".
std::string SpeedOf(const TrajectoryColumn& column) {
  if (column.kind == "joint") return column.unit == "1" ? "" : column.component + " speed";
  if (column.kind != "body" && column.kind != "point") return "";
  if (column.component == "angle") return "w";
  return column.component.size() == 1 ? "v" + column.component : "";
}

std::vector<Pair> PairsOf(const std::vector<TrajectoryColumn>& columns) {
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::string speed = SpeedOf(columns[i]);
    if (speed.empty()) continue;
    const auto at = FindColumn(columns, columns[i].kind, columns[i].name, speed);
    if (at) pairs.push_back({i, *at, columns[i].unit == "rad", {columns[*at].Label(), {}}});
  }
  return pairs;
}

template <class Space>
class Checker {
 public:
  Checker(TrajectoryReader& reader, const MechanismDescription& user, const std::string& file)
      : reader_(reader),
        user_(user),
        known_(MakeRowWriter(user, OutputOptions())->columns()),
        by_part_(known_),
        motion_(user, by_part_, reader.columns(), file),
        mechanism_(user),
        pairs_(PairsOf(reader.columns())) {
    check_.has_speeds = motion_.has_speeds();
    const auto place_of = [&reader](const char* part) {
      return PlaceOf({"energy", "", part, "J"}, reader.columns());
    };
    energies_ = {place_of("kinetic"), place_of("potential")};
    supplied_ = place_of("supplied");
    dissipated_ = place_of("dissipated");
    const bool has_power = mechanism_.mechanism().has_power();
    if (!check_.has_speeds) {
      check_.no_energy = "there are no speeds";
    } else if (has_power && (supplied_ == kNowhere || dissipated_ == kNowhere)) {
      check_.no_energy =
          "forces or motions have power, and there is no \"energy:supplied [J]\" and "
          "\"energy:dissipated [J]\"";
    }
    const bool balances = has_power && check_.no_energy.empty();
    for (std::size_t i = 0; i < reader.columns().size(); ++i) {
      const TrajectoryColumn& column = reader.columns()[i];
      if (!Contains(known_, column)) {
        check_.unknown.push_back(column.kind.empty() ? column.component : column.Label());
      } else if (column.kind == "joint" || column.kind == "body" || column.kind == "point" ||
                 (check_.has_speeds && Contains(energies_, i))) {
        motions_.push_back(i);
      } else if (i != reader.time() && !(balances && (i == supplied_ || i == dissipated_))) {
        check_.unchecked.push_back(column.Label());
      }
    }
    check_.source = motion_.from_joints() ? "joint coordinates" : "body poses";
    for (const JointDescription& joint : user.joints) check_.joints.push_back({joint.name});
    for (const CouplingDescription& coupling : user.couplings) {
      check_.joints.push_back({"coupling " + coupling.name});
    }
    turns_.resize(user.couplings.size());
    for (std::size_t j = 0; j < user.joints.size(); ++j) {
      given_.emplace_back();
      for (const auto& column : by_part_.Of("joint", user.joints[j].name)) {
        given_.back().push_back(PlaceOf(column, reader.columns()));
      }
    }
    followed_.resize(user.joints.size());
  }

  TrajectoryCheck Run() {
    for (std::vector<double> row; reader_.Next(&row);) {
      reader_.RequireNumbers(row, motions_);
      Add(row[reader_.time()], row);
    }
    for (Pair& pair : pairs_) {
      if (pair.check.apart.is_known) check_.speeds.push_back(std::move(pair.check));
    }
    return std::move(check_);
  }

 private:
  void Add(double t, const std::vector<double>& row) {
    if (check_.rows++ == 0) check_.from = t;
    check_.to = t;
    for (std::size_t j = 0; j < followed_.size(); ++j) {
      const bool is_given = given_[j].size() == 2 && given_[j][0] != kNowhere;  // and its speed
      followed_[j] = is_given ? row[given_[j][0]] : std::numeric_limits<double>::quiet_NaN();
    }
    mechanism_.Set(t, motion_.Read(t, row), followed_);
    for (std::size_t j = 0; j < user_.joints.size(); ++j) AddJoint(j, t, row);
    for (std::size_t c = 0; c < turns_.size(); ++c) AddCoupling(c, t);
    const Energy<double> energy = ComputeEnergy(mechanism_.kinematics());
    for (std::size_t i = 0; check_.has_speeds && i < energies_.size(); ++i) {
      if (energies_[i] == kNowhere) continue;
      ColumnCheck& check = check_.energies[i];
      if (check_.rows == 1) check.label = reader_.columns()[energies_[i]].Label();
      check.apart.Add(std::abs(row[energies_[i]] - (i == 0 ? energy.kinetic : energy.potential)),
                      t);
    }
    if (check_.no_energy.empty()) {
      double balance = energy.total();
      if (mechanism_.mechanism().has_power()) balance += row[dissipated_] - row[supplied_];
      if (check_.rows == 1) first_energy_ = balance;
      check_.energy.Add(std::abs(balance - first_energy_), t);
      check_.kinetic = std::max(check_.kinetic, energy.kinetic);
      if (!std::isfinite(balance)) check_.no_energy = fmt::format("it is {} J at {} s", balance, t);
    }
    AddSpeeds(t, row);
  }

  void AddJoint(std::size_t j, double t, const std::vector<double>& row) {
    const auto& joint = mechanism_.mechanism().joints()[j];
    JointCheck& check = check_.joints[j];
    if (joint.num_directions() > 0) {
      const JointMismatch mismatch = mechanism_.MismatchOf(static_cast<int>(j));
      check.shift.Add(mismatch.shift, t);
      check.rotation.Add(mismatch.rotation, t);
      if (check_.has_speeds) {
        check.velocity.Add(mismatch.velocity, t);
        check.angular_velocity.Add(mismatch.angular_velocity, t);
      }
    }
    double q[7], u[6];
    if (given_[j].empty()) return;
    mechanism_.Measure(static_cast<int>(j), q, u);
    const auto words = ValueWords(user_.joints[j].type, user_.space, false);
    double sign = 1.0, product = 0.0;
    for (int i = 0; joint.kind->has_quaternion() && i < 4; ++i) {
      if (given_[j][i] != kNowhere) product += q[i] * row[given_[j][i]];
    }
    if (product < 0.0) sign = -1.0;
    for (std::size_t i = 0; i < words.size(); ++i) {
      if (given_[j][i] == kNowhere) continue;
      double miss = row[given_[j][i]] - (words[i].unit.empty() ? sign * q[i] : q[i]);
      if (words[i].unit == "rad" && joint.kind->parameter == 0.0) {
        miss = std::remainder(miss, 2 * std::numbers::pi);
      }
      check.coordinates.Add(std::abs(miss), t);
    }
  }

  /// Holds speeds against positions, over the last three rows.
  void AddSpeeds(double t, const std::vector<double>& row) {
    std::rotate(rows_.begin(), rows_.begin() + 1, rows_.end());
    std::rotate(t_.begin(), t_.begin() + 1, t_.end());
    rows_[2] = row;
    t_[2] = t;
    if (rows_[0].empty()) return;
    const double h0 = t_[1] - t_[0], h1 = t_[2] - t_[1], h = h0 + h1;
    for (Pair& pair : pairs_) {
      const auto v = [&](std::size_t i) { return rows_[i][pair.speed]; };
      const double way =
          h / 6 * ((2 - h1 / h0) * v(0) + h * h / (h0 * h1) * v(1) + (2 - h0 / h1) * v(2));
      double miss = rows_[2][pair.position] - rows_[0][pair.position] - way;
      if (pair.turns) miss = std::remainder(miss, 2 * std::numbers::pi);
      pair.check.apart.Add(std::abs(miss) / h, t_[1]);
    }
  }

  /// In the unit of its first joint. Whole turns of angles in the first row do not count.
  void AddCoupling(std::size_t c, double t) {
    const Kinematics<Space, double>& kinematics = mechanism_.kinematics();
    const auto index = static_cast<int>(c);
    const double open = kinematics.CouplingMismatch(index);
    if (check_.rows == 1) {
      turns_[c] = open - mechanism_.mechanism().couplings()[c].WithoutTurns(open);
    }
    JointCheck& check = check_.joints[user_.joints.size() + c];
    const bool turns = kinematics.FirstTurns(index);
    (turns ? check.rotation : check.shift)
        .Add(std::abs(kinematics.OfFirstJoint(index, open - turns_[c])), t);
    if (!check_.has_speeds) return;
    (turns ? check.angular_velocity : check.velocity)
        .Add(std::abs(kinematics.OfFirstJoint(index, kinematics.CouplingSpeed(index))), t);
  }

  TrajectoryReader& reader_;
  const MechanismDescription& user_;
  std::vector<TrajectoryColumn> known_;  ///< of the mechanism
  PartColumns by_part_;
  MotionReader<Space> motion_;
  UserMechanism<Space> mechanism_;
  std::vector<Pair> pairs_;
  std::vector<std::size_t> motions_;             ///< columns of the mechanism's motion
  std::vector<std::vector<std::size_t>> given_;  ///< columns of joints, by the user's joint
  std::vector<double> followed_;                 ///< given coordinates, NaN if not given
  std::vector<double> turns_;                    ///< of each coupling, whole turns in the first row
  std::size_t supplied_ = kNowhere, dissipated_ = kNowhere;
  std::array<std::size_t, 2> energies_{};  ///< columns of kinetic and potential energy
  double first_energy_ = 0.0;
  std::array<std::vector<double>, 3> rows_;  ///< the last ones, and their times
  std::array<double, 3> t_{};
  TrajectoryCheck check_;
};

}  // namespace

TrajectoryCheck CheckTrajectory(const std::filesystem::path& path,
                                const MechanismDescription& user) {
  TrajectoryReader reader(path);
  return user.space == SpaceKind::kPlanar ? Checker<Planar>(reader, user, path.string()).Run()
                                          : Checker<Spatial>(reader, user, path.string()).Run();
}

std::vector<SharedColumn> SharedColumns(const Trajectory& ours, const Trajectory& theirs) {
  std::vector<SharedColumn> shared;
  for (std::size_t i = 0; i < ours.columns.size(); ++i) {
    const std::size_t at = PlaceOf(ours.columns[i], theirs.columns);
    if (i == ours.time || ours.columns[i].kind.empty() || at == kNowhere) continue;
    shared.push_back({ours.columns[i].Label(), ours.columns[i].unit, i, at});
  }
  return shared;
}

namespace {

/// Returns the first row not before a time.
std::size_t RowFrom(const Trajectory& ours, double t) {
  const auto rows = std::views::iota(std::size_t{0}, ours.rows());
  return static_cast<std::size_t>(
      std::ranges::lower_bound(rows, t, {}, [&](std::size_t row) { return ours.Time(row); }) -
      rows.begin());
}

/// Returns the first row of the cubic before row `low`.
std::size_t FirstOfCubic(const Trajectory& ours, std::size_t low) {
  const std::size_t rows = ours.rows();
  return std::min(low < 2 ? 0 : low - 2, rows - std::min<std::size_t>(4, rows));
}

}  // namespace

double FirstTimeFor(const Trajectory& ours, double t) {
  return ours.Time(FirstOfCubic(ours, RowFrom(ours, t)));
}

double ValueAt(const Trajectory& ours, std::size_t column, double t, bool* is_between) {
  const std::size_t rows = ours.rows(), low = RowFrom(ours, t);
  if (is_between != nullptr) *is_between = false;
  // times written with fewer digits count as equal
  constexpr double kSame = 1e-12;
  for (const std::size_t row : {low, low - 1}) {
    const bool is_there = row < rows;
    if (is_there && std::abs(ours.Time(row) - t) <= kSame * std::max(1.0, std::abs(t))) {
      return ours.At(row, column);
    }
  }
  if (low == 0 || low == rows) return std::numeric_limits<double>::quiet_NaN();
  if (is_between != nullptr) *is_between = true;
  const std::size_t first = FirstOfCubic(ours, low), end = first + std::min<std::size_t>(4, rows);
  double value = 0.0;
  for (std::size_t i = first; i < end; ++i) {
    double weight = 1.0;
    for (std::size_t k = first; k < end; ++k) {
      if (k == i) continue;
      const double own = ours.Time(i), other = ours.Time(k);
      weight *= (t - other) / (own - other);
    }
    value += weight * ours.At(i, column);
  }
  return value;
}

std::vector<double> Differences(const Trajectory& ours, const Trajectory& theirs,
                                const SharedColumn& column) {
  std::vector<double> differences;
  for (std::size_t row = 0; row < theirs.rows(); ++row) {
    const double value = ValueAt(ours, column.in_ours, theirs.Time(row));
    const double apart = theirs.At(row, column.in_theirs) - value;
    const bool turns = column.unit == "rad";
    differences.push_back(turns ? std::remainder(apart, 2 * std::numbers::pi) : apart);
  }
  return differences;
}

}  // namespace loopbench::harness
