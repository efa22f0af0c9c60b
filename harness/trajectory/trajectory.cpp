#include "harness/trajectory/trajectory.h"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "harness/json/json_document.h"
#include "harness/record/record.h"
#include "harness/text/escape.h"
#include "harness/text/files.h"
#include "harness/text/hash.h"
#include "harness/trajectory/check.h"
#include "mechanism/algebra/space.h"

namespace loopbench::harness {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Returns the next cell of a line from `*at` and moves `*at` after its comma; past the line at the
/// end. Returns nothing for an unclosed quotation mark, or one followed by other text.
std::optional<std::string_view> NextCell(std::string_view line, std::size_t* at,
                                         std::string* room) {
  if (*at >= line.size() || line[*at] != '"') {
    const std::size_t end = std::min(line.find(',', *at), line.size());
    const std::string_view cell = line.substr(*at, end - *at);
    *at = end + 1;
    return cell;
  }
  room->clear();
  for (std::size_t i = *at + 1; i < line.size(); ++i) {
    if (line[i] == '"') {
      const bool is_doubled = i + 1 < line.size() && line[i + 1] == '"';
      if (!is_doubled) {
        if (i + 1 < line.size() && line[i + 1] != ',') return std::nullopt;
        *at = i + 2;
        return *room;
      }
      ++i;
    }
    *room += line[i];
  }
  return std::nullopt;
}

std::string_view Trimmed(std::string_view cell) {
  while (!cell.empty() && cell.front() == ' ') cell.remove_prefix(1);
  while (!cell.empty() && cell.back() == ' ') cell.remove_suffix(1);
  return cell;
}

std::optional<double> NumberIn(std::string_view cell) {
  cell = Trimmed(cell);
  if (cell.empty()) return kNaN;
  if (cell.front() == '+') cell.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  // values beyond the range of doubles are rejected
  if (end != cell.data() + cell.size() || error != std::errc()) return std::nullopt;
  return value;
}

}  // namespace

TrajectoryReader::TrajectoryReader(const std::filesystem::path& path) : path_(path) {
  std::error_code error;
  if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error)) {
    throw std::runtime_error(
        fmt::format("cannot read '{}': expected a regular file", path.string()));
  }
  NoteInput(path);
  errno = 0;
  in_.open(path, std::ios::binary);
  if (!in_) FailOn("read", path);
  if (!NextLine())
    Refuse("no line of labels", "labels such as \"t [s]\" and \"joint:A:angle [rad]\"");
  std::set<std::string> seen;
  std::string room;
  bool has_time = false;
  for (std::size_t at = 0; at <= line_.size();) {
    const auto cell = NextCell(line_, &at, &room);
    if (!cell) Refuse("a quotation mark without its end", "labels, quoted as RFC 4180 says");
    const std::string label(Trimmed(*cell));
    if (!seen.insert(label).second)
      Refuse(fmt::format("\"{}\" twice", Excerpt(label)), "each label once");
    columns_.push_back(ParseLabel(label).value_or(TrajectoryColumn{"", "", label, ""}));
    if (label != "t [s]") continue;
    has_time = true;
    time_ = columns_.size() - 1;
  }
  if (!has_time) Refuse("no column \"t [s]\"", "a column of times");
}

bool TrajectoryReader::NextLine() {
  while (std::getline(in_, line_)) {
    ++number_;
    if (number_ == 1 && line_.starts_with("\xef\xbb\xbf")) line_.erase(0, 3);
    if (line_.ends_with('\r')) line_.pop_back();
    if (line_.empty()) continue;
    if (line_.front() != '#') return true;
    std::vector<std::string>& notes = columns_.empty() ? notes_ : later_notes_;
    constexpr std::size_t kMaxNotes = 1000;  // ignore further notes
    if (notes.size() < kMaxNotes) notes.push_back(line_.substr(line_.starts_with("# ") ? 2 : 1));
  }
  return false;
}

bool TrajectoryReader::Next(std::vector<double>* row) {
  if (!NextLine()) return false;
  row->clear();
  std::string room;
  for (std::size_t at = 0; at <= line_.size();) {
    const auto cell = NextCell(line_, &at, &room);
    const auto value = cell ? NumberIn(*cell) : std::nullopt;
    if (!value) {
      Refuse(fmt::format("\"{}\" in column {}", Excerpt(cell.value_or("\"")), row->size() + 1),
             "a number");
    }
    row->push_back(*value);
  }
  if (row->size() != columns_.size()) {
    Refuse(fmt::format("{} values", row->size()), fmt::format("{}, as labels", columns_.size()));
  }
  const double t = (*row)[time_];
  if (!std::isfinite(t) || (has_row_ && t <= last_t_)) {
    Refuse(fmt::format("t = {}", t), "times that rise");
  }
  last_t_ = t;
  has_row_ = true;
  return true;
}

void TrajectoryReader::RequireNumbers(const std::vector<double>& row,
                                      std::span<const std::size_t> columns) const {
  for (const std::size_t i : columns) {
    if (std::isfinite(row[i])) continue;
    const std::string label = Excerpt(columns_[i].Label());
    Refuse(fmt::format("{} in \"{}\" at t = {}", row[i], label, row[time_]), "a finite number");
  }
}

void TrajectoryReader::Refuse(const std::string& found, const std::string& expected) const {
  throw std::runtime_error(
      fmt::format("{}:{}: found {}, expected {}", path_.string(), number_, found, expected));
}

Trajectory ReadTrajectory(const std::filesystem::path& path) {
  TrajectoryReader reader(path);
  Trajectory trajectory{reader.columns(), reader.notes(), {}, reader.time()};
  for (std::vector<double> row; reader.Next(&row);) {
    trajectory.values.insert(trajectory.values.end(), row.begin(), row.end());
  }
  return trajectory;
}

std::optional<std::size_t> Trajectory::Find(std::string_view kind, std::string_view name,
                                            std::string_view component, bool is_label) const {
  const std::string wanted = is_label ? std::string(name) : LabelName(name);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const TrajectoryColumn& column = columns[i];
    if (column.kind == kind && column.name == wanted && column.component == component) return i;
  }
  return std::nullopt;
}

Frame PoseColumns::At(const double* row) const {
  Frame X;
  const auto value = [&](std::size_t i) { return row[columns[i]]; };
  X.p = {value(0), value(1), planar ? 0.0 : value(2)};
  if (planar) {
    const double c = std::cos(value(2)), s = std::sin(value(2));
    X.R << c, -s, 0, s, c, 0, 0, 0, 1;
  } else {
    const double q[4] = {value(3), value(4), value(5), value(6)};
    X.R = FromQuaternion(q).eigen();
  }
  return X;
}

std::optional<PoseColumns> FindPose(const std::vector<TrajectoryColumn>& columns,
                                    std::string_view body) {
  const std::string name = LabelName(body);
  const auto all = [&](const std::vector<const char*>& components) {
    std::vector<std::size_t> found;
    for (const char* component : components) {
      for (std::size_t i = 0; i < columns.size(); ++i) {
        const TrajectoryColumn& column = columns[i];
        if (column.kind != "body" || column.name != name || column.component != component) continue;
        found.push_back(i);
      }
    }
    return found.size() == components.size() ? found : std::vector<std::size_t>();
  };
  if (auto found = all({"x", "y", "angle"}); !found.empty()) return PoseColumns{found, true};
  if (auto found = all({"x", "y", "z", "qw", "qx", "qy", "qz"}); !found.empty()) {
    return PoseColumns{found, false};
  }
  return std::nullopt;
}

std::filesystem::path TrajectoryPath(const std::filesystem::path& store_file,
                                     const std::string& id) {
  return store_file.parent_path() / "trajectories" / (id + ".csv");
}
namespace {

/// Indices of columns in a file, and the missing columns.
class Places {
 public:
  explicit Places(const std::vector<TrajectoryColumn>& columns) : columns_(columns) {}

  /// Returns the indices of all of `wanted`; adds absent ones to `missing`.
  std::vector<std::size_t> Of(const std::vector<TrajectoryColumn>& wanted,
                              std::vector<std::string>* missing) const {
    std::vector<std::size_t> places;
    for (const TrajectoryColumn& column : wanted) {
      const auto at = std::ranges::find(columns_, column);
      if (at == columns_.end()) missing->push_back(column.Label());
      places.push_back(static_cast<std::size_t>(at - columns_.begin()));
    }
    return places;
  }

 private:
  const std::vector<TrajectoryColumn>& columns_;
};

std::string Listed(const std::vector<std::string>& labels) {
  constexpr std::size_t kMost = 6;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, labels.size()); ++i) {
    text += fmt::format("{}\"{}\"", i == 0 ? "" : ", ", labels[i]);
  }
  if (labels.size() > kMost) text += fmt::format(" and {} more", labels.size() - kMost);
  return text;
}

/// Mechanism in a position given by joint coordinates.
struct ByJoints {
  virtual ~ByJoints() = default;
  virtual void Set(double t, const std::vector<double>& row, bool has_speeds,
                   std::vector<BodyMotion>* bodies) = 0;
};

template <class Space>
struct ByJointsIn final : ByJoints {
  ByJointsIn(const MechanismDescription& user, const Places& places,
             std::vector<std::string>* missing, std::vector<std::string>* no_speed)
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
      const auto columns = JointColumns(user, static_cast<std::size_t>(joint.description));
      // prescribed coordinates follow their function; file values are ignored
      std::vector<TrajectoryColumn> q_of, u_of;
      for (int i = 0; i < joint.kind->num_q; ++i) {
        if (mechanism.DriveOf(joint, i) < 0) q_of.push_back(columns[i]);
      }
      for (int i = 0; i < joint.kind->num_u; ++i) {
        if (mechanism.DriveOf(joint, i) < 0) u_of.push_back(columns[joint.kind->num_q + i]);
      }
      for (const std::size_t at : places.Of(q_of, missing)) of_q.push_back(at);
      for (const std::size_t at : places.Of(u_of, no_speed)) of_u.push_back(at);
    }
  }

  void Set(double t, const std::vector<double>& row, bool has_speeds,
           std::vector<BodyMotion>* bodies) override {
    std::size_t next_q = 0, next_u = 0;
    for (const TreeStep& step : mechanism.tree()) {
      const Joint<Space, double>& joint = mechanism.joints()[step.joint];
      for (int i = 0; i < joint.num_q(); ++i) q[joint.q_offset + i] = row[of_q[next_q++]];
      for (int i = 0; i < joint.num_u(); ++i) {
        const std::size_t at = of_u[next_u++];
        if (has_speeds) u[joint.u_offset + i] = row[at];
      }
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
  std::vector<std::size_t> of_q, of_u;  ///< columns, in the order of the tree
};

}  // namespace

struct MotionReader::Work {
  const MechanismDescription& user;
  std::vector<BodyMotion> bodies;
  std::vector<std::vector<std::size_t>> of_body;  ///< pose and speeds; empty: from joints
  std::unique_ptr<ByJoints> joints;
  bool has_speeds = false;
};

MotionReader::MotionReader(const MechanismDescription& user,
                           const std::vector<TrajectoryColumn>& columns, const std::string& file)
    : work_(new Work{user, std::vector<BodyMotion>(user.bodies.size()), {}, nullptr, false}) {
  const Places places(columns);
  const std::size_t pose = user.space == SpaceKind::kPlanar ? 3 : 7;
  std::vector<std::string> no_pose, no_speed;
  work_->of_body.resize(user.bodies.size());
  for (std::size_t b = 1; b < user.bodies.size(); ++b) {
    const auto wanted = BodyColumns(user, b);
    const auto speeds = wanted.begin() + static_cast<std::ptrdiff_t>(pose);
    work_->of_body[b] = places.Of({wanted.begin(), speeds}, &no_pose);
    const auto more = places.Of({speeds, wanted.end()}, &no_speed);
    work_->of_body[b].insert(work_->of_body[b].end(), more.begin(), more.end());
  }
  work_->has_speeds = no_speed.empty();
  if (no_pose.empty()) return;
  work_->of_body.clear();
  std::vector<std::string> no_joint;
  no_speed.clear();
  if (user.space == SpaceKind::kPlanar) {
    work_->joints = std::make_unique<ByJointsIn<Planar>>(user, places, &no_joint, &no_speed);
  } else {
    work_->joints = std::make_unique<ByJointsIn<Spatial>>(user, places, &no_joint, &no_speed);
  }
  work_->has_speeds = no_speed.empty();
  if (no_joint.empty()) return;
  throw std::runtime_error(
      fmt::format("{}: found neither the poses of all bodies nor the coordinates of joints that "
                  "lead to them, expected {}, or else {}",
                  file, Listed(no_pose), Listed(no_joint)));
}

MotionReader::~MotionReader() = default;

bool MotionReader::from_joints() const { return work_->joints != nullptr; }
bool MotionReader::has_speeds() const { return work_->has_speeds; }

const std::vector<BodyMotion>& MotionReader::Read(double t, const std::vector<double>& row) {
  Work& work = *work_;
  if (work.joints) {
    work.joints->Set(t, row, work.has_speeds, &work.bodies);
    return work.bodies;
  }
  const bool planar = work.user.space == SpaceKind::kPlanar;
  const std::size_t pose = planar ? 3 : 7;
  for (std::size_t b = 1; b < work.bodies.size(); ++b) {
    const std::vector<std::size_t>& at = work.of_body[b];
    BodyMotion& body = work.bodies[b];
    body.pose = PoseColumns{at, planar}.At(row.data());
    if (planar) body.angle = row[at[2]];
    if (!work.has_speeds) continue;
    const auto value = [&](std::size_t i) { return row[at[pose + i]]; };
    body.velocity = {value(0), value(1), planar ? 0.0 : value(2)};
    body.angular_velocity = planar ? Eigen::Vector3d(0.0, 0.0, value(2))
                                   : Eigen::Vector3d(value(3), value(4), value(5));
  }
  return work.bodies;
}
namespace {

constexpr std::size_t kBuffer = 1 << 20;
constexpr const char* kPart = ".part";

}  // namespace

TrajectoryWriter::TrajectoryWriter(const std::filesystem::path& path,
                                   const std::vector<TrajectoryColumn>& columns,
                                   const std::vector<std::string>& notes, TrajectoryFormat format)
    : file_(path, Onto::kNoInput, kPart), format_(format) {
  buffer_.reserve(kBuffer);
  if (format_ == TrajectoryFormat::kJsonLines) {
    for (const TrajectoryColumn& column : columns) labels_.push_back(Json(column.Label()).dump());
    return;
  }
  for (const std::string& note : notes) Note(note);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    buffer_ += (i == 0 ? "" : ",") + EscapeCsv(columns[i].Label());
  }
  buffer_ += '\n';
}

void TrajectoryWriter::Note(const std::string& note) {
  buffer_ += "# " + EscapeTerminal(note) + '\n';
}

void TrajectoryWriter::Write(std::span<const double> row) {
  const bool is_json = format_ == TrajectoryFormat::kJsonLines;
  constexpr std::size_t kLongest = 32;
  char digits[kLongest];
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (is_json) {
      buffer_ += i == 0 ? '{' : ',';
      buffer_ += labels_[i];
      buffer_ += ':';
    } else if (i > 0) {
      buffer_ += ',';
    }
    if (std::isfinite(row[i])) {
      buffer_.append(digits, std::to_chars(digits, digits + kLongest, row[i]).ptr);
    } else {
      buffer_ += is_json ? "null" : "nan";
    }
  }
  buffer_ += is_json ? "}\n" : "\n";
  ++rows_;
  if (buffer_.size() >= kBuffer) Flush();
}

void TrajectoryWriter::Flush() {
  file_.Write(buffer_);
  hash_.Add(buffer_);
  buffer_.clear();
}

std::string TrajectoryWriter::Finish(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) {
    if (format_ == TrajectoryFormat::kCsv) Note(note);
  }
  Flush();
  file_.Finish();
  return hash_.Text();
}

void RemovePart(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::remove(path.string() + kPart, error);
}

void RemoveParts(const std::filesystem::path& store_file) {
  std::error_code error;
  const std::filesystem::path folder = TrajectoryPath(store_file, "any").parent_path();
  std::vector<std::filesystem::path> parts;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == kPart) parts.push_back(entry.path());
  }
  for (const auto& part : parts) std::filesystem::remove(part, error);
}

std::filesystem::path TrajectoryOf(const Record& record, const std::filesystem::path& store_file) {
  const std::filesystem::path name = record.Text("trajectory");
  if (name.empty() || name.extension() != ".csv" || name.filename() != name) return {};
  return TrajectoryPath(store_file, name.stem().string());
}

void VerifyTrajectory(const Record& record, const std::filesystem::path& file) {
  const std::string expected = record.Text("trajectory_hash");
  if (expected.empty()) return;
  FnvHash hash;
  std::ifstream in(file, std::ios::binary);
  std::string block(std::size_t{1} << 20, '\0');
  while (in.read(block.data(), static_cast<std::streamsize>(block.size())) || in.gcount() > 0) {
    hash.Add(std::string_view(block).substr(0, static_cast<std::size_t>(in.gcount())));
  }
  if (!in.eof()) FailOn("read", file);
  if (hash.Text() == expected) return;
  throw ChangedFile(
      fmt::format("{}: the file was changed after its run wrote it: found hash {}, expected {}; "
                  "run --rerun all makes it again",
                  file.string(), hash.Text(), expected));
}

namespace {

bool IsAsWritten(const Record& record, const std::filesystem::path& file) try {
  if (!std::filesystem::exists(file)) return false;
  VerifyTrajectory(record, file);
  return true;
} catch (const ChangedFile&) {
  return false;
}

}  // namespace

std::vector<std::string> CopyTrajectories(const std::vector<Record>& records,
                                          const std::vector<std::filesystem::path>& stores,
                                          const std::filesystem::path& target) {
  std::vector<std::string> missing;
  for (const Record& record : records) {
    const std::filesystem::path to = TrajectoryOf(record, target);
    if (to.empty()) continue;
    bool is_there = false;
    for (const std::filesystem::path& store : stores) {
      const std::filesystem::path from = TrajectoryOf(record, store);
      if (!IsAsWritten(record, from)) continue;
      is_there = true;
      std::filesystem::path part = to;
      part += ".part";
      MakeFolderOf(part);
      std::filesystem::copy_file(from, part, std::filesystem::copy_options::overwrite_existing);
      std::filesystem::rename(part, to);
      break;
    }
    if (!is_there) missing.push_back(to.filename().string());
  }
  return missing;
}

}  // namespace loopbench::harness
