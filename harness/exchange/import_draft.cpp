#include "harness/exchange/import_draft.h"

#include <cctype>
#include <cstdlib>
#include <limits>
#include <sstream>

#include "harness/base/text.h"
#include "mechanism/simplify/plane.h"

namespace loopbench::harness {

namespace {

// --planar: projects an imported mechanism onto its plane, with gravity along -y.

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRounding = 1e-12;  // tolerance for parallel axes, as in plane.h

/// Returns ground axes with z = n and y against the in-plane gravity, if any: q_WC.
Quaterniond AxesOfPlane(const Vector3d& n, const Vector3d& gravity) {
  const Vector3d across = gravity - gravity.dot(n) * n;
  if (!(across.norm() > kRounding * gravity.norm())) return Quaterniond(AxesWithNormal(n));
  const Vector3d y = -across.normalized();
  return FromAxes(y.cross(n), y, n);
}

/// Rotates the ground axes of the mechanism; q_CW.
void TurnGround(const Quaterniond& q, MechanismDescription* description) {
  description->gravity = q * description->gravity;
  for (auto& [name, point] : description->bodies[kGround].points) point = q * point;
  for (JointDescription& joint : description->joints) {
    for (JointSide* side : {&joint.from, &joint.to}) {
      if (side->body != kGround) continue;
      side->position = q * side->position;
      side->rotation = RotationVector(q * Quaterniond(PoseOf(*side).R));
    }
  }
  for (ForceDescription& force : description->forces) {
    const ForceParts parts = PartsOf(force);
    for (BodyPoint* point : parts.points) {
      if (point->body == kGround) point->at = q * point->at;
    }
    if (parts.force != nullptr && !*parts.in_body_axes) *parts.force = q * *parts.force;
  }
}

// Angles and directions with few digits in files: 1.5708 for a quarter turn.
//
// Loops close, and their redundant constraints are found, to round-off only if such numbers are
// exact. A number is replaced by an exact value that rounds or truncates to it at its last digit.

using std::numbers::pi;
using List = std::vector<double>;

/// Returns one unit in the last digit of a number.
double UnitOf(const std::string& word) {
  const std::size_t end = std::min(word.find_first_of("eE"), word.size());
  const std::size_t point = word.find('.');
  const double decimals = point < end ? static_cast<double>(end - point - 1) : 0.0;
  const double power = end < word.size() ? std::strtod(word.c_str() + end + 1, nullptr) : 0.0;
  return std::pow(10.0, power - decimals);
}

constexpr double kRoundOff = 4.0 * std::numeric_limits<double>::epsilon();  // of a few products
/// Maximum error of rounded directions and quaternions. Programs compute them from angles such as
/// 3.1416 and 1.5708, with errors of 7.4e-6 and 3.7e-6 rad.
constexpr double kLean = 1e-5;

/// Returns true if `number` is a rounded `exact`. `unit`: one unit in its last digit.
bool Rounds(double number, double unit, double exact) {
  // Two decimals suffice for right angles (1.57, 3.14), three for others. Numbers with more than 14
  // decimals are as exact as doubles.
  const bool is_right = std::abs(std::remainder(exact, 0.5 * pi)) <= kRoundOff;
  if (unit > (is_right ? 2e-2 : 2e-3) || unit < 5e-15) return false;
  const double cut_off = std::copysign(1.0, exact) * (exact - number);
  constexpr double kHalf = 0.5 + 1e-6;  // a final five may be rounded up or down
  return cut_off >= -kHalf * unit && cut_off < unit;
}

/// Returns the nearest multiple of pi/12, which includes multiples of pi/4 and pi/6.
double NearestAngle(double angle) { return std::round(12.0 * angle / pi) / 6.0 * (0.5 * pi); }

/// Returns the nearest unit vector whose squared elements are multiples of 1/12: multiples of pi/4
/// and pi/6 in a plane of two axes, and diagonals. Returns `v` if none is within kLean.
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

/// Returns the nearest quaternion (w, x, y, z) of rotations by multiples of pi/12 about x, y, z.
List NearestQuaternion(const List& q) {
  const double w = q[0], x = q[1], y = q[2], z = q[3], norm2 = w * w + x * x + y * y + z * z;
  if (!(norm2 > 0.0)) return q;
  const double sine = std::clamp(2.0 * (w * y - z * x) / norm2, -1.0, 1.0);
  constexpr double kUpright = 0.999;  // there, one of the rotations about x and z is free
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

/// Eigen's FromTwoVectors would take the compiler eight seconds.
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

ImportDraft::ImportDraft(const XmlElement& root, const ImportOptions& options)
    : at_rest(1), options_(options), elements_{root} {
  description.space = SpaceKind::kSpatial;
  description.bodies[kGround].name = "ground";
}

int ImportDraft::AddBody(const XmlElement& element, const std::string& name) {
  const int index = static_cast<int>(description.bodies.size());
  BodyDescription body;
  body.name = name.empty() ? fmt::format("body{}", index) : name;
  if (name.empty()) {
    while (bodies_.contains(body.name)) body.name += "_";
  } else if (const auto known = bodies_.find(name); known != bodies_.end()) {
    element.Fail(
        "a second body of this name",
        fmt::format("one that is not in use (line {} has it)", elements_[known->second].line()));
  }
  bodies_.emplace(body.name, index);
  if (body.name == description.bodies[kGround].name) {
    body.name += "_";
    while (bodies_.contains(body.name)) body.name += "_";
    Note(element, fmt::format("called \"{}\": \"ground\" is what does not move", body.name));
    bodies_.emplace(body.name, index);
  }
  description.bodies.push_back(body);
  at_rest.emplace_back();
  elements_.push_back(element);
  return index;
}

void ImportDraft::NameJoints() {
  for (const auto& [joint, stem] : stems_) {
    description.joints[joint].name = joints_.Take(stem);
    found_names_.insert(description.joints[joint].name);
  }
  stems_.clear();
}

JointDescription& ImportDraft::AddJoint(const std::string& name, JointType type, const FrameOn& F,
                                        const FrameOn& M) {
  if (!name.empty()) numbers_.emplace(name, static_cast<int>(description.joints.size()));
  JointDescription& joint = description.joints.emplace_back();
  joint.name = name;
  joint.type = type;
  joint.from = {F.body, F.X.p, RotationVector(F.X.q)};
  joint.to = {M.body, M.X.p, RotationVector(M.X.q)};
  return joint;
}

void ImportDraft::AddBall(const XmlElement& element,
                          const std::function<int(const XmlElement&)>& body,
                          const std::function<XmlValue(const XmlElement&)>& point) {
  const auto child = [&](const char* name) {
    return element.RequiredChild((std::string(kDrakeBall) + name).c_str());
  };
  const int a = body(child("_body_A")), b = body(child("_body_B"));
  const Placement P(point(child("_p_AP")).Vector()), Q(point(child("_p_BQ")).Vector());
  AddLoop(element, NameLater("ball"), JointType::kSpherical, {a, P}, {b, Q});
}

bool ImportDraft::AddCoupling(const XmlElement& element, const std::string& name,
                              std::vector<CouplingDescription::Part> parts, double offset) {
  const auto has_coordinate = [&](const CouplingDescription::Part& part) {
    return NumValues(description.joints[part.joint].type, SpaceKind::kSpatial, false) == 1;
  };
  if (!std::ranges::all_of(parts, has_coordinate)) {
    Note(element, kNotCoupled, true);
    return false;
  }
  std::erase_if(parts, [](const CouplingDescription::Part& part) { return part.ratio == 0.0; });
  if (parts.empty()) {
    Note(element, "dropped: all coefficients are 0", offset != 0.0);
    return false;
  }
  if (parts.size() == 1) {
    const auto [joint, ratio] = parts.front();
    description.joints[joint].motions = {{0, Polynomial{{offset / ratio}}}};
  } else {
    description.couplings.push_back({joints_.Take(name), std::move(parts), offset});
  }
  return true;
}

void ImportDraft::AddMimic(const XmlElement& element, int follower,
                           CouplingDescription::Part leader, double offset) {
  const auto next = [&](int joint) {
    const auto found = leaders_.find(joint);
    return found == leaders_.end() ? joint : found->second;
  };
  int first = leader.joint;  // the leader of all leaders; paths to it are halved
  for (; next(first) != first; first = next(first)) leaders_[first] = next(next(first));
  if (first == follower && leader.joint != follower) {
    element.Fail("joints that follow each other", "no cycle");
  }
  AddFollower(element, description.joints[follower].name + " mimic", follower, leader, offset);
  leaders_[follower] = first;
}

void ImportDraft::NoteUnread(std::span<const DroppedReason> reasons) {
  elements_[kGround].ForUnread([&](const XmlElement& element, const std::string& attribute) {
    const auto find = [&](const std::string& what) {
      return std::ranges::find_if(reasons, [&](const DroppedReason& row) { return row.Has(what); });
    };
    if (element.tag().starts_with("xacro:")) {
      element.Fail("an element of xacro", "plain XML, as `xacro FILE` writes it");
    }
    if (attribute.starts_with("xmlns")) return;
    auto known = find(element.tag() + (attribute.empty() ? "" : "@") + attribute);
    if (known == reasons.end() && !attribute.empty()) known = find("@" + attribute);
    if (known == reasons.end()) {
      Note(element, attribute, "dropped: not known to this reader", true);
    } else if (!known->reason.empty()) {
      Note(element, attribute, fmt::format("dropped: {}", known->reason), known->changes_motion);
    }
  });
}

void ImportDraft::MakeBallsPins(const Vector3d& n) {
  std::set<int> balls;
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    JointDescription& joint = description.joints[j];
    if (joint.type != JointType::kSpherical) continue;
    joint.type = JointType::kRevolute;  // the planar motion of a ball
    for (JointSide* side : {&joint.from, &joint.to}) {
      const Quaterniond& q = at_rest[side->body].q;
      side->rotation = RotationVector(q.conjugate() * Quaterniond(AxesWithNormal(n)));
    }
    balls.insert(static_cast<int>(j));
  }
  for (auto* list : {&description.initial.coordinates, &description.initial.speeds}) {
    std::erase_if(*list, [&](const JointValues& one) { return balls.contains(one.joint); });
  }
}

void ImportDraft::GoToPlane() {
  const auto turns = std::ranges::find_if(description.joints, [](const JointDescription& joint) {
    return TraitsOf(joint.type).flat.turns;
  });
  if (turns != description.joints.end()) {
    const Vector3d n = at_rest[turns->from.body].q *
                       (PoseOf(turns->from).R * AxisAlignment(*turns) * Vector3d::UnitZ());
    MakeBallsPins(n);
    TurnGround(AxesOfPlane(n, description.gravity).conjugate(), &description);
  }
  std::string why;
  const std::optional<InPlane> plane = ExpressInPlane(description, &why);
  if (!plane) {
    throw ConfigError(fmt::format(
        "{}: --planar: found that {}, expected a mechanism that moves in one plane", file(), why));
  }
  const double least = kRounding * description.gravity.norm();
  if (std::abs(plane->gravity_dropped) > least) {
    Note(elements_[kGround], fmt::format("gravity of {:.6g} m/s^2 along the normal of the plane "
                                         "dropped: it moves nothing",
                                         plane->gravity_dropped));
  }
  description = plane->description;
  description.gravity =
      description.gravity.unaryExpr([=](double g) { return std::abs(g) <= least ? 0.0 : g; });
}

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
  if (!shown) return numbers;
  rounded_.emplace(value.element().id(), value.attribute());
  if (rounded_.size() == 1) {
    rounded_note_ = notes_.size();
    Note(value.element(), value.attribute(), *shown);
  }
  return numbers;
}

}  // namespace loopbench::harness
