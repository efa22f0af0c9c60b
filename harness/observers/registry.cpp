#include "harness/observers/registry.h"

#include <algorithm>

#include "mechanism/formulation/registration.h"

namespace loopbench::harness {

namespace {

std::deque<ObserverRow>& Rows() {
  static std::deque<ObserverRow> rows;
  return rows;
}

}  // namespace

void RegisterObserver(ObserverRow row, int alignment) {
  const bool taken = std::ranges::find(Rows(), row.name, &ObserverRow::name) != Rows().end();
  RequireSound({.kind = "observer",
                .name = row.name,
                .sentence = row.sentence,
                .is_taken = taken,
                .has_factories = row.planar && row.spatial,
                .alignment = alignment});
  AddMeasures(row.measures);
  Rows().push_back(std::move(row));
}

const std::deque<ObserverRow>& RegisteredObservers() { return Rows(); }

}  // namespace loopbench::harness
