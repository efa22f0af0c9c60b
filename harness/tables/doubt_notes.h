// Why rows of a table say "ok?": sentences that name rows.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// The keys of cases in which rows differ. Absolute tolerances go with relative ones.
std::vector<std::string> TellingKeys(std::span<const Record> rows);

/// "odca/velocity/joint rtol 1e-08": texts as they are, numbers with their key; the mechanism where
/// there is none.
std::string NameOfRow(const Record& row, const std::vector<std::string>& keys);

/// The codes of `doubts`, each with what it means.
std::vector<std::pair<std::string, std::string>> MeaningsOfDoubts();

/// One line per kind of doubt among the rows, with its numbers, and one per scene whose runs end
/// differently, which names those that agree. Long lists are cut, and say how much is left out.
/// `records` are those of the store: of scenes they have the runs that the table does not show.
std::vector<std::string> DoubtNotes(std::span<const Record> rows, std::span<const Record> records);

}  // namespace loopbench::harness
