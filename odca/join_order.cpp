#include "odca/join_order.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "odca/pairing.h"

namespace loopbench::odca {

namespace {

class Front {
 public:
  Front(const BodyGraph& graph, std::span<const int> bodies, int dim, BodyMarks* marks)
      : graph_(graph), dim_(dim), marks_(*marks), count_(bodies.size()) {
    for (int body : bodies) {
      marks_.open[body] = graph.degree(body);
      // here: how many bodies leave the boundary when this one enters
      marks_.closing[body] = 0;
    }
  }

  JoinSum Run(int start, std::vector<Join>* joins) {
    JoinSum sum;
    int name = start;
    Enter(start);
    for (std::size_t k = 1; k < count_; ++k) {
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
  const double dim_;
  BodyMarks& marks_;
  const std::size_t count_;
  std::set<int> inside_, noted_;
  std::set<std::tuple<int, int, int>> waiting_;  ///< neighbours of the front, best first
  int boundary_ = 0;
};

/// Joins a connected set of bodies, those with `marks->part_of` of at least 0, to one growing
/// assembly, the front. Each time the neighbour enters that leaves the smallest boundary. Among
/// equals it is the one with most joints, so that hubs enter before the bodies that stand between
/// them. The front begins at `start`, if that body is in the set.
JoinSum JoinToFront(const BodyGraph& graph, std::span<const int> bodies, int dim, BodyMarks* marks,
                    std::vector<Join>* joins, int start = 0) {
  // from a body with fewest joints: one between hubs, or an end
  if (std::ranges::find(bodies, start) == bodies.end()) {
    start = *std::ranges::min_element(bodies, {}, [&](int b) { return graph.degree(b); });
  }
  return Front(graph, bodies, dim, marks).Run(start, joins);
}

constexpr int kLandmarks = 4;
/// Each side has at least this share of the bodies.
constexpr double kMinShare = 0.25;
/// Fewer bodies are not worth a cut.
constexpr std::size_t kFewBodies = 8;

class Cutter {
 public:
  Cutter(const BodyGraph& graph, std::span<const int> bodies, std::span<const int> place)
      : graph_(graph), bodies_(bodies), place_(place) {}

  std::vector<int> Run() {
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

/// The bodies on one side of the best cut found through the connected set `bodies`; empty for sets
/// too small to cut. `place[body]` is the body's position in `bodies`, -1 outside the set.
///
/// Distances are counted in joints within the set. Landmarks are as far as possible from a body and
/// then from each other; the difference of the distances to two of them orders the set, and a cut
/// is a place in such an order (Harel and Koren 2002 draw graphs by such coordinates). The best has
/// the least quotient of constraint rows across it by bodies on its smaller side (Leighton and Rao
/// 1999), which has a quarter of the bodies at least.
std::vector<int> BestSide(const BodyGraph& graph, std::span<const int> bodies,
                          std::span<const int> place) {
  if (bodies.size() < kFewBodies) return {};
  return Cutter(graph, bodies, place).Run();
}

/// If no join of pairing's list has more handles than this, the other two rules are not tried.
constexpr int kFewHandles = 8;

class Orderer {
 public:
  Orderer(const BodyGraph& graph, int dim) : graph_(graph), dim_(dim), marks_(graph.num_bodies()) {}

  std::vector<Join> Run(int start) {
    std::vector<int> all(graph_.num_bodies() - 1);
    for (int body = 1; body < graph_.num_bodies(); ++body) all[body - 1] = body;
    for (const std::vector<int>& part : Connected(all)) {
      if (start == 0) {
        Order(part);
      } else {
        Mark(part);
        JoinToFront(graph_, part, dim_, &marks_, &joins_, start);
        Unmark(part);
      }
    }
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
    double best = paired.cost;
    if (paired.handles > kFewHandles) {
      std::vector<Join> by_best = Take(start);
      const auto compete = [&](double cost) {
        std::vector<Join> joins = Take(start);
        if (cost >= best) return;
        best = cost;
        by_best = std::move(joins);
      };
      compete(JoinToFront(graph_, bodies, dim_, &marks_, &joins_).cost);
      std::vector<int> side = BestSide(graph_, bodies, marks_.part_of);
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
};

}  // namespace

double JoinCost(double rows, double handles, double kept, double dim) {
  const double triangle = rows * (rows + 1) / 2;
  const double response = rows * handles * dim * dim + 2 * dim * triangle;
  const double factor = rows * rows * rows / 6 + rows + dim * triangle * kept;
  const double eliminate = rows * dim * dim * kept * (kept + 1) / 2;
  const double vectors = 2 * rows * (2 * dim + dim * kept + rows / 2);
  return response + factor + eliminate + vectors;
}

std::vector<Join> OrderJoins(int num_bodies, std::span<const PlanJoint> joints,
                             std::span<const int> waiting, int dim, int start) {
  return Orderer(BodyGraph(num_bodies, joints, waiting), dim).Run(start);
}

}  // namespace loopbench::odca
