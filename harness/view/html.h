// A picture as JSON, as the page that shows it, and as tables.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "harness/tables/table.h"
#include "harness/view/picture.h"

namespace loopbench::harness {

// A picture as JSON, and the page that shows it.

// A picture as JSON for web/scene.js, safe inside an element of HTML.

/// A JSON string without <, >, & and separators of lines, so that no text ends the element or the
/// line that it stands in. Control characters and bytes that are no UTF-8 are shown (escape.h).
std::string ScriptString(std::string_view text);

/// "[a,b]" of what `write` makes of each.
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

/// Numbers have ten digits, poses are as scene.js describes them.
std::string ToJson(const Picture& picture);

/// Poses alone, for what is drawn with the picture of the same mechanism, in so many digits.
std::string PosesJson(const Poses& poses, bool planar, int digits = 10);

// A picture as one page of HTML: data, style and script in it, nothing from elsewhere.

/// web/scene.js (draws any poses of a picture) with what it is made of, web/scene.css and
/// web/view.js (the page of one mechanism), as they were when the program was built.
extern const std::string_view kSceneScript, kSceneStyle, kViewScript;

/// A page from its first line into its style element, which is left open, with kSceneStyle in it.
/// Nothing may be loaded or sent from there, whatever a name tries. `title` is safe for XML.
std::string PageHead(std::string_view title);

std::string ToHtml(const Picture& picture);

// A picture as tables of places, for terminals and readers of screens.

/// Bodies, joints, forces, loops and motions, each with what `explain` does not say: where they are
/// in ground axes [m, rad].
std::vector<Table> ToTables(const Picture& picture);

}  // namespace loopbench::harness
