#include "harness/observers/registry.h"

#include <algorithm>

#include "mechanism/description/registration.h"

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
                .is_taken = taken,
                .has_sentence = !row.sentence.empty(),
                .has_factories = row.planar && row.spatial,
                .alignment = alignment});
  AddMeasures(row.measures);
  Rows().push_back(std::move(row));
}

const std::deque<ObserverRow>& RegisteredObservers() { return Rows(); }

}  // namespace loopbench::harness
