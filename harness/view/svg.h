// A picture as SVG: for papers. Widths are of print, fonts of 8 points, fills are light and lines
// dark, so that nothing is lost in greyscale; no style sheet, no script, nothing from elsewhere.
#pragma once

#include <string>

#include "harness/view/picture.h"

namespace loopbench::harness {

struct SvgOptions {
  std::string view = "oblique";  ///< of ViewNames()
  /// Only the mechanism: no ghost of what the file says, no gaps, no lines of text below.
  bool plain = false;
};

std::string ToSvg(const Picture& picture, const SvgOptions& options);

/// Text of SVG and HTML, in an element or an attribute: no character of it is markup, and control
/// characters are shown (escape.h).
std::string EscapeXml(std::string_view text);

/// A length that is one, two or five times a power of ten, at most `longest`.
double RoundLength(double longest);

}  // namespace loopbench::harness
