#include "odca/path_links.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mechanism/loops/loop_solver.h"
#include "odca/join_order.h"

namespace loopbench::odca::pins {

namespace {

using Vector = Vector2<double>;
constexpr Vector kNone = {0.0, 0.0};

Vector Turned(const Vector& r, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * r.x - s * r.y, s * r.x + c * r.y};
}

Path Reversed(Path path) {
  std::ranges::reverse(path);
  for (std::size_t k = path.size() - 1; k > 0; --k) path[k].before = path[k - 1].before;
  path.front().before = -1;
  return path;
}

std::optional<PathLinks> MeasureInOrder(const Mechanism<Planar, double>& mechanism, Path path) {
  const auto joint = [&](int index) { return index < 0 ? nullptr : &mechanism.joints()[index]; };
  const auto is_cut = [](const Joint<Planar, double>* one) {
    return one != nullptr && !one->in_tree();
  };
  PathLinks all;
  for (std::size_t k = 0; k < path.size(); ++k) {
    const PathBody& at = path[k];
    const bool last = k + 1 == path.size();
    const auto *before = joint(at.before), *ground = joint(at.ground);
    const auto* after = last ? nullptr : joint(path[k + 1].before);
    const auto* pin = is_cut(ground) ? nullptr : ground;
    if (is_cut(before) && pin == nullptr) return std::nullopt;
    if (is_cut(ground)) {
      if (!last) return std::nullopt;
      after = ground;
      all.ends_at_ground = true;
      all.ground_is_P = ground->from == kGround;
      all.end = ArmOf(*ground, kGround);
      all.end_limit = LimitOf(mechanism, at.ground);
    }
    const auto arm = [&](const Joint<Planar, double>* one) {
      return one == nullptr ? kNone : ArmOf(*one, at.body);
    };
    const Vector at_pin = arm(pin), at_before = arm(before), at_after = arm(after);
    const Vector on_ground = pin == nullptr ? kNone : ArmOf(*pin, kGround);
    double axes = 0.0;
    all.links.push_back(MeasureLink(
        mechanism.bodies()[at.body], mechanism.gravity(), pin == nullptr ? nullptr : &at_pin,
        before == nullptr ? nullptr : &at_before, after == nullptr ? nullptr : &at_after, &axes));
    all.axes.push_back(axes);
    const bool cut = is_cut(before), cut_here = cut && before->from == at.body;
    all.closures.push_back({.follows = pin == nullptr ? 1.0 : 0.0,
                            .pin_x = on_ground.x,
                            .pin_y = on_ground.y,
                            .cut_here = cut_here ? 1.0 : 0.0,
                            .cut_before = cut && !cut_here ? 1.0 : 0.0,
                            .inverse_radius = 1.0 / all.links.back().radius});
    all.has_loops = all.has_loops || cut || is_cut(ground);
  }
  all.path = std::move(path);
  return all;
}

}  // namespace

Vector ArmOf(const Joint<Planar, double>& joint, int body) {
  const auto& p = (joint.from == body ? joint.X_PF : joint.X_QM).p;
  return {p[0], p[1]};
}

std::vector<Path> FindPaths(int num_bodies, std::span<const PlanJoint> joints) {
  std::vector<int> to_ground(num_bodies, -1);
  for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
    if (joints[j].from != 0 && joints[j].to != 0) continue;
    int& own = to_ground[joints[j].from + joints[j].to];
    if (own >= 0) return {};
    own = j;
  }
  const std::vector<int> none(num_bodies, 0);
  const BodyGraph graph(num_bodies, joints, none);
  std::vector<bool> seen(num_bodies, false);
  std::vector<Path> paths;
  int found = 1;  // Ground
  for (int first = 1; first < num_bodies; ++first) {
    if (graph.degree(first) > 2) return {};
    if (graph.degree(first) == 2 || seen[first]) continue;
    Path& path = paths.emplace_back();
    BodyGraph::End next = {.body = first, .joint = -1};
    for (int body = 0; next.body > 0; ++found) {
      body = std::exchange(next.body, 0);
      const int before = std::exchange(next.joint, -1);
      if (seen[body]) return {};
      seen[body] = true;
      path.push_back({body, before, to_ground[body]});
      for (const BodyGraph::End& end : graph.ends(body)) {
        if (end.joint != before) next = end;
      }
    }
  }
  if (found < num_bodies) return {};  // a ring
  return paths;
}

Link<double> MeasureLink(const Inertia<Planar, double>& inertia,
                         const Linear<Planar, double>& gravity, const Vector* pin,
                         const Vector* before, const Vector* after, double* axes_found) {
  const Vector origin = pin == nullptr ? kNone : *pin;
  const Vector r1 = before == nullptr ? kNone : *before - origin;
  const double axes = std::atan2(r1.y, r1.x);
  if (axes_found != nullptr) *axes_found = axes;
  const Vector r2 = after == nullptr ? kNone : Turned(*after - origin, -axes);
  const Vector com = Turned(-origin, -axes);
  const double m = inertia.mass, gx = gravity[0], gy = gravity[1];
  const double radius = std::sqrt(inertia.rotational(0, 0) + m * (com.x * com.x + com.y * com.y));
  const bool moves = pin == nullptr;
  return {.x1 = std::hypot(r1.x, r1.y) / radius,
          .x2 = r2.x / radius,
          .y2 = r2.y / radius,
          .mobility = moves ? 1.0 / m : 0.0,
          .gx = moves ? gx : 0.0,
          .gy = moves ? gy : 0.0,
          .cosine = m / radius * (com.x * gy - com.y * gx),
          .sine = -m / radius * (com.y * gy + com.x * gx),
          .radius = radius,
          .limit = 0.0};
}

std::optional<PathLinks> MeasurePath(const Mechanism<Planar, double>& mechanism, const Path& path) {
  std::optional<PathLinks> all = MeasureInOrder(mechanism, path);
  return all ? all : MeasureInOrder(mechanism, Reversed(path));
}

bool HasOnlyPins(const Mechanism<Planar, double>& mechanism) {
  const auto is_pin = [](const Joint<Planar, double>& joint) {
    return joint.kind == &KindOf<Planar, double>(JointType::kRevolute) && joint.num_drives == 0 &&
           joint.num_released == 0;
  };
  return mechanism.num_u() > 0 && std::ranges::all_of(mechanism.joints(), is_pin);
}

double LimitOf(const Mechanism<Planar, double>& mechanism, int index) {
  const Joint<Planar, double>& joint = mechanism.joints()[index];
  double trace = 0.0;
  for (const int body : {joint.from, joint.to}) {
    if (body == kGround) continue;
    const Inertia<Planar, double>& inertia = mechanism.bodies()[body];
    const Vector r = ArmOf(joint, body);
    trace += 2.0 / inertia.mass + (r.x * r.x + r.y * r.y) * inertia.rotational_inverse(0, 0);
  }
  return LoopSolver<double>::kSuspicious * trace;
}

}  // namespace loopbench::odca::pins
