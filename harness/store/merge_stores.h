// Several stores of one experiment into one: every case once.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

struct PartOfStore {
  std::filesystem::path file;  ///< for messages
  std::vector<Record> records;
};

/// One record per "id", at the place of its first; records without one all stay. Of a case that was
/// run more than once a record whose ending the clock or the machine decided (time-limit, crashed,
/// ...) gives way to one that was not, and else to the last.
///
/// Records of one id come from one program and one case: two that were not cut short agree in all
/// but times, noise and origin. Throws std::runtime_error that names both files, the case, the key
/// and both values where they do not.
std::vector<Record> MergeStores(const std::vector<PartOfStore>& parts);

}  // namespace loopbench::harness
