// Trajectories as files of a run: layout, reader, writer, their places in a store.
#pragma once

#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/record/record.h"
#include "harness/text/files.h"
#include "harness/text/hash.h"
#include "harness/trajectory/columns.h"
#include "mechanism/description/joint_frames.h"

namespace loopbench::harness {

// A trajectory file: columns of numbers over time.
//
// The file is CSV: lines that begin with "#" are notes, followed by a line of labels (columns.h)
// and a line per time. An unknown number is nan or an empty cell. The writer of a run uses all
// requested columns. The reader also accepts files of other programs with any subset of these
// labels, in any order.

/// Reads a file of any length row by row. Throws std::runtime_error with file, line, found and
/// expected text.
class TrajectoryReader {
 public:
  /// Reads the labels, which must be unique and contain "t [s]". An unknown label becomes a column
  /// with an empty kind, whose component is the text of the label.
  explicit TrajectoryReader(const std::filesystem::path& path);

  const std::vector<TrajectoryColumn>& columns() const { return columns_; }
  std::size_t time() const { return time_; }  ///< column of t
  /// Returns the text of the lines above the labels, without "# ".
  const std::vector<std::string>& notes() const { return notes_; }
  /// Returns the notes below the labels that have been read so far.
  const std::vector<std::string>& later_notes() const { return later_notes_; }

  /// Reads the next row, a number per column; returns false at the end. Times must increase.
  bool Next(std::vector<double>* row);
  /// Throws if one of `columns` is not finite in `row`, the last row read.
  void RequireNumbers(const std::vector<double>& row, std::span<const std::size_t> columns) const;

 private:
  bool NextLine();
  [[noreturn]] void Refuse(const std::string& found, const std::string& expected) const;

  std::filesystem::path path_;
  std::ifstream in_;
  std::string line_;
  std::size_t number_ = 0, time_ = 0;  ///< line number, from 1; column of t
  double last_t_ = 0.0;
  bool has_row_ = false;
  std::vector<TrajectoryColumn> columns_;
  std::vector<std::string> notes_, later_notes_;
};

/// All rows of a file.
struct Trajectory {
  std::vector<TrajectoryColumn> columns;
  std::vector<std::string> notes;
  std::vector<double> values;  ///< row after row
  std::size_t time = 0;        ///< column of t

  std::size_t rows() const { return columns.empty() ? 0 : values.size() / columns.size(); }
  double At(std::size_t row, std::size_t column) const {
    return values[row * columns.size() + column];
  }
  /// Returns the column of `name` as written in the mechanism. With `is_label`, the name of a point
  /// is LabelName(body) + ":" + LabelName(point).
  std::optional<std::size_t> Find(std::string_view kind, std::string_view name,
                                  std::string_view component, bool is_label = false) const;
};
Trajectory ReadTrajectory(const std::filesystem::path& path);

/// Columns that hold the pose of a body.
struct PoseColumns {
  std::vector<std::size_t> columns;  ///< x, y, angle, or x, y, z, qw, qx, qy, qz
  bool planar = true;

  /// Returns the pose in a row; NaN if a number is NaN. Normalizes the quaternion.
  Frame At(const double* row) const;
};
/// Returns nothing if a column of the pose is missing.
std::optional<PoseColumns> FindPose(const std::vector<TrajectoryColumn>& columns,
                                    std::string_view body);

/// Returns the path trajectories/ID.csv next to a store's `file`.
std::filesystem::path TrajectoryPath(const std::filesystem::path& store_file,
                                     const std::string& id);

// Writes a trajectory row by row, with fixed memory.
//
// Rows go to PATH.part, which is renamed to PATH when complete: PATH is never a partial file. The
// destructor deletes an unfinished part. A killed process leaves its part for RemoveParts().

enum class TrajectoryFormat { kCsv, kJsonLines };

class TrajectoryWriter {
 public:
  /// Creates missing folders. In CSV, `notes` become lines with "#". This class throws
  /// std::runtime_error on system errors.
  TrajectoryWriter(const std::filesystem::path& path, const std::vector<TrajectoryColumn>& columns,
                   const std::vector<std::string>& notes,
                   TrajectoryFormat format = TrajectoryFormat::kCsv);
  TrajectoryWriter(const TrajectoryWriter&) = delete;
  TrajectoryWriter& operator=(const TrajectoryWriter&) = delete;

  /// Writes numbers that can be read back exactly; missing values as nan, in JSON as null.
  void Write(std::span<const double> row);
  std::int64_t rows() const { return rows_; }

  /// Completes the file on disk; call once. Returns the hash of all its bytes.
  std::string Finish(const std::vector<std::string>& notes = {});

 private:
  void Note(const std::string& note);
  void Flush();

  OutputFile file_;
  FnvHash hash_;
  TrajectoryFormat format_;
  std::vector<std::string> labels_;  ///< labels as JSON strings
  std::string buffer_;
  std::int64_t rows_ = 0;
};

/// Removes unfinished parts of killed runs from the trajectory folder next to a store's `file`, or
/// the part of one `path`.
void RemoveParts(const std::filesystem::path& store_file);
void RemovePart(const std::filesystem::path& path);

// Trajectories of a store: the files that its records refer to.

/// Returns the trajectory file of a record, next to the store's `file`; empty if the record has
/// none. Names outside the folder of trajectories are ignored.
std::filesystem::path TrajectoryOf(const Record& record, const std::filesystem::path& store_file);

/// Error for a file of a store that has changed since its run.
class ChangedFile : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws ChangedFile unless the file has the "trajectory_hash" of its record, or the record has
/// none (version 1.0).
void VerifyTrajectory(const Record& record, const std::filesystem::path& file);

/// Copies each trajectory of `records` completely from the first of `stores` that has it to the
/// folder of `target`. Returns the names of trajectories that no store has unchanged.
std::vector<std::string> CopyTrajectories(const std::vector<Record>& records,
                                          const std::vector<std::filesystem::path>& stores,
                                          const std::filesystem::path& target);

}  // namespace loopbench::harness
