#include "harness/generate/recorded.h"

#include <fmt/format.h>

#include "harness/generate/record.h"

namespace loopbench::generate {

namespace {

thread_local Graph* current = nullptr;
thread_local CastsAs casts_as = CastsAs::kNumber;
thread_local std::size_t most = 0;

void RequireRoom() {
  if (current->nodes().size() <= most) return;
  throw NotCovered(fmt::format(
      "found more than {} operations, of a large mechanism or a factorisation that iterates",
      most));
}

int NodeOf(const Recorded& x) { return x.node >= 0 ? x.node : current->Constant(x.number); }

bool Folds(const Recorded& x) { return x.node < 0 && current->Folds(x.number); }

/// A node that turned out to be a constant is a constant.
Recorded At(int node, double number) {
  return current->IsConstant(node) ? Recorded(current->nodes()[node].value)
                                   : Recorded(number, node);
}

}  // namespace

Recording::Recording(Graph& graph, CastsAs casts, std::size_t most_nodes) {
  current = &graph;
  most = most_nodes;
  casts_as = casts;
}

Recording::~Recording() {
  current = nullptr;
  casts_as = CastsAs::kNumber;
}

Recorded Recorded::Input(double number) { return {number, current->Input()}; }

double Recorded::Cast() const {
  const bool is_known = node < 0 || (current != nullptr && current->nodes()[node].is_known);
  if (is_known || casts_as == CastsAs::kNumber) return number;
  const double infinity = std::numeric_limits<double>::infinity();
  return casts_as == CastsAs::kInfinity ? infinity : -infinity;
}

Recorded Recorded::Make(Operation operation, const Recorded& a) {
  const double number = TraitsOf(operation).value(a.number, 0.0);
  if (current == nullptr) return number;
  current->as_run.Add(operation);
  if (Folds(a)) return number;
  return At(current->Make(operation, NodeOf(a)), number);
}

Recorded Recorded::Make(Operation operation, const Recorded& a, const Recorded& b) {
  const double number = TraitsOf(operation).value(a.number, b.number);
  if (current == nullptr) return number;
  current->as_run.Add(operation);
  if (Folds(a) && Folds(b)) return number;
  RequireRoom();
  return At(current->Make(operation, NodeOf(a), NodeOf(b)), number);
}

bool Recorded::Compare(Relation relation, const Recorded& a, const Recorded& b) {
  const bool outcome = relation == Relation::kLess        ? a.number < b.number
                       : relation == Relation::kLessEqual ? a.number <= b.number
                                                          : a.number == b.number;
  if (current != nullptr && (a.node >= 0 || b.node >= 0)) {
    current->Compare(relation, NodeOf(a), NodeOf(b), outcome);
  }
  return outcome;
}

void Recorded::PoseSines(const Recorded& angle, Recorded& sine, Recorded& cosine) {
  generate::PoseSines(angle.number, &sine.number, &cosine.number);
  sine.node = cosine.node = -1;
  if (current == nullptr) return;
  current->as_run.Add(Operation::kPoseSin);
  current->as_run.Add(Operation::kPoseCos);
  if (Folds(angle)) return;
  const int node = NodeOf(angle);
  sine.node = current->Make(Operation::kPoseSin, node);
  cosine.node = current->Make(Operation::kPoseCos, node, sine.node);
}

}  // namespace loopbench::generate
