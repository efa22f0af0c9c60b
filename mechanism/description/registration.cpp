#include "mechanism/description/registration.h"

#include <stdexcept>
#include <string>

namespace loopbench {

namespace {

bool IsWord(std::string_view text) {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz0123456789-_";
  return !text.empty() && text.front() != '-' &&
         text.find_first_not_of(kLetters) == std::string_view::npos;
}

}  // namespace

void RefuseRow(std::string_view kind, std::string_view name, std::string_view found,
               std::string_view expected) {
  std::string text(kind);
  text.append(" \"").append(name).append("\": found ").append(found);
  throw std::invalid_argument(text.append(", expected ").append(expected));
}

void RequireSound(const NewRow& row) {
  const auto refuse = [&row](std::string_view found, std::string_view expected) {
    RefuseRow(row.kind, row.name, found, expected);
  };
  if (row.alignment != EIGEN_MAX_STATIC_ALIGN_BYTES) {
    refuse("EIGEN_MAX_STATIC_ALIGN_BYTES=" + std::to_string(row.alignment),
           std::to_string(EIGEN_MAX_STATIC_ALIGN_BYTES) +
               ", as the target loopbench::loopbench has it");
  }
  if (!IsWord(row.name)) refuse("no word", "a-z, 0-9, '-' and '_'");
  if (row.is_taken) refuse("it again", "each name once");
  if (!row.has_sentence) refuse("no sentence", "one that `explain` may say");
  if (!row.has_factories) refuse("no factory", "one for plane and space each");
}

}  // namespace loopbench
