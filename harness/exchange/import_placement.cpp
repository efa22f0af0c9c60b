#include "harness/exchange/import_placement.h"

#include <cctype>
#include <cmath>

namespace loopbench::harness {

namespace {

Eigen::Quaterniond About(int axis, double angle) {
  Eigen::Quaterniond q(std::cos(0.5 * angle), 0.0, 0.0, 0.0);
  q.vec()[axis] = std::sin(0.5 * angle);
  return q;
}

}  // namespace

Eigen::Vector3d RotationVector(const Eigen::Quaterniond& q) {
  const double sine = q.vec().norm();
  if (sine == 0.0) return Eigen::Vector3d::Zero();
  const double angle = 2.0 * std::atan2(sine, std::abs(q.w()));
  return (q.w() < 0.0 ? -angle : angle) / sine * q.vec();
}

Eigen::Quaterniond FromRollPitchYaw(const Eigen::Vector3d& angles) {
  return About(2, angles.z()) * About(1, angles.y()) * About(0, angles.x());
}

Eigen::Quaterniond FromEuler(const std::string& sequence, const Eigen::Vector3d& angles) {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  for (int i = 0; i < 3; ++i) {
    const char letter = sequence[static_cast<std::size_t>(i)];
    const bool fixed = std::isupper(static_cast<unsigned char>(letter)) != 0;
    const Eigen::Quaterniond turn =
        About(std::tolower(static_cast<unsigned char>(letter)) - 'x', angles[i]);
    q = fixed ? turn * q : q * turn;
  }
  return q;
}

/// Eigen's FromTwoVectors takes the compiler eight seconds.
Eigen::Quaterniond TurnOfZ(const Eigen::Vector3d& to) {
  const Eigen::Vector3d z = to.normalized();
  if (z.z() < 0.0) {
    const double across = std::hypot(z.x(), z.y());
    const Eigen::Vector3d axis = across > 0.0
                                     ? Eigen::Vector3d(-z.y() / across, z.x() / across, 0.0)
                                     : Eigen::Vector3d::UnitX();
    return Eigen::Quaterniond(Eigen::AngleAxisd(std::atan2(across, z.z()), axis));
  }
  const double root = std::sqrt(2.0 * (1.0 + z.z())), inverse = 1.0 / root;
  return {0.5 * root, -z.y() * inverse, z.x() * inverse, 0.0};
}

Eigen::Matrix3d InTurnedAxes(const Eigen::Quaterniond& q, const Eigen::Matrix3d& inertia) {
  if (q.vec().isZero(0.0)) return inertia;
  const Eigen::Matrix3d R = q.toRotationMatrix();
  const Eigen::Matrix3d turned = R * inertia * R.transpose();
  return 0.5 * (turned + turned.transpose());
}

Eigen::Matrix3d SymmetricMatrix(double xx, double yy, double zz, double xy, double xz, double yz) {
  Eigen::Matrix3d matrix;
  matrix << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return matrix;
}

}  // namespace loopbench::harness
