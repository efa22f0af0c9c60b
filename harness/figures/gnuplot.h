// gnuplot, the program that draws all figures.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopbench::harness {

/// Letters of all drawings [pt], the distance of their lines and their mean width.
inline constexpr double kLetterSize = 8.0, kLineHeight = 10.0, kLetterWidth = 4.2;

/// The size of a drawing [pt].
struct GnuplotPage {
  double width = 504.0, height = 260.0;
};

/// Points of 1/72 inch.
constexpr double PointsOf(double millimetres) { return millimetres * 72.0 / 25.4; }

/// Characters of UTF-8.
std::size_t Letters(std::string_view text);

/// About how wide it is [pt].
double WidthOf(std::string_view text);

/// Lines of at most `most` letters, broken at spaces; a longer word stays whole.
std::vector<std::string> Wrapped(const std::string& text, std::size_t most);

/// A text at a place of the page [pt] from its lower left corner; `options` are gnuplot's of
/// labels.
std::string TextAt(const GnuplotPage& page, std::string_view text, double x, double y,
                   std::string_view options);

/// Runs `script`, which sets neither terminal nor output and whose texts are QuoteGnuplot()'s, and
/// writes `path`, as PDF when its
/// extension is ".pdf", else as SVG. Returns nothing on success, else the reason: gnuplot missing
/// (and the package that has it) or gnuplot's own message. The file is complete or absent, and
/// there are no others, even if this process is killed meanwhile. No shell takes part.
[[nodiscard]] std::optional<std::string> DrawWithGnuplot(const std::filesystem::path& path,
                                                         const GnuplotPage& page,
                                                         const std::string& script,
                                                         const std::string& gnuplot = "gnuplot");

}  // namespace loopbench::harness
