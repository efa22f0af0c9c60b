#include "harness/figures/gnuplot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>

#include "harness/text/escape.h"
#include "harness/text/files.h"
#include "harness/text/run_program.h"

namespace loopbench::harness {
namespace {

// pdfcairo takes 4/3 points for a point of letters and half a point for a width of 1.
std::string TerminalOf(const GnuplotPage& page, bool pdf) {
  if (!pdf) {
    return fmt::format(
        "svg noenhanced size {:.0f},{:.0f} font 'Helvetica,Arial,sans-serif,{:g}' background "
        "'#ffffff'",
        page.width, page.height, kLetterSize);
  }
  return fmt::format(
      "pdfcairo noenhanced size {:.4f}in,{:.4f}in font 'Helvetica,{:g}' fontscale 0.75 linewidth 2",
      page.width / 72.0, page.height / 72.0, kLetterSize);
}

/// A drawing in points becomes as large in print as it is meant; gnuplot writes pixels.
std::string InMillimetres(std::string svg, const GnuplotPage& page) {
  const std::string pixels =
      fmt::format("width=\"{:.0f}\" height=\"{:.0f}\"", page.width, page.height);
  const std::size_t at = svg.find(pixels);
  if (at == std::string::npos) return svg;
  return svg.replace(at, pixels.size(),
                     fmt::format("width=\"{:.2f}mm\" height=\"{:.2f}mm\"", page.width * 25.4 / 72.0,
                                 page.height * 25.4 / 72.0));
}

}  // namespace

std::size_t Letters(std::string_view text) {
  return static_cast<std::size_t>(std::ranges::count_if(
      text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0u) != 0x80u; }));
}

double WidthOf(std::string_view text) { return kLetterWidth * static_cast<double>(Letters(text)); }

std::vector<std::string> Wrapped(const std::string& text, std::size_t most) {
  std::vector<std::string> lines(1);
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find(' ', start), text.size());
    const std::string word = text.substr(start, end - start);
    if (!lines.back().empty() && Letters(lines.back()) + 1 + Letters(word) > most) {
      lines.emplace_back();
    }
    lines.back() += (lines.back().empty() ? "" : " ") + word;
    start = end + 1;
  }
  return lines;
}

std::string TextAt(const GnuplotPage& page, std::string_view text, double x, double y,
                   std::string_view options) {
  return fmt::format("set label {} at screen {:.5f}, screen {:.5f} {}\n", QuoteGnuplot(text),
                     x / page.width, y / page.height, options);
}

std::optional<std::string> DrawWithGnuplot(const std::filesystem::path& path,
                                           const GnuplotPage& page, const std::string& script,
                                           const std::string& gnuplot) {
  const bool pdf = path.extension() == ".pdf";
  // without the settings of the user's own ~/.gnuplot, which would change figures
  const ProgramResult run =
      RunProgram({gnuplot, "--default-settings"},
                 fmt::format("set terminal {}\n{}", TerminalOf(page, pdf), script));
  if (run.error != 0) {
    return fmt::format("{}: {}{}", path.string(), run.Failure(gnuplot),
                       run.error == ENOENT ? "; install gnuplot-nox" : "");
  }
  if (run.status != 0 || run.output.empty()) {
    return fmt::format("{}: gnuplot failed: {}", path.string(), run.messages);
  }
  WriteFileAtomically(path, pdf ? run.output : InMillimetres(run.output, page));
  return std::nullopt;
}

}  // namespace loopbench::harness
