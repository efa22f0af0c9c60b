#include "harness/report/html.h"

#include <fmt/format.h>

#include "harness/judge/claims_report.h"
#include "harness/report/json.h"
#include "harness/view/html.h"
#include "harness/view/json.h"
#include "harness/view/svg.h"

namespace loopbench::harness {
namespace {

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
