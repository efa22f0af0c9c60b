// The rule that grows an assembly tree from below (join_order.h).
#pragma once

#include <functional>
#include <map>
#include <queue>
#include <span>
#include <utility>
#include <vector>

#include "odca/body_graph.h"
#include "odca/join_order.h"

namespace loopbench::odca {

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

/// Joins the assemblies of one connected set of bodies. An object of one use.
class Pairing {
 public:
  /// `marks->part_of` of each body in `bodies` is the index 0, 1, .. of its assembly; assemblies
  /// have the numbers `names`.
  Pairing(const BodyGraph& graph, std::span<const int> bodies, std::span<const int> names, int dim,
          BodyMarks* marks);

  /// Appends to the joins of the whole graph.
  JoinSum Run(std::vector<Join>* joins);

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
  int BoundaryAfter(const Bond& bond);
  Key KeyOf(int bond);
  /// Enters a pair into the queue once more, in case it has become better. The older entry stays,
  /// and counts for nothing when the pair has been joined by then.
  void Renew(int bond);
  /// Joins the two parts of a pair and hands the bonds of one over to the other.
  void Merge(int bond, std::vector<Join>* joins);

  const int num_bodies_;
  const double dim_;
  BodyMarks& marks_;
  std::vector<Part> parts_;
  std::vector<Bond> bonds_;
  std::priority_queue<Key, std::vector<Key>, std::greater<>> queue_;
  JoinSum sum_;
};

}  // namespace loopbench::odca
