#include "odca/join_order.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "odca/dissection.h"
#include "odca/front.h"
#include "odca/pairing.h"

namespace loopbench::odca {

namespace {

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
