// Records, and expected texts, written briefly.
#pragma once

#include "harness/base/record.h"
#include "harness/judge/tables.h"
#include "tests/harness/places.h"

namespace loopbench::harness {

/// Sets key, value, key, value, ... in a record.
inline Record Changed(Record record) { return record; }
template <class... Rest>
Record Changed(Record record, const std::string& key, const AnyValue& any, const Rest&... rest) {
  record.Set(key, any.value);
  return Changed(std::move(record), rest...);
}

/// Returns a record of key, value, key, value, ...
template <class... Members>
Record RecordOf(const Members&... members) {
  return Changed(Record(), members...);
}

}  // namespace loopbench::harness
