// A picture as SVG: for papers. Widths are of print, fonts of 8 points, fills are light and lines
// dark, so that nothing is lost in greyscale; no style sheet, no script, nothing from elsewhere.
#pragma once

#include <string>
#include <unordered_set>

#include "harness/view/picture.h"

namespace loopbench::harness {

struct SvgOptions {
  std::string view = "oblique";  ///< of ViewNames()
  /// Only the mechanism: no ghost of what the file says, no gaps, no lines of text below.
  bool plain = false;
};

std::string ToSvg(const Picture& picture, const SvgOptions& options);

/// A length that is one, two or five times a power of ten, at most `longest`.
double RoundLength(double longest);

// Shapes as elements of SVG.

/// Draws shapes one after the other; those that are too small to be seen leave a dot, at most one
/// per pixel, so that a picture of 10^5 shapes is not larger than its paper.
class SvgPen {
 public:
  SvgPen(const Picture& picture, const Camera& camera) : picture_(picture), camera_(camera) {}

  /// All shapes at `poses`, the farthest first.
  void DrawAll(const Poses& poses);
  /// Outlines of bodies and sliders alone, dashed.
  void DrawGhost(const Poses& poses);

  /// What was drawn since the last call.
  std::string Take();

 private:
  void Draw(const PictureShape& shape, const Poses& poses);
  void Dot(const Spot& spot);

  const Picture& picture_;
  const Camera& camera_;
  std::string text_, dots_;
  std::unordered_set<long> cells_;
};

}  // namespace loopbench::harness
