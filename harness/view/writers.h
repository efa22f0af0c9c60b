// Writers of a picture: SVG, JSON, an HTML page, and tables.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "harness/tables/table.h"
#include "harness/view/picture.h"

namespace loopbench::harness {

// SVG of a picture, for papers: line widths for print, 8-point fonts, light fills and dark lines
// that stay visible in greyscale. The file is self-contained, without style sheet and script.

struct SvgOptions {
  std::string view = "oblique";  ///< name from ViewNames()
  /// Draws only the mechanism: no outline of the given poses, no loop openings, no text below.
  bool plain = false;
};

std::string ToSvg(const Picture& picture, const SvgOptions& options);

/// Returns the largest length of 1, 2 or 5 times a power of ten that is at most `longest`.
double RoundLength(double longest);

// JSON of a picture.

// JSON for web/scene.js that is safe inside an HTML element.

/// Returns a JSON string without <, >, & and line separators, so that no text ends the element or
/// line that contains it. Control characters and invalid UTF-8 are made visible (escape.h).
std::string ScriptString(std::string_view text);

/// Returns "[a,b]", where `write` converts each element.
template <class List, class Write>
std::string ListOf(const List& list, Write write) {
  std::string text = "[";
  for (const auto& one : list) {
    if (text.size() > 1) text += ',';
    text += write(one);
  }
  return text + "]";
}

inline std::string Strings(const std::vector<std::string>& list) {
  return ListOf(list, [](const std::string& one) { return ScriptString(one); });
}

/// Writes numbers with ten digits and poses as described in scene.js.
std::string ToJson(const Picture& picture);

/// Returns only the poses, with `digits` digits, for drawing with a picture of the same mechanism.
std::string PosesJson(const Poses& poses, bool planar, int digits = 10);

// A picture as one self-contained HTML page: data, style and script are embedded.

/// web/scene.js (draws any poses of a picture) with the files that it needs, web/scene.css and
/// web/view.js (page of one mechanism), embedded when the program is built.
extern const std::string_view kSceneScript, kSceneStyle, kViewScript;

/// Returns the start of a page, up to its open style element, which contains kSceneStyle. The page
/// may load or send nothing, whatever a name contains. `title` is safe for XML.
std::string PageHead(std::string_view title);

std::string ToHtml(const Picture& picture);

// A picture as tables of positions, for terminals and screen readers.

/// Returns tables of bodies, joints, forces, loops and motions with their positions in ground axes
/// [m, rad], which `explain` does not print.
std::vector<Table> ToTables(const Picture& picture);

}  // namespace loopbench::harness
