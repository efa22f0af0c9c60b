// A picture as one page of HTML: data, style and script in it, nothing from elsewhere.
#pragma once

#include <string>
#include <string_view>

#include "harness/view/picture.h"

namespace loopbench::harness {

/// web/scene.js (draws any poses of a picture) with what it is made of, web/scene.css and
/// web/view.js (the page of one mechanism), as they were when the program was built.
extern const std::string_view kSceneScript, kSceneStyle, kViewScript;

/// A page from its first line into its style element, which is left open, with kSceneStyle in it.
/// Nothing may be loaded or sent from there, whatever a name tries. `title` is safe for XML.
std::string PageHead(std::string_view title);

std::string ToHtml(const Picture& picture);

}  // namespace loopbench::harness
