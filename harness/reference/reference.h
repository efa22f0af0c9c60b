// A reference: what a mechanism does at given times, with the error that it is certified to.
//
// harness/precision/make_reference.h makes them; here is what they hold, and the file they are kept
// in: one line of JSON with a checksum (harness/record/record_json.h).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/reference/snapshot.h"

namespace loopbench::harness {

/// Errors are held against a reference up to the time where its own exceeds this share of a link:
/// a tenth of the least error of runs in double that is told from round-off over long horizons.
inline constexpr double kCertifiedShare = 1e-9;

struct Reference {
  /// Name of the outcome of its start, or of the first witness that ended early.
  std::string outcome = "finished";
  std::string message;  ///< why there is none, or it ends early
  /// "long-double", "gragg 20(19): lagrange 1e-17, lagrange 1e-15, odca 1e-16".
  std::string scalar, witnesses;
  std::vector<double> times;        ///< [s], the start and the end among them
  std::vector<Snapshot> snapshots;  ///< by time, as far as the witnesses got
  std::vector<Distance> bounds;     ///< certified errors of the snapshots; `late` is not known
  double trust_horizon = 0.0;       ///< [s] of the last time before bounds exceed kCertifiedShare
  double cpu_s = 0.0;
  std::int64_t rhs_evaluations = 0;  ///< of all witnesses

  /// The largest bound up to the trust horizon.
  Distance Certified() const;
  /// Number of times up to the trust horizon.
  std::size_t NumTrusted() const;
};

/// The name of a scene's reference: what decides it, and no version of this program, so that none
/// is made again for nothing.
std::string ReferenceId(const ExperimentScene& scene, double horizon,
                        const ReferenceOptions& options);

/// The file of a reference beside a store's `file`.
std::filesystem::path ReferencePath(const std::filesystem::path& store_file, const std::string& id);

void WriteReference(const std::filesystem::path& path, const std::string& id,
                    const MechanismDescription& user, const Reference& reference);
/// Nothing where there is no such file. Throws std::runtime_error, with the file's name, for one
/// that is damaged or another's.
std::optional<Reference> ReadReference(const std::filesystem::path& path, const std::string& id,
                                       const MechanismDescription& user);

}  // namespace loopbench::harness
