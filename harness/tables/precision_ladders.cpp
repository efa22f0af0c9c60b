#include "harness/tables/precision_ladders.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "harness/config/experiment.h"
#include "harness/tables/columns.h"

namespace loopbench::harness {
namespace {

// Width of the scalar; any other word comes last.
std::size_t WidthOf(const Record& record) {
  const auto scalar = Parse<Scalar>(record.Text("scalar"));
  return scalar ? static_cast<std::size_t>(*scalar) : kNames<Scalar>.size();
}

}  // namespace

bool IsReferenceRung(const Record& record) { return record.Text("integrator") == "gragg"; }

std::string LadderOf(const Record& record) {
  std::string text;
  for (const char* key : kLadderKeys) text += record.Text(key) + '\n';
  for (const TableColumn& parameter : WithParameters({}, {&record, 1})) {
    text += fmt::format("{} {}\n", parameter.key, record.Text(parameter.key));
  }
  return text;
}

void SortRungs(std::vector<Record>* records) {
  const auto key = [](const Record& record) {
    return std::tuple(LadderOf(record), IsReferenceRung(record), -record.Number("rtol"),
                      WidthOf(record));
  };
  std::ranges::stable_sort(*records, {}, key);
}

std::vector<std::string> PrecisionNotes() {
  return {
      "error: largest distance of a centre of mass from the reference at the end; the reference "
      "(integrator gragg) is the same for all columns: multipliers in joint coordinates without "
      "softening, float128; its own error is the distance from another one at 10^4 times its "
      "tolerance",
      "drift: largest mismatch of the points of a constraint at accepted steps, measured in "
      "float128",
      "ruled by: round-off where the widest scalar at the same tolerance changes the number by "
      "more "
      "than a factor of two, else truncation (of the method, or by softening); of the widest, "
      "truncation where the number is more than ten times the next narrower's scaled by the ratio "
      "of their eps"};
}

}  // namespace loopbench::harness
