#include "harness/trajectory/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace loopbench::harness {
namespace {

/// Columns of a position and its speed.
struct Pair {
  std::size_t position, speed;
  bool turns;
  SpeedCheck check;
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
    const auto at = std::ranges::find_if(columns, [&](const TrajectoryColumn& other) {
      return !speed.empty() && other.kind == columns[i].kind && other.name == columns[i].name &&
             other.component == speed;
    });
    if (at == columns.end()) continue;
    pairs.push_back({i,
                     static_cast<std::size_t>(at - columns.begin()),
                     columns[i].unit == "rad",
                     {at->Label(), {}}});
  }
  return pairs;
}

/// The last three rows.
class Window {
 public:
  void Add(double t, const std::vector<double>& row, std::vector<Pair>& pairs) {
    std::rotate(rows_.begin(), rows_.begin() + 1, rows_.end());
    std::rotate(t_.begin(), t_.begin() + 1, t_.end());
    rows_[2] = row;
    t_[2] = t;
    if (rows_[0].empty()) return;
    const double h0 = t_[1] - t_[0], h1 = t_[2] - t_[1], h = h0 + h1;
    for (Pair& pair : pairs) {
      const auto v = [&](std::size_t i) { return rows_[i][pair.speed]; };
      const double way =
          h / 6 * ((2 - h1 / h0) * v(0) + h * h / (h0 * h1) * v(1) + (2 - h0 / h1) * v(2));
      double miss = rows_[2][pair.position] - rows_[0][pair.position] - way;
      if (pair.turns) miss = std::remainder(miss, 2 * std::numbers::pi);
      pair.check.apart.Add(std::abs(miss) / h, t_[1]);
    }
  }

 private:
  std::array<std::vector<double>, 3> rows_;
  std::array<double, 3> t_{};
};

template <class Space>
class Checker {
 public:
  Checker(TrajectoryReader& reader, const MechanismDescription& user, const std::string& file)
      : reader_(reader),
        file_(file),
        user_(user),
        motion_(user, reader.columns(), file),
        mechanism_(user),
        pairs_(PairsOf(reader.columns())) {
    OutputOptions all;
    const auto known = TrajectoryColumns(user, all);
    for (std::size_t i = 0; i < reader.columns().size(); ++i) {
      const TrajectoryColumn& column = reader.columns()[i];
      if (std::ranges::find(known, column) == known.end()) {
        check_.unknown.push_back(column.kind.empty() ? column.component : column.Label());
      } else if (column.kind == "joint" || column.kind == "body" || column.kind == "point") {
        motions_.push_back(i);
      }
    }
    check_.source = motion_.from_joints() ? "joint coordinates" : "body poses";
    check_.has_speeds = motion_.has_speeds();
    for (const JointDescription& joint : user.joints) check_.joints.push_back({joint.name});
    for (std::size_t j = 0; j < user.joints.size(); ++j) {
      given_.emplace_back();
      for (const TrajectoryColumn& column : JointColumns(user, j)) {
        const auto at = std::ranges::find(reader.columns(), column);
        given_.back().push_back(at == reader.columns().end()
                                    ? kNowhere
                                    : static_cast<std::size_t>(at - reader.columns().begin()));
      }
    }
    supplied_ = Work("supplied");
    dissipated_ = Work("dissipated");
    if (!check_.has_speeds) {
      check_.no_energy = "there are no speeds";
    } else if (mechanism_.mechanism().has_power() &&
               (supplied_ == kNowhere || dissipated_ == kNowhere)) {
      check_.no_energy =
          "forces or motions have power, and there is no \"energy:supplied [J]\" and "
          "\"energy:dissipated [J]\"";
    }
  }

  TrajectoryCheck Run() {
    for (std::vector<double> row; reader_.Next(&row);) {
      reader_.RequireNumbers(row, motions_);
      Add(row[reader_.time()], row);
    }
    if (check_.rows == 0) {
      throw std::runtime_error(fmt::format("{}: found no row, expected a motion", file_));
    }
    for (Pair& pair : pairs_) {
      if (pair.check.apart.is_known) check_.speeds.push_back(std::move(pair.check));
    }
    for (const JointCheck& joint : check_.joints) {
      if (joint.shift.is_known) check_.shift.Add(joint.shift.value, joint.shift.t);
      if (joint.rotation.is_known) check_.rotation.Add(joint.rotation.value, joint.rotation.t);
    }
    return std::move(check_);
  }

 private:
  static constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);

  std::size_t Work(const std::string& part) const {
    const auto& columns = reader_.columns();
    const auto at = std::ranges::find(columns, TrajectoryColumn{"energy", "", part, "J"});
    return at == columns.end() ? kNowhere : static_cast<std::size_t>(at - columns.begin());
  }

  void Add(double t, const std::vector<double>& row) {
    if (check_.rows++ == 0) check_.from = t;
    check_.to = t;
    mechanism_.Set(t, motion_.Read(t, row));
    for (std::size_t j = 0; j < check_.joints.size(); ++j) AddJoint(j, t, row);
    if (check_.no_energy.empty()) {
      const Energy<double> energy = ComputeEnergy(mechanism_.kinematics());
      double balance = energy.total();
      if (mechanism_.mechanism().has_power()) balance += row[dissipated_] - row[supplied_];
      if (check_.rows == 1) first_energy_ = balance;
      check_.energy.Add(std::abs(balance - first_energy_), t);
      check_.kinetic = std::max(check_.kinetic, energy.kinetic);
      if (!std::isfinite(balance)) check_.no_energy = fmt::format("it is {} J at {} s", balance, t);
    }
    window_.Add(t, row, pairs_);
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

  TrajectoryReader& reader_;
  std::string file_;
  const MechanismDescription& user_;
  MotionReader motion_;
  UserMechanism<Space> mechanism_;
  std::vector<Pair> pairs_;
  std::vector<std::size_t> motions_;             ///< columns of the mechanism's motion
  std::vector<std::vector<std::size_t>> given_;  ///< columns of joints, by the user's joint
  std::size_t supplied_ = kNowhere, dissipated_ = kNowhere;
  double first_energy_ = 0.0;
  Window window_;
  TrajectoryCheck check_;
};

}  // namespace

TrajectoryCheck CheckTrajectory(const std::filesystem::path& path,
                                const MechanismDescription& user) {
  TrajectoryReader reader(path);
  if (user.space == SpaceKind::kPlanar) {
    return Checker<Planar>(reader, user, path.string()).Run();
  }
  return Checker<Spatial>(reader, user, path.string()).Run();
}

std::vector<SharedColumn> SharedColumns(const Trajectory& ours, const Trajectory& theirs) {
  std::vector<SharedColumn> shared;
  for (std::size_t i = 0; i < ours.columns.size(); ++i) {
    const auto at = std::ranges::find(theirs.columns, ours.columns[i]);
    if (i == ours.time || ours.columns[i].kind.empty() || at == theirs.columns.end()) continue;
    shared.push_back({ours.columns[i].Label(), ours.columns[i].unit, i,
                      static_cast<std::size_t>(at - theirs.columns.begin())});
  }
  return shared;
}

double ValueAt(const Trajectory& ours, std::size_t column, double t) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const std::size_t rows = ours.rows();
  std::size_t low = 0, high = rows;  // first row not before t
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    (ours.At(middle, ours.time) < t ? low : high) = middle + (ours.At(middle, ours.time) < t);
  }
  // times written with fewer digits count as equal
  constexpr double kSame = 1e-12;
  for (const std::size_t row : {low, low - 1}) {
    const bool is_there = row < rows;
    if (is_there && std::abs(ours.At(row, ours.time) - t) <= kSame * std::max(1.0, std::abs(t))) {
      return ours.At(row, column);
    }
  }
  if (low == 0 || low == rows) return kNaN;
  const std::size_t count = std::min<std::size_t>(4, rows);
  const std::size_t first = std::min(low < 2 ? 0 : low - 2, rows - count);
  double value = 0.0;
  for (std::size_t i = first; i < first + count; ++i) {
    double weight = 1.0;
    for (std::size_t k = first; k < first + count; ++k) {
      if (k == i) continue;
      const double own = ours.At(i, ours.time), other = ours.At(k, ours.time);
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
    const double value = ValueAt(ours, column.in_ours, theirs.At(row, theirs.time));
    const double apart = theirs.At(row, column.in_theirs) - value;
    const bool turns = column.unit == "rad";
    differences.push_back(turns ? std::remainder(apart, 2 * std::numbers::pi) : apart);
  }
  return differences;
}

}  // namespace loopbench::harness
