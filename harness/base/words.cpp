#include <algorithm>
#include <cctype>
#include <cstddef>

#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

std::string Lowered(std::string_view word) {
  std::string lowered(word);
  for (char& c : lowered) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lowered;
}

}  // namespace

std::size_t CountCharacters(std::string_view text) {
  return text.size() -
         static_cast<std::size_t>(std::count_if(text.begin(), text.end(), ContinuesCharacter));
}

std::string Abbreviated(const std::string& text, std::size_t most) {
  if (text.size() <= most) return text;
  while (most > 0 && ContinuesCharacter(text[most])) --most;
  return text.substr(0, most) + "...";
}

std::string ListInWords(const std::vector<std::string>& words, std::string_view last) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? " " + std::string(last) + " " : ", ";
    text += words[i];
  }
  return text;
}

std::string LetterOf(std::size_t index) {
  constexpr std::size_t kLetters = 26;
  const std::string letter(1, static_cast<char>('A' + index % kLetters));
  return index < kLetters ? letter : letter + std::to_string(index / kLetters);
}

std::string WithCount(std::size_t count, const std::string& word) {
  const std::string number = std::to_string(count) + " ";
  if (count == 1) return number + word;
  return number + (word.ends_with('y') ? word.substr(0, word.size() - 1) + "ies" : word + "s");
}

int EditDistance(std::string_view a, std::string_view b) {
  // three rows of the usual table: a swap of neighbours uses the row before the last
  std::vector<int> before(b.size() + 1), last(b.size() + 1), now(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    now[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int replaced = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      now[j] = std::min({replaced, last[j] + 1, now[j - 1] + 1});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) now[j] = std::min(now[j], before[j - 2] + 1);
    }
    before.swap(last);
    last.swap(now);
  }
  return last[b.size()];
}

std::string NearestSpelling(std::string_view given, const std::vector<std::string>& known) {
  // longer words are no typing errors, and the table is quadratic in the length
  constexpr std::size_t kLongestWord = 100;
  if (given.empty() || given.size() > kLongestWord) return "";
  const std::string lowered = Lowered(given);
  int allowed = std::max(1, static_cast<int>(given.size()) / 3);
  std::string nearest;
  for (const std::string& word : known) {
    if (word.empty() || word.size() > kLongestWord) continue;
    const int distance = EditDistance(lowered, Lowered(word));
    // a one-letter name would match every other letter
    if (distance > allowed || distance >= static_cast<int>(word.size())) continue;
    nearest = word;
    allowed = distance - 1;
  }
  if (!nearest.empty()) return nearest;
  // a shortened or a longer word: "cpu" for "cpu_s"
  constexpr std::size_t kShortestStart = 3;
  for (const std::string& word : known) {
    const std::string whole = Lowered(word);
    const std::string_view shorter = whole.size() < lowered.size() ? whole : lowered;
    if (shorter.size() < kShortestStart) continue;
    if (whole.starts_with(shorter) && lowered.starts_with(shorter)) return word;
  }
  return "";
}

}  // namespace loopbench::harness
