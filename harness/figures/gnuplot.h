// gnuplot, the program that draws all figures.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace loopbench::harness {

/// The size of a drawing in pixels (SVG) or hundredths of an inch (PDF) and of its font in pixels
/// or points.
struct GnuplotPage {
  int width = 960, height = 500;
  int font = 13;
};

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
