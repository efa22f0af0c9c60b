#include "odca/join_order.h"

#include <algorithm>
#include <bit>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <set>
#include <tuple>
#include <utility>

namespace loopbench::odca {

namespace {

/// Multiply-adds of a node with `rows` rows, `handles` bodies before it and `kept` after it, each
/// with `dim` directions, as `Sweep::operations()` counts them when each joint meets both sides.
double JoinCost(double rows, double handles, double kept, double dim) {
  const double triangle = rows * (rows + 1) / 2;
  const double response = rows * handles * dim * dim + 2 * dim * triangle;
  const double factor = rows * rows * rows / 6 + rows + dim * triangle * kept;
  const double eliminate = rows * dim * dim * kept * (kept + 1) / 2;
  const double vectors = 2 * rows * (2 * dim + dim * kept + rows / 2);
  return response + factor + eliminate + vectors;
}

/// Cost of a list of joins.
struct JoinSum {
  double cost = 0.0;  ///< multiply-adds
  int handles = 0;    ///< of the largest join
  long looks = 0;     ///< number of joint evaluations: the cost of finding the list
};

/// Counts for every body of the graph; allocated once and reused for one set of bodies at a time.
struct BodyMarks {
  explicit BodyMarks(int num_bodies) : part_of(num_bodies, -1), open(part_of), closing(part_of) {}
  std::vector<int> part_of;  ///< the body's assembly; -1 outside the set that is being joined
  std::vector<int> open;     ///< joints of the body that no join has closed yet
  std::vector<int> closing;  ///< how many of these the pair under examination would close
};

/// Boundaries up to this many bodies count as equal: boundaries of chains and ladders.
constexpr int kFew = 4;
/// Pairs of a part with more neighbours (a hub), and pairs with more joints, are looked at again
/// only when their turn comes.
constexpr std::size_t kMany = 16;

/// The class of a boundary is 0 up to kFew bodies and grows by one with each factor sqrt(2) beyond.
int BoundaryClass(int boundary) {
  if (boundary <= kFew) return 0;
  const auto area = static_cast<unsigned long>(boundary) * static_cast<unsigned long>(boundary);
  return static_cast<int>(std::bit_width((area - 1) / (kFew * kFew)));
}

/// Joins the assemblies of one connected set of bodies. An object of one use.
class Pairing {
 public:
  /// `marks->part_of` of each body in `bodies` is the index 0, 1, .. of its assembly; assemblies
  /// have the numbers `names`.
  Pairing(const BodyGraph& graph, std::span<const int> bodies, std::span<const int> names, int dim,
          BodyMarks* marks)
      : num_bodies_(graph.num_bodies()), dim_(dim), marks_(*marks), parts_(names.size()) {
    for (std::size_t p = 0; p < names.size(); ++p) {
      parts_[p].name = names[p];
      parts_[p].first = std::numeric_limits<int>::max();
    }
    for (int body : bodies) {
      const int mine = marks_.part_of[body];
      int& open = marks_.open[body];
      open = graph.degree(body);
      marks_.closing[body] = 0;
      for (const BodyGraph::End& end : graph.ends(body)) {
        const int other = marks_.part_of[end.body];
        if (other == mine) --open;
        // each joint once, from its lower body: bonds are numbered in the order of bodies
        if (other < 0 || other == mine || end.body < body) continue;
        const auto [it, fresh] = parts_[mine].bonds.emplace(other, static_cast<int>(bonds_.size()));
        if (fresh) {
          parts_[other].bonds.emplace(mine, it->second);
          bonds_.push_back({mine, other, 0, {}});
        }
        Bond& bond = bonds_[it->second];
        bond.rows += end.rows;
        bond.joints.push_back({body, end.body});
      }
      Part& part = parts_[mine];
      part.first = std::min(part.first, body);
      ++part.bodies;
      part.boundary += open > 0;
    }
  }

  /// Appends to the joins of the whole graph.
  JoinSum Run(std::vector<Join>* joins) {
    for (int bond = 0; bond < static_cast<int>(bonds_.size()); ++bond) queue_.push(KeyOf(bond));
    while (!queue_.empty()) {
      const Key key = queue_.top();
      queue_.pop();
      if (bonds_[key.bond].joints.empty()) continue;
      // joins made since then may have made this pair worse; for pairs of a hub only a change of
      // class counts, or each join would return all of them
      const Key now = KeyOf(key.bond);
      const auto neighbours = [&](int part) { return parts_[part].bonds.size(); };
      const Bond& bond = bonds_[key.bond];
      const bool hub = std::max(neighbours(bond.a), neighbours(bond.b)) > kMany;
      const bool worse_class = std::tie(now.boundary_class, now.size_class) >
                               std::tie(key.boundary_class, key.size_class);
      if (worse_class || (now > key && !hub)) {
        queue_.push(now);
      } else {
        Merge(key.bond, joins);
      }
    }
    return sum_;
  }

 private:
  struct Part {
    int name = 0;
    int first = 0;  ///< lowest body: decides which side is left
    int bodies = 0;
    int boundary = 0;          ///< bodies with joints still to come
    std::map<int, int> bonds;  ///< by other part
  };
  /// All joints between two parts.
  struct Bond {
    int a = 0, b = 0;
    int rows = 0;
    std::vector<std::pair<int, int>> joints;  ///< their bodies; empty once joined
  };
  /// A pair's place in the queue, the smallest first (join_order.h has the reasons).
  struct Key {
    int boundary_class, size_class, boundary, bond;
    auto operator<=>(const Key&) const = default;
  };

  /// Bodies on the boundary of the two parts once they are joined.
  int BoundaryAfter(const Bond& bond) {
    int boundary = parts_[bond.a].boundary + parts_[bond.b].boundary;
    sum_.looks += static_cast<long>(bond.joints.size());
    for (const auto& [a, b] : bond.joints) {
      for (int body : {a, b}) boundary -= ++marks_.closing[body] == marks_.open[body];
    }
    for (const auto& [a, b] : bond.joints) marks_.closing[a] = marks_.closing[b] = 0;
    return boundary;
  }

  Key KeyOf(int index) {
    const Bond& bond = bonds_[index];
    const int boundary = BoundaryAfter(bond);
    const auto bodies =
        static_cast<unsigned>(std::max(parts_[bond.a].bodies, parts_[bond.b].bodies));
    return {BoundaryClass(boundary), static_cast<int>(std::bit_width(bodies)), boundary, index};
  }

  /// Enters a pair into the queue once more, in case it has become better. The older entry stays,
  /// and counts for nothing when the pair has been joined by then.
  void Renew(int bond) {
    if (bonds_[bond].joints.size() <= kMany) queue_.push(KeyOf(bond));
  }

  /// Joins the two parts of a pair and hands the bonds of one over to the other.
  void Merge(int index, std::vector<Join>* joins) {
    Bond& bond = bonds_[index];
    const int after = BoundaryAfter(bond);
    int a = bond.a, b = bond.b;
    const int handles = parts_[a].boundary + parts_[b].boundary;
    sum_.cost += JoinCost(bond.rows, handles, after, dim_);
    sum_.handles = std::max(sum_.handles, handles);
    for (const auto& [from, to] : bond.joints) {
      --marks_.open[from];
      --marks_.open[to];
    }
    bond.joints.clear();
    bond.joints.shrink_to_fit();
    const bool in_order = parts_[a].first < parts_[b].first;
    joins->push_back({parts_[in_order ? a : b].name, parts_[in_order ? b : a].name});
    // the part with fewer bonds enters the other: each bond moves O(log n) times
    if (parts_[a].bonds.size() < parts_[b].bonds.size()) std::swap(a, b);
    Part& into = parts_[a];
    into.name = num_bodies_ + static_cast<int>(joins->size()) - 1;
    into.first = std::min(into.first, parts_[b].first);
    into.bodies += parts_[b].bodies;
    into.boundary = after;
    into.bonds.erase(b);
    parts_[b].bonds.erase(a);
    const std::map<int, int> moved = std::move(parts_[b].bonds);
    sum_.looks += static_cast<long>(moved.size());
    for (const auto& [other, old] : moved) {
      parts_[other].bonds.erase(b);
      Bond& from = bonds_[old];
      const auto [it, fresh] = into.bonds.emplace(other, old);
      if (fresh) {
        parts_[other].bonds.emplace(a, old);
        from.a = a;
        from.b = other;
      } else {
        Bond& to = bonds_[it->second];
        to.rows += from.rows;
        if (to.joints.size() < from.joints.size()) std::swap(to.joints, from.joints);
        to.joints.insert(to.joints.end(), from.joints.begin(), from.joints.end());
        from.joints.clear();
      }
      if (into.bonds.size() > kMany) Renew(it->second);
    }
    if (into.bonds.size() > kMany) return;
    for (const auto& [other, bond_there] : into.bonds) Renew(bond_there);
  }

  const int num_bodies_;
  const double dim_;
  BodyMarks& marks_;
  std::vector<Part> parts_;
  std::vector<Bond> bonds_;
  std::priority_queue<Key, std::vector<Key>, std::greater<>> queue_;
  JoinSum sum_;
};

/// Joins a connected set of bodies, those with `marks->part_of` of at least 0, to one growing
/// assembly, the front. Each time the neighbour enters that leaves the smallest boundary. Among
/// equals it is the one with most joints, so that hubs enter before the bodies that stand between
/// them.
class Front {
 public:
  Front(const BodyGraph& graph, std::span<const int> bodies, int dim, BodyMarks* marks)
      : graph_(graph), bodies_(bodies), dim_(dim), marks_(*marks) {
    for (int body : bodies) {
      marks_.open[body] = graph.degree(body);
      // here: how many bodies leave the boundary when this one enters
      marks_.closing[body] = 0;
    }
  }

  /// Begins at `start` if that body is in the set, else at one with fewest joints: a body between
  /// hubs, or an end.
  JoinSum Run(std::vector<Join>* joins, int start = 0) {
    if (std::ranges::find(bodies_, start) == bodies_.end()) {
      start = *std::ranges::min_element(bodies_, {}, [&](int b) { return graph_.degree(b); });
    }
    JoinSum sum;
    int name = start;
    Enter(start);
    for (std::size_t k = 1; k < bodies_.size(); ++k) {
      const int body = std::get<2>(*waiting_.begin());
      const int handles = boundary_ + 1, rows = Enter(body);
      sum.cost += JoinCost(rows, handles, boundary_, dim_);
      sum.handles = std::max(sum.handles, handles);
      joins->push_back({name, body});
      name = graph_.num_bodies() + static_cast<int>(joins->size()) - 1;
    }
    return sum;
  }

 private:
  bool InSet(int body) const { return marks_.part_of[body] >= 0; }

  /// Key of a body; the smallest enters next. Order: bodies that leave the boundary with it, then
  /// its joints, both negative because more is better; its number breaks the tie.
  std::tuple<int, int, int> KeyOf(int body) const {
    return {-marks_.closing[body], -graph_.degree(body), body};
  }

  void Count(int body, int change) {
    waiting_.erase(KeyOf(body));
    marks_.closing[body] += change;
    waiting_.insert(KeyOf(body));
  }

  /// Takes a body into the front; rows of the joints that this closes.
  int Enter(int body) {
    waiting_.erase(KeyOf(body));
    inside_.insert(body);
    ++boundary_;
    int rows = 0;
    for (const BodyGraph::End& end : graph_.ends(body)) {
      if (!InSet(end.body)) continue;
      if (!inside_.contains(end.body)) {
        waiting_.insert(KeyOf(end.body));
        continue;
      }
      rows += end.rows;
      Close(end.body);
      Close(body);
    }
    if (marks_.open[body] == 1) NoteLast(body);
    return rows;
  }

  void Close(int body) {
    const int open = --marks_.open[body];
    if (open == 0) --boundary_;
    if (open == 1) NoteLast(body);
  }

  /// Called when a body of the front has one open joint left. Once that joint is closed the body
  /// leaves the boundary, so the neighbour at its other end is counted as closing one body more.
  void NoteLast(int body) {
    if (noted_.contains(body)) return;
    for (const BodyGraph::End& end : graph_.ends(body)) {
      if (!InSet(end.body) || inside_.contains(end.body)) continue;
      noted_.insert(body);
      Count(end.body, 1);
    }
  }

  const BodyGraph& graph_;
  std::span<const int> bodies_;
  const double dim_;
  BodyMarks& marks_;
  std::set<int> inside_, noted_;
  std::set<std::tuple<int, int, int>> waiting_;  ///< neighbours of the front, best first
  int boundary_ = 0;
};

constexpr int kLandmarks = 4;
/// Each side has at least this share of the bodies.
constexpr double kMinShare = 0.25;
/// Fewer bodies are not worth a cut.
constexpr std::size_t kFewBodies = 8;

/// Cuts a connected set of bodies. `place[body]` is the position of a body in `bodies`, -1 outside.
///
/// Distances are counted in joints within the set. Landmarks are as far as possible from a body and
/// then from each other; the difference of the distances to two of them orders the set, and a cut
/// is a place in such an order (Harel and Koren 2002 draw graphs by such coordinates). The best has
/// the least quotient of constraint rows across it by bodies on its smaller side (Leighton and Rao
/// 1999), which has a quarter of the bodies at least.
class Cutter {
 public:
  Cutter(const BodyGraph& graph, std::span<const int> bodies, std::span<const int> place)
      : graph_(graph), bodies_(bodies), place_(place) {}

  /// Returns the bodies on one side of the best cut; none if the set is too small.
  std::vector<int> Run() {
    if (bodies_.size() < kFewBodies) return {};
    FindLandmarks();
    for (int i = 0; i < kLandmarks; ++i) {
      for (int k = i + 1; k < kLandmarks; ++k) Sweep(OrderBetween(distance_[i], distance_[k]));
    }
    return std::move(side_);
  }

 private:
  /// Joints between one body of the set and each other.
  std::vector<int> DistancesFrom(int start) const {
    std::vector<int> distance(bodies_.size(), -1), reached = {start};
    distance[start] = 0;
    for (std::size_t next = 0; next < reached.size(); ++next) {
      const int here = reached[next];
      for (const BodyGraph::End& end : graph_.ends(bodies_[here])) {
        const int there = place_[end.body];
        if (there < 0 || distance[there] >= 0) continue;
        distance[there] = distance[here] + 1;
        reached.push_back(there);
      }
    }
    return distance;
  }

  void FindLandmarks() {
    std::vector<int> nearest = DistancesFrom(0);
    for (int k = 0; k < kLandmarks; ++k) {
      const auto farthest = std::ranges::max_element(nearest) - nearest.begin();
      distance_[k] = DistancesFrom(static_cast<int>(farthest));
      // the first body only served to find the first landmark
      if (k == 0) nearest = distance_[k];
      for (std::size_t b = 0; b < nearest.size(); ++b) {
        nearest[b] = std::min(nearest[b], distance_[k][b]);
      }
    }
  }

  /// Sorts by the difference of two distances, then their sum: on a grid row after row, in order.
  static std::vector<int> OrderBetween(const std::vector<int>& from, const std::vector<int>& to) {
    std::vector<int> order(from.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::sort(order, {},
                      [&](int b) { return std::tuple(from[b] - to[b], from[b] + to[b], b); });
    return order;
  }

  /// Moves the bodies over to the other side one by one, and notes the best cut on the way.
  void Sweep(const std::vector<int>& order) {
    const int n = static_cast<int>(order.size());
    const int least = std::max(1, static_cast<int>(kMinShare * n));
    std::vector<bool> over(n, false);
    int rows = 0, best = -1;  // rows across the cut
    for (int moved = 1; moved <= n - least; ++moved) {
      const int b = order[moved - 1];
      over[b] = true;
      for (const BodyGraph::End& end : graph_.ends(bodies_[b])) {
        const int other = place_[end.body];
        if (other >= 0) rows += over[other] ? -end.rows : end.rows;
      }
      const double quotient = static_cast<double>(rows) / std::min(moved, n - moved);
      if (moved < least || quotient >= best_quotient_) continue;
      best_quotient_ = quotient;
      best = moved;
    }
    if (best < 0) return;
    side_.assign(order.begin(), order.begin() + best);
    for (int& b : side_) b = bodies_[b];
  }

  const BodyGraph& graph_;
  std::span<const int> bodies_, place_;
  std::vector<int> distance_[kLandmarks];
  double best_quotient_ = std::numeric_limits<double>::infinity();
  std::vector<int> side_;  ///< of the best cut
};

/// If no join of pairing's list has more handles than this, the other two rules are not tried.
constexpr int kFewHandles = 8;

class Orderer {
 public:
  Orderer(const BodyGraph& graph, int dim) : graph_(graph), dim_(dim), marks_(graph.num_bodies()) {}

  std::vector<Join> Run(int start, long* looks) {
    std::vector<int> all(graph_.num_bodies() - 1);
    for (int body = 1; body < graph_.num_bodies(); ++body) all[body - 1] = body;
    for (const std::vector<int>& part : Connected(all)) {
      if (start == 0) {
        Order(part);
      } else {
        Mark(part);
        Front(graph_, part, dim_, &marks_).Run(&joins_, start);
        Unmark(part);
      }
    }
    if (looks != nullptr) *looks = looks_;
    return std::move(joins_);
  }

 private:
  struct Ordered {
    int name = 0;  ///< the assembly of the whole set
    double cost = 0.0;
  };

  /// Orders the joins of a connected set of bodies by the best rule.
  Ordered Order(const std::vector<int>& bodies) {
    if (bodies.size() == 1) return {bodies.front(), 0.0};
    const std::size_t start = joins_.size();
    Mark(bodies);
    const JoinSum paired = Pairing(graph_, bodies, bodies, dim_, &marks_).Run(&joins_);
    looks_ += paired.looks;
    double best = paired.cost;
    if (paired.handles > kFewHandles) {
      std::vector<Join> by_best = Take(start);
      const auto compete = [&](double cost) {
        std::vector<Join> joins = Take(start);
        if (cost >= best) return;
        best = cost;
        by_best = std::move(joins);
      };
      compete(Front(graph_, bodies, dim_, &marks_).Run(&joins_).cost);
      std::vector<int> side = Cutter(graph_, bodies, marks_.part_of).Run();
      Unmark(bodies);
      if (!side.empty()) compete(OrderParts(bodies, std::move(side)));
      joins_.insert(joins_.end(), by_best.begin(), by_best.end());
    }
    Unmark(bodies);
    return {graph_.num_bodies() + static_cast<int>(joins_.size()) - 1, best};
  }

  /// Orders the two sides of a cut, each by its connected parts, and joins these; the cost.
  double OrderParts(const std::vector<int>& bodies, std::vector<int> side) {
    std::ranges::sort(side);
    std::vector<int> rest;
    std::ranges::set_difference(bodies, side, std::back_inserter(rest));
    std::vector<std::vector<int>> parts = Connected(side);
    for (std::vector<int>& part : Connected(rest)) parts.push_back(std::move(part));
    std::vector<int> names;
    double cost = 0.0;
    for (const std::vector<int>& part : parts) {
      const Ordered ordered = Order(part);
      names.push_back(ordered.name);
      cost += ordered.cost;
    }
    for (int p = 0; p < static_cast<int>(parts.size()); ++p) {
      for (int body : parts[p]) marks_.part_of[body] = p;
    }
    cost += Pairing(graph_, bodies, names, dim_, &marks_).Run(&joins_).cost;
    Unmark(bodies);
    return cost;
  }

  /// Removes the joins from `start` on, and returns them.
  std::vector<Join> Take(std::size_t start) {
    std::vector<Join> joins(joins_.begin() + start, joins_.end());
    joins_.resize(start);
    return joins;
  }

  /// Each body a part of its own.
  void Mark(std::span<const int> bodies) {
    for (int k = 0; k < static_cast<int>(bodies.size()); ++k) marks_.part_of[bodies[k]] = k;
  }
  void Unmark(std::span<const int> bodies) {
    for (int body : bodies) marks_.part_of[body] = -1;
  }

  /// The connected parts of a set, each sorted, by lowest body.
  std::vector<std::vector<int>> Connected(const std::vector<int>& bodies) {
    Mark(bodies);
    std::vector<std::vector<int>> parts;
    for (int root : bodies) {
      if (marks_.part_of[root] < 0) continue;
      std::vector<int> part = {root};
      marks_.part_of[root] = -1;
      for (std::size_t next = 0; next < part.size(); ++next) {
        for (const BodyGraph::End& end : graph_.ends(part[next])) {
          if (marks_.part_of[end.body] < 0) continue;
          marks_.part_of[end.body] = -1;
          part.push_back(end.body);
        }
      }
      std::ranges::sort(part);
      parts.push_back(std::move(part));
    }
    return parts;
  }

  const BodyGraph& graph_;
  const int dim_;
  BodyMarks marks_;
  std::vector<Join> joins_;
  long looks_ = 0;
};

}  // namespace

std::vector<Join> OrderJoins(int num_bodies, std::span<const PlanJoint> joints,
                             std::span<const int> waiting, int dim, int start, long* looks) {
  return Orderer(BodyGraph(num_bodies, joints, waiting), dim).Run(start, looks);
}

}  // namespace loopbench::odca
