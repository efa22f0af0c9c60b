// SVG writer of a picture, for papers: line widths for print, 8-point fonts, light fills and dark
// lines that stay visible in greyscale. The file is self-contained, without style sheet and script.
#pragma once

#include <string>
#include <unordered_set>

#include "harness/view/picture.h"

namespace loopbench::harness {

struct SvgOptions {
  std::string view = "oblique";  ///< name from ViewNames()
  /// Draws only the mechanism: no outline of the given poses, no loop openings, no text below.
  bool plain = false;
};

std::string ToSvg(const Picture& picture, const SvgOptions& options);

/// Returns the largest length of 1, 2 or 5 times a power of ten that is at most `longest`.
double RoundLength(double longest);

// Shapes as SVG elements.

/// Draws shapes in order. Shapes too small to be visible become dots, at most one per pixel. A
/// picture of 10^5 shapes therefore stays small.
class SvgPen {
 public:
  SvgPen(const Picture& picture, const Camera& camera) : picture_(picture), camera_(camera) {}

  /// Draws all shapes at `poses`, the farthest first.
  void DrawAll(const Poses& poses);
  /// Draws only dashed outlines of bodies and sliders.
  void DrawGhost(const Poses& poses);

  /// Returns the elements drawn since the last call.
  std::string Take();

 private:
  void Draw(const PictureShape& shape, const Poses& poses);
  void Dot(const ProjectedPoint& spot);

  const Picture& picture_;
  const Camera& camera_;
  std::string text_, dots_;
  std::unordered_set<long> cells_;
};

}  // namespace loopbench::harness
