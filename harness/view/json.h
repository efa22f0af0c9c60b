// A picture as JSON for web/scene.js, safe inside an element of HTML.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "harness/view/picture.h"

namespace loopbench::harness {

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

}  // namespace loopbench::harness
