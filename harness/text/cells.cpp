#include "harness/text/cells.h"

#include <locale.h>

#include <algorithm>
#include <clocale>
#include <cwchar>

namespace loopbench::harness {
namespace {

/// The thread's characters are those of UTF-8 while it lives, whatever the environment says.
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

struct Glyph {
  std::size_t bytes = 1, cells = 1;
};

Glyph FirstGlyph(std::string_view text) {
  wchar_t wide = 0;
  std::mbstate_t state{};
  const std::size_t bytes = std::mbrtowc(&wide, text.data(), text.size(), &state);
  if (bytes == 0 || bytes > text.size()) return {};
  const int cells = ::wcwidth(wide);
  return {bytes, cells < 0 ? 1 : static_cast<std::size_t>(cells)};
}

}  // namespace

std::string_view Beginning(std::string_view text, std::size_t width) {
  const Utf8 utf8;
  std::size_t bytes = 0;
  for (std::size_t cells = 0; bytes < text.size();) {
    const Glyph glyph = FirstGlyph(text.substr(bytes));
    cells += glyph.cells;
    if (cells > width) break;
    bytes += glyph.bytes;
  }
  return text.substr(0, bytes);
}

std::size_t CellsOf(std::string_view text) {
  const Utf8 utf8;
  std::size_t cells = 0;
  while (!text.empty()) {
    const Glyph glyph = FirstGlyph(text);
    cells += glyph.cells;
    text.remove_prefix(glyph.bytes);
  }
  return cells;
}

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

}  // namespace loopbench::harness
