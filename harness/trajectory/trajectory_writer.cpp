#include "harness/trajectory/trajectory_writer.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <utility>

#include "harness/json/json_document.h"
#include "harness/text/escape.h"
#include "harness/trajectory/trajectory.h"

namespace loopbench::harness {
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

}  // namespace loopbench::harness
