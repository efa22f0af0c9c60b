// Kinds of joints: their transforms and what is zero while they hold.
#include <array>
#include <cmath>

#include "tests/contract/oracle_parts.h"

namespace loopbench::testing {

namespace {

JetMatrix AboutZ(const Jet& angle) {
  JetMatrix R = JetIdentity();
  R(0, 0) = R(1, 1) = Cos(angle);
  R(1, 0) = Sin(angle);
  R(0, 1) = -R(1, 0);
  return R;
}

JetMatrix AboutX(const Jet& angle) {
  JetMatrix R = JetIdentity();
  R(1, 1) = R(2, 2) = Cos(angle);
  R(2, 1) = Sin(angle);
  R(1, 2) = -R(2, 1);
  return R;
}

JetMatrix AboutY(const Jet& angle) {
  JetMatrix R = JetIdentity();
  R(0, 0) = R(2, 2) = Cos(angle);
  R(0, 2) = Sin(angle);
  R(2, 0) = -R(0, 2);
  return R;
}

/// Returns the rotation of a quaternion of any length.
JetMatrix FromQuaternion(const Jet* e) {
  const Jet &w = e[0], &x = e[1], &y = e[2], &z = e[3];
  const Jet s = Reciprocal(w * w + x * x + y * y + z * z), two(2);
  const std::array<Jet, 9> m = {
      w * w + x * x - y * y - z * z, two * (x * y - w * z),         two * (x * z + w * y),
      two * (x * y + w * z),         w * w - x * x + y * y - z * z, two * (y * z - w * x),
      two * (x * z - w * y),         two * (y * z + w * x),         w * w - x * x - y * y + z * z};
  JetMatrix R;
  for (int i = 0; i < 9; ++i) R.m[i] = s * m[i];
  return R;
}

/// Vector of a rotation matrix near the identity: half its skew part.
JetVector SmallTurn(const JetMatrix& R) {
  const Jet half(Real(1) / 2);
  return {half * (R(2, 1) - R(1, 2)), half * (R(0, 2) - R(2, 0)), half * (R(1, 0) - R(0, 1))};
}

}  // namespace

Sizes SizesOf(JointType type, bool spatial) {
  switch (type) {
    case JointType::kWeld:
    case JointType::kRod:
      return {0, 0};
    case JointType::kFree:
      return spatial ? Sizes{7, 6} : Sizes{3, 3};
    case JointType::kPinInSlot:
    case JointType::kCylindrical:
    case JointType::kUniversal:
      return {2, 2};
    case JointType::kSpherical:
      return {4, 3};
    case JointType::kPlanar:
    case JointType::kTranslation:
      return {3, 3};
    case JointType::kSchoenflies:
      return {4, 4};
    case JointType::kPointOnLine:
      return {5, 4};
    case JointType::kPointInPlane:
      return {6, 5};
    default:
      return {1, 1};
  }
}

Mismatch DriveMismatch(const JointDescription& joint, int coordinate, const JetPose& X,
                       const Jet& s) {
  // the sine of the difference of two angles grows as the difference does
  const auto beyond = [&s](const Jet& cosine, const Jet& sine) {
    return sine * Cos(s) - cosine * Sin(s);
  };
  if (joint.type == JointType::kUniversal) {
    Real6 along = Real6::Zero();
    for (int i = 0; i < 3; ++i) along[i] = coordinate == 0 ? Real(i == 0) : X.R(i, 1).f;
    return {along, coordinate == 0 ? beyond(X.R(1, 1), X.R(2, 1)) : beyond(X.R(0, 0), X.R(0, 2))};
  }
  if (joint.type == JointType::kPrismatic || joint.type == JointType::kTranslation) {
    return {Real6::Unit(3 + coordinate), X.p[coordinate] - s};
  }
  const Jet angle = beyond(X.R(0, 0), X.R(1, 0));
  if (joint.type == JointType::kHelical) {
    const Real pitch = joint.parameter;
    return {Real6::Unit(2) + pitch * Real6::Unit(5), Jet(1 + pitch * pitch) * angle};
  }
  if (coordinate == 0) return {Real6::Unit(2), angle};
  const int axis = joint.type == JointType::kCylindrical ? 2 : coordinate - 1;
  return {Real6::Unit(3 + axis), X.p[axis] - s};
}

std::vector<Mismatch> Mismatches(const JointDescription& joint, bool spatial, const JetPose& X) {
  const JointType type = joint.type;
  std::vector<Mismatch> c;
  if (type == JointType::kRod) {
    const Jet distance = Sqrt(X.p[0] * X.p[0] + X.p[1] * X.p[1] + X.p[2] * X.p[2]);
    Real6 along = Real6::Zero();
    for (int i = 0; i < 3; ++i) along[3 + i] = X.p[i].f / distance.f;
    return {{along, distance - Jet(joint.parameter)}};
  }
  const auto add = [&c](int axis, const Jet& value) { c.push_back({Real6::Unit(axis), value}); };
  const JetVector turn = SmallTurn(X.R);
  const auto is = [type](auto... types) { return ((type == types) || ...); };
  const bool in_plane = is(JointType::kRevolute, JointType::kPinInSlot, JointType::kCylindrical,
                           JointType::kPlanar, JointType::kHelical, JointType::kSchoenflies);
  if (!spatial) {
    if (!in_plane) add(2, turn[2]);
    if (!is(JointType::kPrismatic, JointType::kPinInSlot)) add(3, X.p[0]);
    add(4, X.p[1]);
    return c;
  }
  if (in_plane) {
    // the tip of M's z axis moves with [wy, -wx]
    add(0, -X.R(1, 2));
    add(1, X.R(0, 2));
  } else if (type == JointType::kUniversal) {
    // x of F stays normal to y of M: (x . y_M)' = -w . (x cross y_M)
    Real6 normal = Real6::Zero();
    normal[1] = -X.R(2, 1).f;
    normal[2] = X.R(1, 1).f;
    c.push_back({normal, -X.R(0, 1)});
  } else if (!is(JointType::kSpherical, JointType::kPointOnLine, JointType::kPointInPlane)) {
    for (int i = 0; i < 3; ++i) add(i, turn[i]);
  }
  if (is(JointType::kTranslation, JointType::kSchoenflies)) return c;
  const bool free_xy = is(JointType::kPlanar, JointType::kPointInPlane);
  const bool free_x =
      free_xy || is(JointType::kPrismatic, JointType::kPinInSlot, JointType::kPointOnLine);
  if (!free_x) add(3, X.p[0]);
  if (!free_xy) add(4, X.p[1]);
  if (type == JointType::kHelical) {
    const Real pitch = joint.parameter, length = std::sqrt(1 + pitch * pitch);
    Real6 along = Real6::Zero();
    along[2] = -pitch / length;
    along[5] = 1 / length;
    Jet ahead = X.p[2] - Jet(pitch) * Angle(X.R(0, 0), X.R(1, 0));
    ahead.f = std::remainder(ahead.f, 2 * std::acos(Real(-1)) * pitch);  // whole turns
    c.push_back({along, ahead * Jet(1 / length)});
  } else if (type != JointType::kCylindrical) {
    add(5, X.p[2]);
  }
  return c;
}

JetPose Transform(JointType type, bool spatial, const Jet* q, Real pitch) {
  JetPose X;
  switch (type) {
    case JointType::kWeld:
      break;
    case JointType::kRevolute:
      X.R = AboutZ(q[0]);
      break;
    case JointType::kPrismatic:
      X.p[0] = q[0];
      break;
    case JointType::kPinInSlot:
      X.R = AboutZ(q[0]);
      X.p[0] = q[1];
      break;
    case JointType::kCylindrical:
      X.R = AboutZ(q[0]);
      X.p[2] = q[1];
      break;
    case JointType::kRod:
      for (int i = 0; i < (spatial ? 3 : 2); ++i) X.p[i] = q[i];
      break;
    case JointType::kHelical:
      X.R = AboutZ(q[0]);
      X.p[2] = Jet(pitch) * q[0];
      break;
    case JointType::kSpherical:
      X.R = FromQuaternion(q);
      break;
    case JointType::kUniversal:
      X.R = AboutX(q[0]) * AboutY(q[1]);
      break;
    case JointType::kTranslation:
      X.p = {q[0], q[1], q[2]};
      break;
    case JointType::kSchoenflies:
      X.R = AboutZ(q[0]);
      X.p = {q[1], q[2], q[3]};
      break;
    case JointType::kPointOnLine:
      X.R = FromQuaternion(q);
      X.p[0] = q[4];
      break;
    case JointType::kPointInPlane:
      X.R = FromQuaternion(q);
      X.p = {q[4], q[5], Jet(0)};
      break;
    case JointType::kFree:
      if (spatial) {
        X.R = FromQuaternion(q);
        X.p = {q[4], q[5], q[6]};
        break;
      }
      [[fallthrough]];
    case JointType::kPlanar:
      X.R = AboutZ(q[0]);
      X.p = {q[1], q[2], Jet(0)};
  }
  return X;
}

}  // namespace loopbench::testing
