#include "harness/observers/trajectory.h"

#include <cerrno>
#include <cmath>
#include <limits>
#include <set>

#include "harness/base/json_document.h"
#include "harness/base/record.h"
#include "harness/base/text.h"
#include "mechanism/algebra/space.h"

namespace loopbench::harness {

namespace {

constexpr std::size_t kBuffer = 1 << 20;
constexpr const char* kPart = ".part";
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// The cells of a line.
class Cells {
 public:
  explicit Cells(std::string_view line) : line_(line) {}

  bool AtEnd() const { return at_ > line_.size(); }
  /// Returns the next cell; nothing for an unclosed quotation mark, or one followed by other text.
  std::optional<std::string_view> Next() {
    if (at_ >= line_.size() || line_[at_] != '"') {
      const std::size_t end = std::min(line_.find(',', at_), line_.size());
      const std::string_view cell = line_.substr(at_, end - at_);
      at_ = end + 1;
      return cell;
    }
    room_.clear();
    for (std::size_t i = at_ + 1; i < line_.size(); ++i) {
      if (line_[i] == '"' && !line_.substr(i + 1).starts_with('"')) {
        if (i + 1 < line_.size() && line_[i + 1] != ',') return std::nullopt;
        at_ = i + 2;
        return room_;
      }
      if (line_[i] == '"') ++i;  // a doubled one
      room_ += line_[i];
    }
    return std::nullopt;
  }

 private:
  std::string_view line_;
  std::size_t at_ = 0;
  std::string room_;
};

std::string_view Trimmed(std::string_view cell) {
  while (!cell.empty() && cell.front() == ' ') cell.remove_prefix(1);
  while (!cell.empty() && cell.back() == ' ') cell.remove_suffix(1);
  return cell;
}

std::optional<double> NumberIn(std::string_view cell) {
  cell = Trimmed(cell);
  if (cell.empty()) return kNaN;
  if (cell.front() == '+') cell.remove_prefix(1);
  return WholeNumber<double>(cell);  // none beyond the range of doubles
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
  bool has_time = false;
  for (Cells cells(line_); !cells.AtEnd();) {
    const auto cell = cells.Next();
    if (!cell) Refuse("a quotation mark without its end", "labels, quoted by RFC 4180");
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
  if (!NextLine()) {
    if (!has_row_) Refuse("no row", "a motion");
    return false;
  }
  row->clear();
  for (Cells cells(line_); !cells.AtEnd();) {
    const auto cell = cells.Next();
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
    Cells cells(line_);
    std::string cell;
    for (std::size_t k = 0; k <= i; ++k) cell = cells.Next().value_or("");
    const std::string found = Trimmed(cell).empty() ? "an empty cell" : fmt::format("{}", row[i]);
    const std::string label = Excerpt(columns_[i].Label());
    Refuse(fmt::format("{} in \"{}\" at t = {}", found, label, row[time_]), "a finite number");
  }
}

void TrajectoryReader::Refuse(const std::string& found, const std::string& expected) const {
  throw std::runtime_error(fmt::format("{}:{}: found {}, expected {}", path_.string(),
                                       std::max<std::size_t>(number_, 1), found, expected));
}

Trajectory ReadTrajectory(const std::filesystem::path& path) {
  TrajectoryReader reader(path);
  Trajectory trajectory{reader.columns(), {}, reader.time()};
  for (std::vector<double> row; reader.Next(&row);) {
    trajectory.values.insert(trajectory.values.end(), row.begin(), row.end());
  }
  return trajectory;
}

std::optional<std::size_t> FindColumn(const std::vector<TrajectoryColumn>& columns,
                                      std::string_view kind, std::string_view name,
                                      std::string_view component) {
  const auto at = std::ranges::find_if(columns, [&](const TrajectoryColumn& column) {
    return column.kind == kind && column.name == name && column.component == component;
  });
  if (at == columns.end()) return std::nullopt;
  return static_cast<std::size_t>(at - columns.begin());
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
  for (const bool planar : {true, false}) {
    const std::vector<const char*> parts = planar
                                               ? std::vector{"x", "y", "angle"}
                                               : std::vector{"x", "y", "z", "qw", "qx", "qy", "qz"};
    PoseColumns pose{{}, planar};
    for (const char* part : parts) {
      if (const auto at = FindColumn(columns, "body", name, part)) pose.columns.push_back(*at);
    }
    if (pose.columns.size() == parts.size()) return pose;
  }
  return std::nullopt;
}

std::filesystem::path TrajectoryPath(const std::filesystem::path& store_file,
                                     const std::string& id) {
  return store_file.parent_path() / "trajectories" / (id + ".csv");
}
TrajectoryWriter::TrajectoryWriter(const std::filesystem::path& path,
                                   const std::vector<TrajectoryColumn>& columns,
                                   const std::vector<std::string>& notes, TrajectoryFormat format,
                                   Onto onto)
    : file_(path, onto, kPart), format_(format) {
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
  for (const auto& entry : EntriesOf(folder)) {
    if (entry.extension() == kPart) std::filesystem::remove(entry, error);
  }
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
  ForEachBlock(file, [&hash](std::string_view block) { hash.Add(block); });
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
      OutputFile copy(to, Onto::kAnyFile, kPart);
      ForEachBlock(from, [&copy](std::string_view block) { copy.Write(block); });
      copy.Finish();
      break;
    }
    if (!is_there) missing.push_back(to.filename().string());
  }
  return missing;
}

namespace {

std::string_view HowOf(const OutputOptions& output) {
  if (output.accepted_steps) return "accepted steps";
  return output.exact ? "exact times" : "dense output";
}

constexpr const char* kOpen =
    "nan, because redundant constraints share a load in no one way, in {} of {} rows: {}";
constexpr const char* kRegularized =
    "reactions, drives and couplings: nan in {} of {} rows, from {:.6g} s to {:.6g} s, because "
    "constraints of a driven mechanism are regularized near a singular configuration";

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
  moment_.is_regularized = task_.output.Has(OutputPart::kReactions) && has_accelerations &&
                           !system.mechanism().drives().empty() && system.IsSingular();
  if (moment_.is_regularized) {
    has_accelerations = false;
    if (regularized_rows_++ == 0) first_regularized_t_ = t;
    last_regularized_t_ = t;
  }
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
  if (!file_) {
    file_.emplace(task_.path, rows_->columns(), Notes(), TrajectoryFormat::kCsv, Onto::kAnyFile);
  }
  file_->Write(row_);
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
  if (!file_) {
    file_.emplace(task_.path, rows_->columns(), Notes(), TrajectoryFormat::kCsv, Onto::kAnyFile);
  }
  const std::int64_t rows = file_->rows();
  // columns without a value in equally many rows share a line
  std::vector<std::string> notes;
  std::int64_t open = rows_->OpenByRegularization();
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
  if (regularized_rows_ > 0) {
    notes.push_back(fmt::format(kRegularized, regularized_rows_, rows, first_regularized_t_,
                                last_regularized_t_));
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
