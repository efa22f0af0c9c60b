#include "odca/front.h"

#include <algorithm>
#include <set>
#include <tuple>

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

}  // namespace

JoinSum JoinToFront(const BodyGraph& graph, std::span<const int> bodies, int dim, BodyMarks* marks,
                    std::vector<Join>* joins, int start) {
  // from a body with fewest joints: one between hubs, or an end
  if (std::ranges::find(bodies, start) == bodies.end()) {
    start = *std::ranges::min_element(bodies, {}, [&](int b) { return graph.degree(b); });
  }
  return Front(graph, bodies, dim, marks).Run(start, joins);
}

}  // namespace loopbench::odca
