#include "harness/view/html.h"

#include <fmt/format.h>

#include "harness/view/json.h"
#include "harness/view/svg.h"

namespace loopbench::harness {
namespace {

// 0 title, 1 subtitle, 2 failure, 3 whether the ghost is shown
constexpr const char* kBody = R"(<header>
<h1>{0}</h1>
<p class="soft">{1}</p>
{2}</header>
<main>
<div>
<div id="stage">
<canvas id="canvas" tabindex="0" role="img" aria-label="Drawing of {0}; the lists beside it name its parts"
 aria-describedby="keys"></canvas>
<div id="tip" hidden></div>
</div>
<p id="said" role="status" aria-live="polite"></p>
<div class="controls">
<div class="row">
<label>Motion <select id="motion"></select></label>
<button type="button" id="play" aria-pressed="false">Play</button>
<input type="range" id="frame" min="0" max="1" step="any" value="0" aria-label="Frame of the motion">
</div>
<p id="motiontext" class="soft"></p>
<div class="row">
<label><input type="checkbox" id="names" checked> names</label>
<label><input type="checkbox" id="centres" checked> centres of mass</label>
<label><input type="checkbox" id="given"{3}> as the file says it, with open loops</label>
<button type="button" id="fit">Whole</button>
<button type="button" id="theme">Dark</button>
</div>
</div>
<p id="keys" class="soft keys">Drag to turn (in the plane: to move), wheel or two fingers to zoom, <kbd>Shift</kbd> and
drag to move. Keys: arrows, <kbd>+</kbd> <kbd>-</kbd> <kbd>0</kbd>, <kbd>Space</kbd> plays, <kbd>n</kbd> next motion,
<kbd>g</kbd> as the file says it, <kbd>t</kbd> light or dark.</p>
</div>
<aside id="lists" aria-label="Parts"></aside>
</main>
<noscript><p>The drawing needs JavaScript; loopbench view --format svg does not.</p></noscript>
)";

std::string Plural(std::size_t count, const char* one, const char* many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

}  // namespace

std::string PageHead(std::string_view title) {
  std::string head = fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<link rel=\"icon\" href=\"data:,\">\n<title>{}</title>\n<style>\n",
      title);
  head += kSceneStyle;
  return head;
}

std::string ToHtml(const Picture& picture) {
  const std::string title = EscapeXml(picture.name);
  const std::string subtitle = EscapeXml(fmt::format(
      "{}{}, {}, {}{}", picture.file.empty() ? "" : picture.file + ": ",
      Plural(picture.bodies - 1, "body", "bodies"), Plural(picture.joints, "joint", "joints"),
      Plural(picture.loops.size(), "loop", "loops"),
      picture.freedom.empty() ? "" : "; degrees of freedom: " + picture.freedom));
  const std::string failure =
      picture.assembled
          ? ""
          : "<p class=\"failed\" role=\"alert\">Not assembled, drawn as the file says "
            "it: " +
                EscapeXml(picture.message) + "</p>\n";
  std::string page = PageHead(title);
  page += "</style>\n</head>\n<body>\n";
  page += fmt::format(kBody, title, subtitle, failure, picture.assembled ? "" : " checked");
  page += "<script type=\"application/json\" id=\"picture\">" + ToJson(picture) + "</script>\n";
  page += "<script>\n";
  page += kSceneScript;
  page += kViewScript;
  return page + "</script>\n</body>\n</html>\n";
}

}  // namespace loopbench::harness
