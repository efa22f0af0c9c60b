#include "harness/json/json_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <system_error>
#include <unordered_set>
#include <vector>

#include "harness/json/json_syntax.h"
#include "harness/json/json_walker.h"
#include "harness/text/config_error.h"
#include "harness/text/output_file.h"

namespace loopbench::harness {
namespace {

/// Builds the document and notes what the parser would forgive.
class Builder final : public Walker {
 public:
  Builder(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  /// The document; throws ConfigError with all complaints when there are any.
  Json Take() {
    if (complaints_.empty()) return std::move(root_);
    if (more_ > 0) complaints_.push_back(fmt::format("{}: and {} more", file_, more_));
    throw ConfigError(fmt::format("{}", fmt::join(complaints_, "\n")));
  }

  bool parse_error(std::size_t position, const std::string& token,
                   const nlohmann::detail::exception& error) override {
    const std::string_view read = text_.substr(0, std::min(position, text_.size()));
    const auto line = std::count(read.begin(), read.end(), '\n') + 1;
    const std::size_t start = read.rfind('\n');
    const std::size_t column =
        start == std::string_view::npos ? read.size() : read.size() - start - 1;
    // a number too large is reported where it ends, and the parser's words have no "parsing"
    const bool too_large = dynamic_cast<const Json::out_of_range*>(&error) != nullptr;
    const std::string what =
        too_large ? fmt::format(
                        "found the number {}, expected one that fits a double (at most "
                        "1.8e308)",
                        ShortToken(token))
                  : SyntaxMessage(error.what(), text_, position);
    complaints_.push_back(fmt::format("{}:{}:{}: {}", file_, line, std::max<std::size_t>(column, 1),
                                      Printable(what)));
    return false;
  }

 protected:
  bool Key(const std::string& key) override {
    if (!keys_.back().insert(key).second) {
      Complain(fmt::format("found key \"{}\" twice, expected each key once in an object",
                           ShortToken(key)));
    }
    return true;
  }

  bool CheckNumber(double value, const std::string& token) override {
    const std::string_view digits = std::string_view(token).substr(0, token.find_first_of("eE"));
    if (value == 0.0 && digits.find_first_of("123456789") != std::string_view::npos) {
      Complain(
          fmt::format("found {}, expected 0 or a number of at least 4.9e-324", ShortToken(token)));
    }
    return true;
  }

  bool Put(Json value) override {
    const bool container = value.is_structured();
    Json* placed = &root_;
    if (open_.empty()) {
      root_ = std::move(value);
    } else if (open_.back()->is_array()) {
      auto& array = open_.back()->get_ref<Json::array_t&>();
      placed = &array.emplace_back(std::move(value));
    } else {
      // Past the map's own emplace, which looks through all keys each time: Key() has done that.
      auto& object = open_.back()->get_ref<Json::object_t&>();
      placed = &object.emplace_back(current_key(), std::move(value)).second;
    }
    if (!container) return true;
    if (depth() >= kMaxConfigDepth) {
      Complain(fmt::format("found nesting deeper than {} levels, expected at most {}",
                           kMaxConfigDepth, kMaxConfigDepth));
      return false;
    }
    open_.push_back(placed);
    keys_.emplace_back();
    return true;
  }

  void Finish() override {
    open_.pop_back();
    keys_.pop_back();
  }

 private:
  void Complain(const std::string& what) {
    if (complaints_.size() >= kMostMessages) {
      ++more_;
    } else {
      complaints_.push_back(fmt::format("{}:{}: {}: {}", file_, line(),
                                        Printable(ShownPointer(Pointer())), Printable(what)));
    }
  }

  std::string_view text_;
  const std::string& file_;
  Json root_;
  std::vector<Json*> open_;  ///< containers not yet complete; only the last one grows
  std::vector<std::unordered_set<std::string>> keys_;
  std::vector<std::string> complaints_;
  std::size_t more_ = 0;
};

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
  // Piece by piece up to the limit: a pipe does not tell its size.
  std::string text;
  std::vector<char> piece(std::size_t{1} << 16);
  while (stream && text.size() <= kMaxConfigBytes) {
    stream.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    text.append(piece.data(), static_cast<std::size_t>(stream.gcount()));
  }
  if (stream.bad()) fail("reading it failed");
  if (text.size() > kMaxConfigBytes) {
    fail(fmt::format("it is larger than {} MiB", kMaxConfigBytes >> 20));
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
  Builder builder(text, file);
  builder.Walk(text);
  return builder.Take();
}

std::string ShownPointer(const std::string& pointer) {
  constexpr std::size_t kEnd = 100;
  if (pointer.empty()) return "(top level)";
  if (pointer.size() <= 2 * kEnd) return pointer;
  // whole UTF-8 characters only
  const auto inside = [&pointer](std::size_t i) {
    return (static_cast<unsigned char>(pointer[i]) & 0xC0u) == 0x80u;
  };
  std::size_t head = kEnd, tail = pointer.size() - kEnd;
  while (head > 0 && inside(head)) --head;
  while (tail < pointer.size() && inside(tail)) ++tail;
  return pointer.substr(0, head) + "..." + pointer.substr(tail);
}

std::string Printable(const std::string& text) {
  std::string printable;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte != 0x7F) {
      printable += c;
    } else {
      printable += fmt::format("\\u{:04x}", byte);
    }
  }
  return printable;
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
