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

// A trajectory as it stands in a file: columns of numbers over time.
//
// The file is CSV: lines that begin with "#" say what it is, then a line of labels (columns.h),
// then a line per time. A number that is not known is nan or an empty cell. What writes one
// (trajectory.h) uses all columns that it was asked for; what reads one takes those of
// another program that have the same labels, however few, in any order.

/// Row by row, for files of any length. Errors are std::runtime_error with file, line, what was
/// found and what was expected.
class TrajectoryReader {
 public:
  /// Reads the labels, of which "t [s]" must be one, and none twice. One that is no label is a
  /// column with an empty kind, whose component is its text.
  explicit TrajectoryReader(const std::filesystem::path& path);

  const std::vector<TrajectoryColumn>& columns() const { return columns_; }
  std::size_t time() const { return time_; }  ///< column of t
  /// What the lines above the labels say, without "# ".
  const std::vector<std::string>& notes() const { return notes_; }
  /// The same of lines below the labels, as far as they have been read.
  const std::vector<std::string>& later_notes() const { return later_notes_; }

  /// The next row, a number per column; false at the end. Times rise.
  bool Next(std::vector<double>* row);
  /// Throws where one of `columns` has no finite number in `row`, the last one read.
  void RequireNumbers(const std::vector<double>& row, std::span<const std::size_t> columns) const;

 private:
  bool NextLine();
  [[noreturn]] void Refuse(const std::string& found, const std::string& expected) const;

  std::filesystem::path path_;
  std::ifstream in_;
  std::string line_;
  std::size_t number_ = 0, time_ = 0;  ///< of the line, from 1; column of t
  double last_t_ = 0.0;
  bool has_row_ = false;
  std::vector<TrajectoryColumn> columns_;
  std::vector<std::string> notes_, later_notes_;
};

/// All of a file.
struct Trajectory {
  std::vector<TrajectoryColumn> columns;
  std::vector<std::string> notes;
  std::vector<double> values;  ///< row after row
  std::size_t time = 0;        ///< column of t

  std::size_t rows() const { return columns.empty() ? 0 : values.size() / columns.size(); }
  double At(std::size_t row, std::size_t column) const {
    return values[row * columns.size() + column];
  }
  /// `name` as it stands in the mechanism; that of a point is LabelName(body) + ":" +
  /// LabelName(point), with `is_label`.
  std::optional<std::size_t> Find(std::string_view kind, std::string_view name,
                                  std::string_view component, bool is_label = false) const;
};
Trajectory ReadTrajectory(const std::filesystem::path& path);

/// Where the pose of a body stands in rows.
struct PoseColumns {
  std::vector<std::size_t> columns;  ///< x, y, angle, or x, y, z, qw, qx, qy, qz
  bool planar = true;

  /// The pose in a row, which is NaN where a number is. A quaternion may be of any length.
  Frame At(const double* row) const;
};
/// Nothing where the pose is not there, or not all of it.
std::optional<PoseColumns> FindPose(const std::vector<TrajectoryColumn>& columns,
                                    std::string_view body);

/// trajectories/ID.csv beside a store's `file`.
std::filesystem::path TrajectoryPath(const std::filesystem::path& store_file,
                                     const std::string& id);

// Writes a trajectory row by row, in memory of a fixed size.
//
// Rows go to PATH.part, which takes its name when all are there: who reads PATH finds all of it or
// nothing. A writer that goes without Finish() takes its part with it; one that is killed leaves
// it, for RemoveParts().

enum class TrajectoryFormat { kCsv, kJsonLines };

class TrajectoryWriter {
 public:
  /// Makes missing folders. `notes` become lines with "#", of CSV alone. Throws std::runtime_error,
  /// here and below, where the system refuses.
  TrajectoryWriter(const std::filesystem::path& path, const std::vector<TrajectoryColumn>& columns,
                   const std::vector<std::string>& notes,
                   TrajectoryFormat format = TrajectoryFormat::kCsv);
  TrajectoryWriter(const TrajectoryWriter&) = delete;
  TrajectoryWriter& operator=(const TrajectoryWriter&) = delete;

  /// Numbers with as many digits as tell them from their neighbours; nan, in JSON null.
  void Write(std::span<const double> row);
  std::int64_t rows() const { return rows_; }

  /// Once, at the end: the file is on the disk. Returns the hash of all its bytes.
  std::string Finish(const std::vector<std::string>& notes = {});

 private:
  void Note(const std::string& note);
  void Flush();

  OutputFile file_;
  FnvHash hash_;
  TrajectoryFormat format_;
  std::vector<std::string> labels_;  ///< of JSON, as it has them
  std::string buffer_;
  std::int64_t rows_ = 0;
};

/// What killed runs have left in the folder of trajectories beside a store's `file`, or one of
/// them.
void RemoveParts(const std::filesystem::path& store_file);
void RemovePart(const std::filesystem::path& path);

// Trajectories of a store: the files that its records name.

/// The file of a record's trajectory, beside the store's `file`; empty where the record has none.
/// Only a name within the folder of trajectories is one.
std::filesystem::path TrajectoryOf(const Record& record, const std::filesystem::path& store_file);

/// A file beside a store that is not as a run wrote it.
class ChangedFile : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws ChangedFile unless the file has the "trajectory_hash" of its record, or the record has
/// none (of version 1.0).
void VerifyTrajectory(const Record& record, const std::filesystem::path& file);

/// Copies the trajectories of `records` from the first of the `stores` that has them to beside
/// `target`, each whole or not at all. Returns the names of those that no store has as its run
/// wrote them.
std::vector<std::string> CopyTrajectories(const std::vector<Record>& records,
                                          const std::vector<std::filesystem::path>& stores,
                                          const std::filesystem::path& target);

}  // namespace loopbench::harness
