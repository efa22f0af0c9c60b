#include "odca/dissection.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

namespace loopbench::odca {

namespace {

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

}  // namespace

std::vector<int> BestSide(const BodyGraph& graph, std::span<const int> bodies,
                          std::span<const int> place) {
  if (bodies.size() < kFewBodies) return {};
  return Cutter(graph, bodies, place).Run();
}

}  // namespace loopbench::odca
