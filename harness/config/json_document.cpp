#include "harness/config/json_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <system_error>
#include <vector>

#include "harness/config/config_error.h"

namespace loopbench::harness {
namespace {

/// What the characters around a syntax error suggest, as " (...)" or "". `position` is the number
/// of characters read, so that the offending token ends just before it.
std::string Hint(std::string_view text, std::size_t position) {
  if (position == 0 || position > text.size()) return "";
  std::size_t at = position - 1;
  const char offending = text[at];
  if (offending == '/' || offending == '#') return " (comments are not allowed)";
  const bool not_a_number = offending == 'N' || offending == 'I' || offending == 'i';
  if (not_a_number) return " (NaN and Infinity are not allowed)";
  if (offending == '\'') return " (strings stand in double quotes)";
  if (offending != ']' && offending != '}') return "";
  while (at > 0 && (text[at - 1] == ' ' || text[at - 1] == '\t' || text[at - 1] == '\n' ||
                    text[at - 1] == '\r')) {
    --at;
  }
  const bool trailing_comma = at > 0 && text[at - 1] == ',';
  return trailing_comma ? " (remove the comma before the closing bracket)" : "";
}

/// The library's message without its bracketed identifier and its "parse error at".
std::string Stripped(std::string message) {
  const std::size_t bracket = message.find("] ");
  if (bracket != std::string::npos) message.erase(0, bracket + 2);
  constexpr std::string_view kPrefix = "parse error at ";
  if (message.rfind(kPrefix, 0) == 0) message.erase(0, kPrefix.size());
  return message;
}

/// "line L, column C" of the character before `position`.
std::string LineAndColumn(std::string_view text, std::size_t position) {
  const std::string_view read = text.substr(0, std::min(position, text.size()));
  const auto lines = std::count(read.begin(), read.end(), '\n');
  const std::size_t line_start = read.rfind('\n');
  const std::size_t column =
      line_start == std::string_view::npos ? read.size() : read.size() - line_start - 1;
  return fmt::format("line {}, column {}", lines + 1, column);
}

/// Walks through the document once, before it is built, and notes what the builder would forgive.
class Scanner final : public nlohmann::json_sax<Json> {
 public:
  Scanner(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  /// All complaints, one per line; "" when the document is sound.
  std::string Complaints() const { return fmt::format("{}", fmt::join(complaints_, "\n")); }

  bool null() override { return Count(); }
  bool boolean(bool) override { return Count(); }
  bool number_integer(number_integer_t) override { return Count(); }
  bool number_unsigned(number_unsigned_t) override { return Count(); }
  bool number_float(number_float_t, const string_t&) override { return Count(); }
  bool string(string_t&) override { return Count(); }
  bool binary(binary_t&) override { return Count(); }
  bool start_object(std::size_t) override { return Open(false); }
  bool start_array(std::size_t) override { return Open(true); }
  bool end_object() override { return Close(); }
  bool end_array() override { return Close(); }

  bool key(string_t& key) override {
    Level& level = levels_.back();
    level.key = key;
    if (!level.keys.insert(key).second) {
      complaints_.push_back(
          fmt::format("{}: {}: found key \"{}\" twice, expected each key once in an object", file_,
                      Pointer(), key));
    }
    return true;
  }

  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& error) override {
    // Numbers out of range come without a place of their own.
    const std::string what = Stripped(error.what());
    const std::string place =
        what.rfind("line ", 0) == 0 ? "" : LineAndColumn(text_, position) + ": ";
    complaints_.push_back(fmt::format("{}: {}{}{}", file_, place, what, Hint(text_, position)));
    return false;
  }

 private:
  struct Level {
    bool is_array = false;
    std::size_t index = 0;
    std::string key;
    std::set<std::string> keys;
  };

  bool Count() {
    if (!levels_.empty() && levels_.back().is_array) ++levels_.back().index;
    return true;
  }

  bool Open(bool is_array) {
    levels_.push_back({.is_array = is_array, .index = 0, .key = {}, .keys = {}});
    if (levels_.size() <= kMaxConfigDepth) return true;
    complaints_.push_back(fmt::format("{}: {}: found nesting deeper than {} levels", file_,
                                      Pointer(), kMaxConfigDepth));
    return false;
  }

  bool Close() {
    levels_.pop_back();
    return Count();
  }

  std::string Pointer() const {
    std::string pointer;
    for (const Level& level : levels_) {
      pointer += "/" + (level.is_array ? std::to_string(level.index) : PointerToken(level.key));
    }
    return pointer;
  }

  std::string_view text_;
  const std::string& file_;
  std::vector<Level> levels_;
  std::vector<std::string> complaints_;
};

}  // namespace

std::string ReadTextFile(const std::filesystem::path& path) {
  const auto fail = [&path](const std::string& reason) {
    throw ConfigError(fmt::format("{}: cannot be read: {}", path.string(), reason));
  };
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) fail("no such file");
  if (std::filesystem::is_directory(status)) fail("it is a folder");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail("it cannot be opened");
  // One byte more than allowed tells a file that is too large, whatever its size says (a pipe).
  std::string text(kMaxConfigBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad()) fail("reading it failed");
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMaxConfigBytes) {
    fail(fmt::format("it is larger than {} MiB", kMaxConfigBytes >> 20));
  }
  return text;
}

Json ParseDocument(std::string_view text, const std::string& file) {
  Scanner scanner(text, file);
  Json::sax_parse(text.begin(), text.end(), &scanner);
  if (std::string complaints = scanner.Complaints(); !complaints.empty()) {
    throw ConfigError(complaints);
  }
  return Json::parse(text.begin(), text.end());
}

std::string PointerToken(std::string_view key) {
  std::string token;
  for (const char c : key) {
    if (c == '~') {
      token += "~0";
    } else if (c == '/') {
      token += "~1";
    } else {
      token += c;
    }
  }
  return token;
}

}  // namespace loopbench::harness
