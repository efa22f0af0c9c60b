// Why rows of a table say "ok?": sentences that name rows.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// One line per kind of doubt among the rows, with its numbers, and one per scene whose runs end
/// differently, which names those that agree. Long lists are cut, and say how much is left out.
/// `records` are those of the store: of scenes they have the runs that the table does not show.
std::vector<std::string> DoubtNotes(std::span<const Record> rows, std::span<const Record> records);

}  // namespace loopbench::harness
