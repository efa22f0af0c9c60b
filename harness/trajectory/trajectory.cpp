#include "harness/trajectory/trajectory.h"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "harness/record/excerpt.h"
#include "harness/text/files.h"
#include "harness/text/output_file.h"
#include "mechanism/algebra/space.h"

namespace loopbench::harness {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// The next cell of a line from `*at`, which goes behind its comma; beyond the line at the end.
/// Nothing where a quotation mark is not closed or has something behind it.
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
  // what lies beyond doubles is as good as zero or infinity, which says nothing
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
    constexpr std::size_t kMostNotes = 1000;  // more are no notes
    if (notes.size() < kMostNotes) notes.push_back(line_.substr(line_.starts_with("# ") ? 2 : 1));
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

}  // namespace loopbench::harness
