#include "harness/base/json_document.h"

#include <fstream>
#include <ranges>
#include <set>
#include <unordered_set>

#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

/// Line and column of the byte at `position`, from 1. Columns count bytes, as compilers do.
std::pair<std::ptrdiff_t, std::size_t> PlaceOf(std::string_view text, std::size_t position) {
  const std::string_view before = text.substr(0, position);
  // from the line end before the place, or from npos = -1
  return {std::ranges::count(before, '\n') + 1, position - before.rfind('\n')};
}

/// Builds the document. Records errors that the parser accepts, and the lines of wanted values.
class Builder final : public nlohmann::json_sax<Json> {
 public:
  /// Parses `text` to its end, to its first syntax error, or until all `wanted` pointers are found.
  Builder(std::string_view text, const std::string& file,
          const std::vector<std::string>& wanted = {})
      : text_(text), file_(file), wanted_(wanted.begin(), wanted.end()) {
    // without the last character: numbers are read one too far
    const auto counted = text | std::views::transform([this](char c) {
                           if (std::exchange(last_, c) == '\n') ++line_;
                           return c;
                         });
    Json::sax_parse(counted.begin(), counted.end(), this);
  }

  /// Returns the document; throws ConfigError with all errors if there are any.
  Json Take() {
    if (complaints_.empty()) return std::move(root_);
    if (more_ > 0) complaints_.push_back(fmt::format("{}: and {} more", file_, more_));
    throw ConfigError(fmt::format("{}", fmt::join(complaints_, "\n")));
  }
  const std::map<std::string, std::size_t>& lines() const { return lines_; }

  bool null() override { return Put(Json()); }
  bool boolean(bool value) override { return Put(value); }
  bool number_integer(number_integer_t value) override { return Put(value); }
  bool number_unsigned(number_unsigned_t value) override { return Put(value); }
  bool number_float(number_float_t value, const string_t& token) override {
    const std::string_view digits = std::string_view(token).substr(0, token.find_first_of("eE"));
    if (value == 0.0 && digits.find_first_of("123456789") != std::string_view::npos) {
      Complain(
          fmt::format("found {}, expected 0 or a number of at least 4.9e-324", ShortToken(token)));
    }
    return Put(value);
  }
  bool string(string_t& value) override { return Put(std::move(value)); }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return Put(Json::object()); }
  bool start_array(std::size_t) override { return Put(Json::array()); }
  bool end_object() override { return Close(); }
  bool end_array() override { return Close(); }
  bool key(string_t& key) override {
    levels_.back().key = key;
    if (!levels_.back().keys.insert(key).second) {
      Complain(fmt::format("found key \"{}\" twice, expected each key once in an object",
                           ShortToken(key)));
    }
    return true;
  }

  bool parse_error(std::size_t position, const std::string& token,
                   const nlohmann::detail::exception& error) override {
    const auto [line, column] = PlaceOf(text_, std::min(position, text_.size()));
    // overflow is reported at the end of the number, and the parser's message has no "parsing"
    const bool too_large = dynamic_cast<const Json::out_of_range*>(&error) != nullptr;
    const std::string what =
        too_large ? fmt::format(
                        "found the number {}, expected one that fits a double (at most "
                        "1.8e308)",
                        ShortToken(token))
                  : SyntaxMessage(error.what(), text_, position);
    // of the last character that was read
    complaints_.push_back(fmt::format("{}:{}:{}: {}", file_, line,
                                      std::max<std::size_t>(column - 1, 1), Printable(what)));
    return false;
  }

 private:
  /// A container that is not yet complete; only the last one grows.
  struct Level {
    Json* container;
    std::string key = {};
    std::unordered_set<std::string> keys = {};
  };

  /// Adds a value; containers are still empty.
  bool Put(Json value) {
    if (!wanted_.empty() && wanted_.contains(Pointer())) lines_.emplace(Pointer(), line_);
    const bool is_container = value.is_structured();
    if (is_container && levels_.size() >= kMaxConfigDepth) {
      Complain(fmt::format("found nesting deeper than {} levels, expected at most {}",
                           kMaxConfigDepth, kMaxConfigDepth));
      return false;
    }
    Json* placed = &root_;
    if (levels_.empty()) {
      root_ = std::move(value);
    } else if (Json& owner = *levels_.back().container; owner.is_array()) {
      placed = &owner.get_ref<Json::array_t&>().emplace_back(std::move(value));
    } else {
      // Not the map's own emplace, which searches all keys: key() has checked them.
      placed = &owner.get_ref<Json::object_t&>()
                    .emplace_back(levels_.back().key, std::move(value))
                    .second;
    }
    if (is_container) levels_.push_back({placed});
    return wanted_.empty() || lines_.size() < wanted_.size();
  }

  bool Close() {
    levels_.pop_back();
    return true;
  }

  /// Returns the pointer of the current value or key.
  std::string Pointer() const {
    std::string pointer;
    for (const Level& level : levels_) {
      // an open container is already an element of the array around it
      const std::size_t index = level.container->size() - (&level == &levels_.back() ? 0 : 1);
      pointer +=
          "/" + (level.container->is_array() ? std::to_string(index) : PointerToken(level.key));
    }
    return pointer;
  }

  void Complain(const std::string& what) {
    if (complaints_.size() >= kMaxMessages) {
      ++more_;
    } else {
      complaints_.push_back(fmt::format("{}:{}: {}: {}", file_, line_,
                                        Printable(ShownPointer(Pointer())), Printable(what)));
    }
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t line_ = 1;
  char last_ = '\0';
  Json root_;
  std::vector<Level> levels_;
  std::vector<std::string> complaints_;
  std::size_t more_ = 0;
  std::set<std::string> wanted_;
  std::map<std::string, std::size_t> lines_;
};

// EncodingFault: detects text in encodings other than UTF-8.

constexpr std::string_view kExpected = "expected UTF-8 text";

/// Returns the encoding from a byte order mark or zero bytes at the start, or "".
std::string_view WideEncoding(std::string_view text) {
  using namespace std::string_view_literals;
  // longer marks first: the UTF-32 mark begins like the UTF-16 mark
  if (text.starts_with("\xFF\xFE\0\0"sv) || text.starts_with("\0\0\xFE\xFF"sv)) return "UTF-32";
  if (text.starts_with("\xFF\xFE"sv) || text.starts_with("\xFE\xFF"sv)) return "UTF-16";
  if (text.size() < 2 || (text[0] == '\0') == (text[1] == '\0')) return "";
  return text.size() >= 4 && text[1] == '\0' && text[2] == '\0' ? "UTF-32" : "UTF-16";
}

bool IsWordCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '+' ||
         c == '-' || c == '.' || c == '_';
}

/// Returns the number or bare word that was read last, or otherwise the last character.
std::string_view LastWord(std::string_view text, std::size_t position) {
  if (position == 0 || text.empty()) return "";
  std::size_t begin = std::min(position, text.size()) - 1;
  if (!IsWordCharacter(text[begin]) && begin > 0 && IsWordCharacter(text[begin - 1])) --begin;
  std::size_t end = begin + 1;
  if (!IsWordCharacter(text[begin])) {
    while (end < text.size() && ContinuesCharacter(text[end])) ++end;
    return text.substr(begin, end - begin);  // a whole character, of several bytes perhaps
  }
  while (begin > 0 && IsWordCharacter(text[begin - 1])) --begin;
  while (end < text.size() && IsWordCharacter(text[end])) ++end;
  return text.substr(begin, end - begin);
}

/// Returns a hint from the characters around a syntax error, as " (...)" or "".
std::string Hint(std::string_view text, std::size_t position, std::string_view word) {
  if (position == 0 || position > text.size() || word.empty()) return "";
  const std::size_t at = position - 1;
  const char offending = text[at];
  if (offending == '/' || offending == '#') return " (comments are not allowed)";
  if (offending == '\'') return " (strings need double quotes)";
  const std::string_view number = word.substr(word[0] == '-' || word[0] == '+' ? 1 : 0);
  const auto begins = [number](auto... starts) { return (number.starts_with(starts) || ...); };
  if (begins("NaN", "nan", "Inf", "inf")) return " (NaN and Infinity are not allowed)";
  if (word[0] == '+') return " (numbers have no leading +)";
  if (number.starts_with('.')) return " (numbers have a digit before the point)";
  if (begins("0x", "0X")) return " (numbers are decimal)";
  const bool after_zero =
      number.size() > 1 && number[0] == '0' && number[1] >= '0' && number[1] <= '9';
  if (after_zero) return " (numbers have no leading zeros)";
  if (word == "True" || word == "False") return " (true and false are written small)";
  if (word == "None") return " (no value is written null, or left out)";
  if (offending != ']' && offending != '}') return "";
  const std::size_t last = text.substr(0, at).find_last_not_of(" \t\r\n");
  const bool trailing_comma = last != text.npos && text[last] == ',';
  return trailing_comma ? " (remove the comma before the closing bracket)" : "";
}

/// Returns the text after `start`, up to `end` or the end of the message; "" without `start`.
std::string Between(const std::string& message, std::string_view start, std::string_view end) {
  const std::size_t at = message.find(start);
  if (at == std::string::npos) return "";
  const std::size_t from = at + start.size();
  const std::size_t to = end.empty() ? std::string::npos : message.find(end, from);
  return message.substr(from, to == std::string::npos ? to : to - from);
}

/// Returns readable expectations: the parser omits "," where it expects a closing bracket.
std::string Expected(const std::string& parsers, bool in_key) {
  if (parsers == "'}'") return "',' or '}'";
  if (parsers == "']'") return "',' or ']'";
  if (parsers == "end of input") return "the end of the file";
  if (parsers.starts_with("digit")) return "a digit" + parsers.substr(5);
  if (in_key || parsers == "string literal") return "a key in double quotes";
  return parsers.starts_with("'[', '{'") || parsers.empty() ? "a value" : parsers;
}

constexpr std::size_t kWidth = 100;  ///< characters of a line

/// Returns one line if it fits after `used` characters, otherwise one element per line.
std::string Written(const Json& value, std::size_t indent, std::size_t used) {
  const std::string flat = FlatText(value);
  if (used + flat.size() < kWidth || !value.is_structured() || value.empty()) return flat;
  const std::string margin(indent + 2, ' ');
  std::string text;
  for (auto child = value.begin(); child != value.end(); ++child) {
    const std::string key = value.is_object() ? Json(child.key()).dump() + ": " : "";
    text += (text.empty() ? "\n" : ",\n") + margin + key +
            Written(*child, indent + 2, margin.size() + key.size());
  }
  text += "\n" + std::string(indent, ' ');
  return value.is_object() ? "{" + text + "}" : "[" + text + "]";
}

}  // namespace

std::string ReadTextFile(const std::filesystem::path& path) {
  const auto fail = [&path](const std::string& reason) {
    throw ConfigError(fmt::format("{}: cannot be read: {}", path.string(), reason));
  };
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    const std::filesystem::path here = std::filesystem::current_path(error);
    fail(path.is_absolute() ? "no such file"
                            : fmt::format("no such file, seen from {}", here.string()));
  }
  if (std::filesystem::is_directory(status)) fail("it is a folder");
  NoteInput(path);
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail("it cannot be opened");
  // Read in pieces up to the limit: the size of a pipe is unknown.
  std::string text;
  std::vector<char> piece(std::size_t{1} << 16);
  while (stream && text.size() <= kMaxConfigBytes) {
    stream.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    text.append(piece.data(), static_cast<std::size_t>(stream.gcount()));
  }
  if (stream.bad()) fail("reading it failed");
  if (text.size() > kMaxConfigBytes) {
    fail(fmt::format("found more than {0} MiB, expected at most {0} MiB", kMaxConfigBytes >> 20));
  }
  return text;
}

Json ParseDocument(std::string_view text, const std::string& file) {
  if (const std::string fault = EncodingFault(text); !fault.empty()) {
    throw ConfigError(fmt::format("{}:{}", file, fault));
  }
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    throw ConfigError(fmt::format("{}:1:1: found an empty file, expected a JSON object", file));
  }
  return Builder(text, file).Take();
}

std::string ShownPointer(const std::string& pointer) {
  constexpr std::size_t kEnd = 100;
  if (pointer.empty()) return "(top level)";
  if (pointer.size() <= 2 * kEnd) return pointer;
  // whole UTF-8 characters only
  const auto inside = [&pointer](std::size_t i) { return ContinuesCharacter(pointer[i]); };
  std::size_t head = kEnd, tail = pointer.size() - kEnd;
  while (head > 0 && inside(head)) --head;
  while (tail < pointer.size() && inside(tail)) ++tail;
  return pointer.substr(0, head) + "..." + pointer.substr(tail);
}

std::string Printable(const std::string& text) {
  std::string printable;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool is_control = byte < 0x20 || byte == 0x7F;
    printable += is_control ? fmt::format("\\u{:04x}", byte) : std::string(1, c);
  }
  return printable;
}

std::string PointerToken(std::string_view key) {
  std::string token;
  for (const char c : key) {
    token += c == '~' ? "~0" : c == '/' ? "~1" : std::string_view(&c, 1);
  }
  return token;
}

std::string EncodingFault(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) {
    return fmt::format("1:1: found a UTF-8 byte order mark (EF BB BF), {} without one", kExpected);
  }
  if (const std::string_view wide = WideEncoding(text); !wide.empty()) {
    return fmt::format("1:1: found {} text, {}", wide, kExpected);
  }
  for (std::size_t i = 0, length = 0; i < text.size(); i += length) {
    const auto ascii = static_cast<signed char>(text[i]) > 0;  // most of any file
    length = ascii ? 1 : text[i] == '\0' ? 0 : CharacterLength(text.substr(i));
    if (length > 0) continue;
    const auto byte = static_cast<unsigned char>(text[i]);
    const auto [line, column] = PlaceOf(text, i);
    // Latin-1 has letters from C0 on; below are Windows' quotes and dashes
    return fmt::format("{}:{}: found {}, {}", line, column,
                       byte == 0 ? "a zero byte"
                                 : fmt::format("the byte {:02X}, which is not UTF-8 (it may be {})",
                                               byte, byte >= 0xA0 ? "Latin-1" : "Windows-1252"),
                       kExpected);
  }
  return "";
}

std::map<std::string, std::size_t> LinesOf(std::string_view text,
                                           const std::vector<std::string>& pointers) {
  return Builder(text, "", pointers).lines();
}

std::string ShortToken(const std::string& token) {
  constexpr std::size_t kLongest = 40;
  if (token.size() <= kLongest) return token;
  std::size_t start = token.size() - kLongest;
  while (start < token.size() && ContinuesCharacter(token[start])) ++start;
  return "..." + token.substr(start);
}

// The message reads "... while parsing WHAT - FOUND; expected EXPECTED; last read: 'TOKEN'"; only
// FOUND is always there, the others come in any order. TOKEN may be megabytes.
std::string SyntaxMessage(const std::string& message, std::string_view text, std::size_t position) {
  const bool in_key = message.find("parsing object key") != std::string::npos;
  std::string found = Between(message, " - ", "; last read");
  if (const std::size_t at = found.find("; expected "); at != std::string::npos) found.erase(at);
  if (found.starts_with("invalid string: ")) {
    return fmt::format("found an invalid string ({}), expected one as JSON writes it",
                       found.substr(16));
  }
  std::string tail = message.substr(std::min(message.size(), message.find(" - ")));
  const std::size_t last = tail.rfind("; expected ");
  const std::string expected = Expected(
      last == std::string::npos ? "" : Between(tail.substr(last), "; expected ", "; last read"),
      in_key);
  const std::string_view word = LastWord(text, position);
  if (found.starts_with("unexpected ")) found.erase(0, 11);
  if (found == "end of input") {
    found = "the end of the file";
  } else if (found == "string literal") {
    found = "a string";
  } else if (found == "invalid literal" || found == "number literal" || found == "invalid number" ||
             found.ends_with(" literal")) {
    const bool letters = !word.empty() && IsWordCharacter(word.front());
    found = letters ? ShortToken(std::string(word)) : fmt::format("'{}'", word);
  }
  return fmt::format("found {}, expected {}{}", found, expected, Hint(text, position, word));
}

std::string CompactText(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string FlatText(const Json& value) {
  if (!value.is_structured()) return value.dump();
  std::string text;
  for (auto child = value.begin(); child != value.end(); ++child) {
    text += text.empty() ? "" : ", ";
    if (value.is_object()) text += Json(child.key()).dump() + ": ";
    text += FlatText(*child);
  }
  return value.is_object() ? "{" + text + "}" : "[" + text + "]";
}

std::string JsonText(const Json& document) { return Written(document, 0, 0) + "\n"; }

}  // namespace loopbench::harness
