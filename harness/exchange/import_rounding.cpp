// Angles and directions that files give with few digits: 1.5708 for a quarter turn.
//
// Loops close, and their redundant constraints are found, to round-off only where such numbers are
// exact. A number stands for an exact one if it is that, rounded or cut off at its last digit.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <sstream>

#include "harness/exchange/import_draft.h"

namespace loopbench::harness {

namespace {

using std::numbers::pi;
using List = std::vector<double>;

/// One in the last digit of a number.
double UnitOf(const std::string& word) {
  const std::size_t end = std::min(word.find_first_of("eE"), word.size());
  const std::size_t point = word.find('.');
  const double decimals = point < end ? static_cast<double>(end - point - 1) : 0.0;
  const double power = end < word.size() ? std::strtod(word.c_str() + end + 1, nullptr) : 0.0;
  return std::pow(10.0, power - decimals);
}

constexpr double kRoundOff = 4.0 * std::numeric_limits<double>::epsilon();  // of a few products
/// Largest error of directions and quaternions that are rounded. Programs compute them from angles
/// such as 3.1416 and 1.5708, which are wrong by 7.4e-6 and 3.7e-6 rad.
constexpr double kLean = 1e-5;

/// `unit`: one in its last digit.
bool Rounds(double number, double unit, double exact) {
  // Two decimals are enough for right angles (1.57, 3.14), three for others. Numbers of more than
  // 14 are as exact as doubles.
  const bool is_right = std::abs(std::remainder(exact, 0.5 * pi)) <= kRoundOff;
  if (unit > (is_right ? 2e-2 : 2e-3) || unit < 5e-15) return false;
  const double cut_off = std::copysign(1.0, exact) * (exact - number);
  constexpr double kHalf = 0.5 + 1e-6;  // both neighbours of a five round it
  return cut_off >= -kHalf * unit && cut_off < unit;
}

/// A multiple of pi/12, hence also of pi/4 and pi/6.
double NearestAngle(double angle) { return std::round(12.0 * angle / pi) / 6.0 * (0.5 * pi); }

/// The nearest unit vector whose squared elements are multiples of 1/12: multiples of pi/4 and pi/6
/// in a plane of two axes, and diagonals. Returns the given numbers if none is within kLean.
List NearestDirection(const List& v) {
  List exact;
  double sum = 0.0;
  for (const double element : v) {
    const double twelfths = std::round(12.0 * element * element);
    exact.push_back(std::copysign(std::sqrt(twelfths / 12.0), element));
    sum += twelfths;
  }
  return sum == 12.0 ? exact : v;
}

/// The nearest quaternion (w, x, y, z) of rotations about x, then y, then z by multiples of pi/12.
List NearestQuaternion(const List& q) {
  const double w = q[0], x = q[1], y = q[2], z = q[3], norm2 = w * w + x * x + y * y + z * z;
  if (!(norm2 > 0.0)) return q;
  const double sine = std::clamp(2.0 * (w * y - z * x) / norm2, -1.0, 1.0);
  constexpr double kUpright = 0.999;  // there, one of the turns about x and z is free
  Eigen::Vector3d angles(0.0, std::asin(sine), -std::copysign(2.0, sine) * std::atan2(x, w));
  if (std::abs(sine) < kUpright) {
    angles.x() = std::atan2(2.0 * (w * x + y * z), norm2 - 2.0 * (x * x + y * y));
    angles.z() = std::atan2(2.0 * (w * z + x * y), norm2 - 2.0 * (y * y + z * z));
  }
  const Eigen::Quaterniond turn = FromRollPitchYaw(angles.unaryExpr(&NearestAngle));
  const double dot = turn.w() * w + turn.x() * x + turn.y() * y + turn.z() * z;
  const double sign = dot < 0.0 ? -1.0 : 1.0;
  return {sign * turn.w(), sign * turn.x(), sign * turn.y(), sign * turn.z()};
}

List Nearest(char kind, List v) {
  if (kind == 'a') return {NearestAngle(v[0])};
  if (kind == 'd') return NearestDirection(v);
  if (kind == 'q') return NearestQuaternion(v);
  if (kind != 'r') return v;
  std::ranges::rotate(v, v.begin() + 3);
  v = NearestQuaternion(v);
  std::ranges::rotate(v, v.begin() + 1);
  return v;
}

std::size_t CountOf(char kind) { return kind == 'd' ? 3 : kind == 'q' || kind == 'r' ? 4 : 1; }

}  // namespace

List ImportDraft::Numbers(const XmlValue& value, std::string_view kinds) {
  std::size_t count = 0;
  for (const char kind : kinds) count += CountOf(kind);
  List numbers = value.Numbers(count, count);
  if (options_.keeps_digits) return numbers;
  std::istringstream text(value.text());
  std::optional<std::string> shown;
  auto at = numbers.begin();
  for (const char kind : kinds) {
    const List given(at, at + static_cast<std::ptrdiff_t>(CountOf(kind)));
    const List exact = Nearest(kind, given);
    const double least = given.size() > 1 ? kLean : kRoundOff;
    bool stands = true;
    std::string word, differs;
    for (std::size_t i = 0; i < given.size() && text >> word; ++i) {
      const double off = std::abs(given[i] - exact[i]);
      stands = stands && (off <= least || Rounds(given[i], UnitOf(word), exact[i]));
      if (off > kRoundOff && differs.empty()) {
        differs = fmt::format("{} is taken as {}", given[i], exact[i]);
      }
    }
    stands = stands && !differs.empty();
    at = std::ranges::copy(stands ? exact : given, at).out;
    if (stands && !shown) shown = differs;
  }
  if (shown && rounded_++ == 0) {
    rounded_note_ = notes_.size();
    Note(value.element(), value.attribute(), *shown);
  }
  return numbers;
}

Eigen::Vector3d ImportDraft::Vector(const XmlValue& value, std::string_view kinds) {
  const List numbers = Numbers(value, kinds);
  return {numbers[0], numbers[1], numbers[2]};
}

}  // namespace loopbench::harness
