#include "harness/report/html.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "harness/config/formulations.h"
#include "harness/judge/claims_report.h"
#include "harness/report/json.h"
#include "harness/view/html.h"
#include "harness/view/json.h"
#include "harness/view/svg.h"

namespace loopbench::harness {
namespace {

using Rgb = std::array<int, 3>;

Rgb Parsed(const std::string& color) {
  Rgb rgb{};
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    rgb[i] = std::stoi(color.substr(1 + 2 * i, 2), nullptr, 16);
  }
  return rgb;
}

/// Contrast of two colours, from 1 to 21 (WCAG 2.1).
double Contrast(const Rgb& one, const Rgb& other) {
  const auto luminance = [](const Rgb& rgb) {
    constexpr std::array kWeights = {0.2126, 0.7152, 0.0722};
    double sum = 0.05;
    for (std::size_t i = 0; i < rgb.size(); ++i) {
      const double v = rgb[i] / 255.0;
      sum += kWeights[i] * (v <= 0.03928 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
    }
    return sum;
  };
  const double a = luminance(one), b = luminance(other);
  return std::max(a, b) / std::min(a, b);
}

/// From `color` in small steps towards `end`, to the first or the last colour whose contrast to
/// `paper` is at least `least`.
Rgb Towards(const Rgb& end, const Rgb& color, const Rgb& paper, double least, bool first) {
  constexpr int kSteps = 64;
  Rgb found = color;
  for (int step = 0; step <= kSteps; ++step) {
    Rgb mixed{};
    for (std::size_t i = 0; i < mixed.size(); ++i) {
      mixed[i] = color[i] + (end[i] - color[i]) * step / kSteps;
    }
    const bool is_enough = Contrast(mixed, paper) >= least;
    if (is_enough == first) return first ? mixed : found;
    found = mixed;
  }
  return found;
}

/// Colours of formulations on light and on dark paper: --look-N in joint coordinates and, nearer to
/// the paper, --look-N-weak in absolute ones. Graphics need a contrast of 3.
std::string LookStyle() {
  constexpr double kStrong = 5.0, kWeak = 3.0;
  struct Theme {
    const char* selector;
    Rgb paper, end;  ///< --paper of web/scene.css, and the end of the scale of greys opposite to it
  };
  const Theme themes[] = {{":root", {0xff, 0xff, 0xff}, {0, 0, 0}},
                          {":root[data-theme='dark']", {0x14, 0x17, 0x1c}, {0xff, 0xff, 0xff}}};
  std::string style;
  for (const auto& [selector, paper, end] : themes) {
    style += fmt::format("{} {{", selector);
    std::size_t number = 0;
    for (const FormulationRow& row : Formulations()) {
      const Rgb strong = Towards(end, Parsed(row.color), paper, kStrong, true);
      const Rgb weak = Towards(paper, strong, paper, kWeak, false);
      for (const auto& [ending, rgb] : {std::pair{"", strong}, {"-weak", weak}}) {
        style += fmt::format(" --look-{}{}: #{:02x}{:02x}{:02x};", number, ending, rgb[0], rgb[1],
                             rgb[2]);
      }
      ++number;
    }
    style += " }\n";
  }
  return style;
}

std::string List(const std::vector<std::string>& lines) {
  if (lines.empty()) return "";
  std::string text = "<ul>\n";
  for (const std::string& line : lines) text += "<li>" + EscapeXml(line) + "</li>\n";
  return text + "</ul>\n";
}

std::string Command(const std::string& command) {
  return "<p class=\"command\"><code>" + EscapeXml(command) + "</code></p>\n";
}

std::string Runs(std::size_t count) {
  return fmt::format("{} run{}", count, count == 1 ? "" : "s");
}

/// What was run and how it ended, in a sentence and in a bar.
std::string SummaryOf(const ReportData& data) {
  if (data.runs == 0) return "<p>The store has no accuracy runs.</p>\n";
  const std::size_t good = data.runs - data.failed - data.doubted;
  std::string text = fmt::format(
      "<p class=\"counts\"><span class=\"good\">{} finished without doubt</span> "
      "<span class=\"doubt\">{} doubtful</span> <span class=\"bad\">{} failed</span></p>\n",
      good, data.doubted, data.failed);
  text += "<div class=\"bar\" role=\"img\" aria-label=\"shares of all runs\">";
  for (const auto& [name, count] :
       {std::pair{"good", good}, {"doubt", data.doubted}, {"bad", data.failed}}) {
    if (count > 0) text += fmt::format("<span class=\"{}\" style=\"flex:{}\"></span>", name, count);
  }
  return text + "</div>\n";
}

std::string FindingsOf(const ReportData& data) {
  if (data.runs > 0 && data.findings.empty()) {
    return "<p>Every run finished, and none gives reason for doubt.</p>\n";
  }
  std::string text = "<ul class=\"findings\">\n";
  for (const ReportFinding& finding : data.findings) {
    text += fmt::format(
        "<li class=\"{}\"><b>{}</b> {} <button type=\"button\" class=\"show\" "
        "data-filter=\"{}\">Show these runs</button></li>\n",
        finding.failed ? "bad" : "doubt",
        finding.failed ? "Failed:" : "Doubtful:", EscapeXml(finding.text),
        EscapeXml(finding.filter));
  }
  return text + "</ul>\n";
}

std::string ClaimsOf(const ReportData& data) {
  if (data.claims.empty()) return "";
  std::string text = "<h3>Claims</h3>\n";
  for (const ClaimResult& claim : data.claims) {
    const char* look = claim.verdict == Verdict::kReproduced      ? "good"
                       : claim.verdict == Verdict::kNotReproduced ? "bad"
                                                                  : "doubt";
    text += fmt::format(
        "<details class=\"claim {}\"><summary><b>{}</b> {} <span class=\"soft\">({})</span>"
        "</summary>\n<p>{}</p>\n<table class=\"plain\"><tr>",
        look, EscapeXml(ToString(claim.verdict)), EscapeXml(claim.rule.claim),
        EscapeXml(claim.rule.where), EscapeXml(claim.text));
    const Table checks = CheckTable(claim);
    for (const TableColumn& column : checks.columns) {
      text += "<th>" + EscapeXml(column.header) + "</th>";
    }
    text += "</tr>\n";
    for (const Record& row : checks.rows) {
      text += "<tr>";
      for (const TableColumn& column : checks.columns) {
        text += "<td>" + EscapeXml(Cell(row, column)) + "</td>";
      }
      text += "</tr>\n";
    }
    text += "</table></details>\n";
  }
  return text + Command(data.claims_command);
}

std::string Links(const ReportData& data) {
  std::string text =
      "<a href=\"#verdicts\">Verdicts</a> <a href=\"#motion\">Motion and curves</a> ";
  text += "<a href=\"#tables\">Cases</a> ";
  if (!data.costs.empty()) text += "<a href=\"#costs\">Work and precision</a> ";
  if (data.map) text += "<a href=\"#map\">Failure map</a> ";
  return text + "<a href=\"#sources\">Sources</a>";
}

std::string SourcesOf(const ReportData& data) {
  std::string text = "<section id=\"sources\"><h2>Sources</h2>\n<h3>What made the records</h3>\n" +
                     List(data.origins);
  text += "<h3>What made this page</h3>\n" + List(data.provenance);
  if (!data.remarks.empty()) {
    text += "<h3>What is not in this page</h3>\n" + List(data.remarks);
  }
  text +=
      "<p class=\"soft\">Curves are drawn with uPlot, under the MIT License; its text stands in "
      "the "
      "source of this page.</p>\n";
  return text + "</section>\n";
}

}  // namespace

std::string ToHtml(const ReportData& data) {
  const std::string title = EscapeXml(data.store);
  std::string page = PageHead("Report of " + title);
  page += kReportStyle;
  page += LookStyle();
  page += "</style>\n</head>\n<body>\n";
  page += fmt::format(
      "<header><h1>Report of {}</h1>\n<nav aria-label=\"Sections\">{} <button type=\"button\" "
      "id=\"theme\">Dark</button></nav></header>\n<main class=\"report\">\n",
      title, Links(data));
  page += "<section id=\"verdicts\"><h2>Verdicts and doubts: " + Runs(data.runs) + "</h2>\n" +
          SummaryOf(data) + FindingsOf(data) + ClaimsOf(data) + List(data.warnings) +
          "</section>\n";
  page += "<section id=\"motion\"><h2>Motion and curves</h2></section>\n";
  page += "<section id=\"tables\"><h2>Cases</h2></section>\n";
  if (!data.costs.empty()) {
    page += "<section id=\"costs\"><h2>Work and precision</h2></section>\n";
  }
  if (data.map) page += "<section id=\"map\"><h2>Failure map</h2></section>\n";
  page += SourcesOf(data);
  page +=
      "</main>\n<noscript><p>Tables and curves need JavaScript; loopbench table and plot do "
      "not.</p></noscript>\n";
  for (const DataElement& element : ToJson(data)) {
    page += "<script type=\"application/json\" id=\"data-" + element.id + "\">" + element.json +
            "</script>\n";
  }
  page += "<script type=\"application/json\" id=\"data-plot-command\">";
  page += ScriptString(data.plot_command) + "</script>\n<script>\n";
  page += kSceneScript;
  page += kReportScript;
  return page + "</script>\n</body>\n</html>\n";
}

}  // namespace loopbench::harness
