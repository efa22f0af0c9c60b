// Published data that a mechanism's runs are compared with (configs/schema/series.schema.json).
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "mechanism/description/description.h"

namespace loopbench::harness {

/// Name of the reference in records if it is published data.
inline constexpr const char* kPublished = "published";

/// Kind of quantity of one list of numbers.
enum class PublishedKind {
  kPoint,  ///< coordinate of a named point of a body, ground axes [m or m/s]
  kAngle,  ///< rotation angle of a body of a planar mechanism [rad or rad/s]
  kJoint,  ///< coordinate of a joint with one coordinate [rad or m, or per second]
};

struct PublishedQuantity {
  PublishedKind kind = PublishedKind::kPoint;
  std::string body, point, joint, axis;  ///< names in the file; "" if absent
  bool is_speed = false;
  std::vector<double> values;  ///< by time
  double accuracy = 0.0;       ///< uncertainty from the source, in the unit of the values, > 0
  // in the mechanism of the problem
  std::size_t index = 0;                         ///< of the body or joint
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< the point, in the body's axes [m]
  int along = 0;                                 ///< 0 to 2: x to z
};

struct PublishedSeries {
  std::string name, source;
  std::vector<double> times;  ///< [s], rising, from 0 on
  std::vector<PublishedQuantity> quantities;
  std::string canonical;  ///< document without spaces; equal for equal series

  /// Returns the number of times up to `horizon`.
  std::size_t NumWithin(double horizon) const;
};

/// Reads published data. Bodies, points and joints must exist in `mechanism`; if it is null, names
/// are not checked. Throws ConfigError with all errors.
PublishedSeries ReadPublishedSeries(const std::filesystem::path& path,
                                    const MechanismDescription* mechanism = nullptr);

}  // namespace loopbench::harness
