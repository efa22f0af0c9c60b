// A published series: numbers of others that a mechanism's runs are held against
// (configs/schema/series.schema.json).
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "mechanism/description/description.h"

namespace loopbench::harness {

/// What records call their reference when it is such a series.
inline constexpr const char* kPublished = "published";

/// What one list of numbers is of.
enum class PublishedKind {
  kPoint,  ///< one coordinate of a named point of a body, in ground axes [m or m/s]
  kAngle,  ///< how far a body of a planar mechanism is turned [rad or rad/s]
  kJoint,  ///< the coordinate of a joint that has one [rad or m, or per second]
};

struct PublishedQuantity {
  PublishedKind kind = PublishedKind::kPoint;
  std::string body, point, joint, axis;  ///< as the file names them; "" where it does not
  bool is_speed = false;
  std::vector<double> values;  ///< by time
  double accuracy = 0.0;       ///< what its source claims, in the unit of the values, > 0
  // in the mechanism that it was read for
  std::size_t index = 0;                         ///< of the body or joint
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< the point, in the body's axes [m]
  int along = 0;                                 ///< 0 to 2: x to z
};

struct PublishedSeries {
  std::string name, source;
  std::vector<double> times;  ///< [s], rising, from 0 on
  std::vector<PublishedQuantity> quantities;
  std::string canonical;  ///< the document without spaces: equal texts are equal series

  /// Times up to `horizon`: those behind it are not reached.
  std::size_t NumWithin(double horizon) const;
};

/// Reads a series of `mechanism`, whose bodies, points and joints it must name; without one names
/// are not looked at. Throws ConfigError with all mistakes.
PublishedSeries ReadPublishedSeries(const std::filesystem::path& path,
                                    const MechanismDescription* mechanism = nullptr);

}  // namespace loopbench::harness
