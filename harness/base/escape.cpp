#include <locale.h>

#include <cctype>
#include <cwchar>
#include <span>

#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

bool IsAlphanumeric(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

/// Character of UTF-8: its code point and length in bytes.
struct Character {
  std::uint32_t code = 0;
  std::size_t length = 0;
};

/// Returns the first character; length 0 for an invalid byte.
Character FirstOf(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const std::uint32_t first = byte(0);
  if (first < 0x80) return {first, 1};
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return {};
  std::uint32_t code = first & (0xFFu >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0u) != 0x80u) return {};
    code = code << 6u | (byte(i) & 0x3Fu);
  }
  constexpr std::uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (code < kLeast[length] || code > 0x10FFFF || surrogate) return {};
  return {code, length};
}

// Returns true if a terminal or a viewer would act on it instead of showing it.
bool Acts(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7F && code < 0xA0) ||  // controls
         (code >= 0x200E && code <= 0x200F) || (code >= 0x2028 && code <= 0x202E) ||
         (code >= 0x2066 && code <= 0x2069) || code == 0x061C || code == 0xFEFF ||  // direction
         (code & 0xFFFE) == 0xFFFE;                                                 // none in XML
}

std::string Shown(std::uint32_t code) {
  if (code == '\n') return "\\n";
  if (code == '\t') return "\\t";
  return code < 0x80 ? fmt::format("\\x{:02x}", code) : fmt::format("\\u{:04x}", code);
}

std::string Escape(std::string_view text, bool keep_line_ends) {
  std::string shown;
  while (!text.empty()) {
    const Character character = FirstOf(text);
    const std::size_t length = std::max<std::size_t>(1, character.length);
    if (character.length == 0) {
      shown += fmt::format("\\x{:02x}", static_cast<unsigned char>(text[0]));
    } else if (Acts(character.code) && !(keep_line_ends && text[0] == '\n')) {
      shown += Shown(character.code);
    } else {
      shown += text.substr(0, length);
    }
    text.remove_prefix(length);
  }
  return shown;
}

bool IsFormula(std::string_view text) {
  constexpr std::string_view kBegins = "=+-@";
  if (text.empty() || kBegins.find(text[0]) == text.npos || text == "-") return false;
  return !WholeNumber<double>(text.substr(text.starts_with('+') ? 1 : 0));
}

// Returns true if the character at `i` could begin or end markup there.
bool IsMarkup(std::string_view text, std::size_t i) {
  const char before = i > 0 ? text[i - 1] : ' ';
  const char after = i + 1 < text.size() ? text[i + 1] : ' ';
  constexpr std::string_view kAlways = "\\`*~|$";
  // no markup within a word
  if (text[i] == '_') return !IsAlphanumeric(before) || !IsAlphanumeric(after);
  // of a link or a link definition
  if (text[i] == ']') return after == '(' || after == '[' || after == ':';
  return kAlways.find(text[i]) != std::string_view::npos;
}

/// Letters that a font of 128 characters can compose: no thorn, no eth, no signs.
bool IsLatin1Letter(std::uint32_t code) {
  constexpr std::uint32_t kOthers[] = {0xD0, 0xD7, 0xDE, 0xF0, 0xF7, 0xFE};
  return code >= 0xC0 && code <= 0xFF && std::ranges::find(kOthers, code) == std::end(kOthers);
}

struct Replacement {
  char character;
  std::string_view text;
};
constexpr Replacement kXml[] = {
    {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&#39;"}};
// not every font encoding has the last three
constexpr Replacement kLatex[] = {{'\\', "\\textbackslash{}"},  {'~', "\\textasciitilde{}"},
                                  {'^', "\\textasciicircum{}"}, {'<', "\\textless{}"},
                                  {'>', "\\textgreater{}"},     {'|', "\\textbar{}"}};

/// Returns the text for a character, "" if it stays.
std::string_view Replaced(std::span<const Replacement> table, char c) {
  const auto known = std::ranges::find(table, c, &Replacement::character);
  return known == table.end() ? "" : known->text;
}

/// Scope in which the thread's characters are UTF-8, independent of the environment.
class Utf8 {
 public:
  Utf8() {
    static const locale_t utf8 = ::newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr);
    if (utf8 != nullptr) before_ = ::uselocale(utf8);
  }
  ~Utf8() {
    if (before_ != nullptr) ::uselocale(before_);
  }
  Utf8(const Utf8&) = delete;
  Utf8& operator=(const Utf8&) = delete;

 private:
  locale_t before_ = nullptr;
};

/// Returns the longest beginning of at most `width` cells, and its cells.
std::pair<std::string_view, std::size_t> Measured(std::string_view text, std::size_t width) {
  const Utf8 utf8;
  std::size_t bytes = 0, cells = 0;
  while (bytes < text.size()) {
    const Character first = FirstOf(text.substr(bytes));
    const int wide = first.length == 0 ? 1 : ::wcwidth(static_cast<wchar_t>(first.code));
    const std::size_t more = wide < 0 ? 1 : static_cast<std::size_t>(wide);
    if (cells + more > width) break;
    cells += more;
    bytes += std::max<std::size_t>(first.length, 1);
  }
  return {text.substr(0, bytes), cells};
}

std::string Lowered(std::string_view word) {
  std::string lowered(word);
  for (char& c : lowered) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lowered;
}

}  // namespace

std::string EscapeTerminal(std::string_view text) { return Escape(text, false); }

std::string EscapeTerminalLines(std::string_view text) { return Escape(text, true); }

std::string EscapeMarkdown(std::string_view raw) {
  const std::string text = EscapeTerminal(raw);
  std::string escaped;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const char after = i + 1 < text.size() ? text[i + 1] : ' ';
    if (c == '<' && (IsAlphanumeric(after) || after == '/' || after == '!' || after == '?')) {
      escaped += "&lt;";
    } else if (c == '&' && (IsAlphanumeric(after) || after == '#')) {
      escaped += "&amp;";
    } else {
      if (IsMarkup(text, i)) escaped += '\\';
      escaped += c;
    }
  }
  return escaped;
}

std::string EscapeMarkdownParagraph(std::string_view text) {
  std::string escaped = EscapeMarkdown(text);
  escaped.erase(0, escaped.find_first_not_of(' '));  // four spaces would make it code
  const std::size_t digits = std::min(escaped.find_first_not_of("0123456789"), escaped.size());
  const bool is_list =
      digits > 0 && digits < escaped.size() && (escaped[digits] == '.' || escaped[digits] == ')');
  constexpr std::string_view kBegins = "#>+-=";
  if (is_list) {
    escaped.insert(digits, 1, '\\');
  } else if (!escaped.empty() && kBegins.find(escaped[0]) != std::string_view::npos) {
    escaped.insert(0, 1, '\\');
  }
  return escaped;
}

std::string EscapeLatex(std::string_view raw) {
  constexpr std::string_view kSpecial = "&%$#_{}";
  const std::string shown = EscapeTerminal(raw);
  std::string escaped;
  for (std::string_view text = shown; !text.empty();) {
    const Character character = FirstOf(text);
    const char c = text[0];
    if (character.code >= 0x80) {
      const bool known = IsLatin1Letter(character.code);
      escaped += known ? std::string(text.substr(0, character.length))
                       : fmt::format("(U+{:04X})", character.code);
    } else if (const std::string_view command = Replaced(kLatex, c); !command.empty()) {
      escaped += command;
    } else {
      // at the start of a row these two would belong to the line end before
      if (escaped.empty() && (c == '[' || c == '*')) escaped += "{}";
      if (kSpecial.find(c) != std::string_view::npos) escaped += '\\';
      escaped += c;
    }
    text.remove_prefix(character.length);
  }
  return escaped;
}

std::string BreakableLatex(std::string_view raw) {
  constexpr std::string_view kEnds = "-_/.,:;=+";
  constexpr int kMaxLetters = 8;
  const std::string shown = EscapeTerminal(raw);
  std::string text;
  int letters = 0;
  for (std::string_view left = shown; !left.empty();) {
    const std::size_t length = FirstOf(left).length;
    text += EscapeLatex(left.substr(0, length));
    letters = left[0] == ' ' ? 0 : letters + 1;
    if (kEnds.find(left[0]) != std::string_view::npos || letters == kMaxLetters) {
      text += "\\allowbreak{}";
      letters = 0;
    }
    left.remove_prefix(length);
  }
  return text;
}

std::string EscapeXml(std::string_view text) {
  std::string escaped;
  for (const char c : EscapeTerminal(text)) {
    const std::string_view replaced = Replaced(kXml, c);
    escaped += replaced.empty() ? std::string_view(&c, 1) : replaced;
  }
  return escaped;
}

std::string EscapeCsv(std::string_view raw) {
  const std::string text = (IsFormula(raw) ? "'" : "") + EscapeTerminal(raw);
  if (text.find_first_of(",\"#") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

std::string QuoteGnuplot(std::string_view text) {
  // Double quotes, because every special character can be written by its number there. In single
  // quotes, gnuplot 5.4 reads two apostrophes in a row as the end of the string. It reads three
  // octal digits, or four if the first is 0: more digits may follow.
  std::string quoted = "\"";
  for (const char c : EscapeTerminal(text)) {
    const bool special = c == '"' || c == '\\' || c == '`' || c == '\'' || c == '@' || c == '$';
    quoted += special ? fmt::format("\\{:04o}", c) : std::string(1, c);
  }
  return quoted + '"';
}

std::string QuoteGnuplotTick(std::string_view text) {
  std::string doubled;
  for (const char c : text) doubled += c == '%' ? "%%" : std::string(1, c);
  return QuoteGnuplot(doubled);
}

std::string FileName(std::string_view name) {
  constexpr std::size_t kLongest = 200, kHashDigits = 8;
  std::string slug;
  for (const char c : name) {
    const bool kept = IsAlphanumeric(c) || c == '.' || c == '_' || c == '+' || c == '-';
    if (kept) {
      slug += c;
    } else if (!slug.ends_with('-')) {
      slug += '-';
    }
  }
  slug.erase(0, std::min(slug.find_first_not_of(".-"), slug.size()));
  if (slug == name && !slug.empty() && slug.size() <= kLongest) return slug;
  slug.resize(std::min(slug.size(), kLongest - kHashDigits - 1));
  slug.erase(slug.find_last_not_of(".-") + 1);
  return slug + (slug.empty() ? "" : "-") + Fnv1a(name).substr(0, kHashDigits);
}

std::string_view Beginning(std::string_view text, std::size_t width) {
  return Measured(text, width).first;
}

std::size_t CellsOf(std::string_view text) { return Measured(text, text.npos).second; }

std::vector<std::string> BrokenInto(std::string_view text, std::size_t width) {
  std::vector<std::string> lines;
  for (;;) {
    const std::size_t fits = Beginning(text, width).size();
    if (fits >= text.size()) break;
    std::size_t end = fits < 2 ? std::string_view::npos : text.rfind(", ", fits - 1);
    end = end == std::string_view::npos || end == 0 ? text.rfind(' ', fits) : end + 1;
    if (end == std::string_view::npos || end == 0) end = std::max<std::size_t>(fits, 1);
    lines.emplace_back(text.substr(0, end));
    text.remove_prefix(end + (text[end] == ' ' ? 1 : 0));
  }
  lines.emplace_back(text);
  return lines;
}

std::size_t CharacterLength(std::string_view text) { return FirstOf(text).length; }

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
