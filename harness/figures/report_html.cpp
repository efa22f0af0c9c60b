#include "harness/config/formulations.h"
#include "harness/figures/report.h"

namespace loopbench::harness {
namespace {

/// Returns a JSON number; null (a gap) if not finite, since JSON has no such numbers.
std::string Exact(double value) { return std::isfinite(value) ? fmt::format("{}", value) : "null"; }
std::string Drawn(double value) {
  return std::isfinite(value) ? fmt::format("{:.5g}", value) : "null";
}

/// Returns a time with enough digits to keep the times of a curve distinct.
std::string Moment(double value) {
  return std::isfinite(value) ? fmt::format("{:.9g}", value) : "null";
}

/// Returns the cells as printed in tables, each text once, plus numbers for sorting and filters.
std::string ColumnText(const ReportTable& table, const TableColumn& column, bool is_brief) {
  std::map<std::string, std::size_t> numbers;
  std::vector<std::string> words;
  std::string at = "[", values = "[";
  for (const Record& row : table.rows) {
    const std::string cell = Cell(row, column);
    const auto [place, is_new] = numbers.emplace(cell, words.size());
    if (is_new) words.push_back(cell);
    at += fmt::format("{}{}", at.size() > 1 ? "," : "", place->second);
    if (column.format == Format::kText) continue;
    values += (values.size() > 1 ? "," : "") + Exact(row.Number(column.key));
  }
  return fmt::format(R"({{"key":{},"header":{},"brief":{},"words":{},"at":{}]{}}})",
                     ScriptString(column.key), ScriptString(column.header), is_brief,
                     Strings(words), at,
                     column.format == Format::kText ? "" : ",\"numbers\":" + values + "]");
}

/// Returns true for initially visible columns: those of terminal tables, warnings and errors.
bool IsBrief(const ReportTable& table, const std::string& key) {
  const std::vector<TableColumn> few = ColumnsOfKind(table.kind, true);
  if (Contains(few, key, &TableColumn::key)) return true;
  return key == "warnings" || key == "error_position_max";
}

std::string TableText(const ReportTable& table) {
  const std::vector<std::string> telling = DistinguishingKeys(table.rows);
  const auto column = [&](const TableColumn& one) {
    const bool tells = Contains(telling, one.key);
    return ColumnText(table, one, tells || IsBrief(table, one.key));
  };
  const auto text = [](const char* key) {
    return [key](const Record& row) { return ScriptString(row.Text(key)); };
  };
  return fmt::format(
      R"({{"kind":"{}","title":{},"command":{},"alike":{},"names":{},"problems":{},"ids":{},"warnings":{},"failed":{},"formulations":{},"absolute":{},"messages":{},"columns":{}}})",
      table.kind, ScriptString(table.title), ScriptString(table.command), Strings(table.alike),
      Strings(table.names), Strings(table.problems), ListOf(table.rows, text("case_id")),
      ListOf(table.rows, text("warnings")),
      ListOf(table.rows, [](const Record& row) { return HasFailed(row) ? "1" : "0"; }),
      ListOf(table.rows, text("formulation")),
      ListOf(table.rows,
             [](const Record& row) { return row.Text("coordinates") == "absolute" ? "1" : "0"; }),
      ListOf(table.rows, text("message")), ListOf(table.columns, column));
}

/// Returns CSS variables of the colours of each formulation in joint and in absolute coordinates
/// (LookStyle()).
std::string LooksText() {
  std::string text;
  std::size_t number = 0;
  for (const std::string& name : FormulationNames()) {
    text += fmt::format(R"({0}{1}:["--look-{2}","--look-{2}-weak"])", text.empty() ? "" : ",",
                        ScriptString(name), number++);
  }
  return "{" + text + "}";
}

std::string CurvesText(const ReportPlot& plot) {
  return ListOf(plot.curves, [](const ReportCurve& curve) {
    return fmt::format(R"({{"row":{},"t":{},"y":{}}})", curve.row, ListOf(curve.t, Moment),
                       ListOf(curve.y, Drawn));
  });
}

std::string CostRowText(const WorkPrecisionRow& row, const std::vector<std::string>& keys) {
  return fmt::format(
      R"({{"name":{},"id":{},"formulation":{},"absolute":{},"x":{},"y":{},"bound":{},"front":{},"reason":{}}})",
      ScriptString(NameOfRow(row.record, keys)), ScriptString(row.record.Text("case_id")),
      ScriptString(row.record.Text("formulation")), row.record.Text("coordinates") == "absolute",
      Drawn(row.cost), Drawn(row.error), row.is_bound, row.on_front, ScriptString(row.reason));
}

std::string CostText(const ReportCost& cost) {
  const auto problem = [](const WorkPrecisionProblem& one) {
    std::vector<Record> records = Mapped<Record>(one.rows, &WorkPrecisionRow::record);
    const std::vector<std::string> keys = DistinguishingKeys(records);
    return fmt::format(
        R"({{"name":{},"rows":{}}})", ScriptString(one.name),
        ListOf(one.rows, [&](const WorkPrecisionRow& row) { return CostRowText(row, keys); }));
  };
  return fmt::format(
      R"({{"error":{},"cost":{},"command":{},"fairness":{},"remarks":{},"problems":{}}})",
      ScriptString(cost.error), ScriptString(cost.cost), ScriptString(cost.command),
      Strings(cost.fairness), Strings(cost.work_precision.remarks),
      ListOf(cost.work_precision.problems, problem));
}

std::string CellText(const MapCell& cell) {
  return fmt::format(
      R"({{"state":"{}","text":{},"number":{},"count":{},"reason":{},"limit":{},"id":{},"holding":{},"records":{},"cases":{},"demanded":{}}})",
      ToString(cell.state), ScriptString(ClassText(cell)), ScriptString(DecidingNumber(cell)),
      ScriptString(HoldingCount(cell)), ScriptString(cell.reason),
      ScriptString(cell.decided.reason), ScriptString(cell.case_id), cell.holding, cell.records,
      cell.cases, cell.demanded);
}

std::string MapText(const RobustnessMap& map, const std::string& command) {
  std::string groups;
  for (std::size_t g = 0; g < map.cells.size(); ++g) {
    const MapGroup& group = map.rules.groups[g];
    std::string rows;
    for (std::size_t r = 0; r < group.rows.size(); ++r) {
      const MapRow& row = group.rows[r];
      rows += fmt::format(
          R"({}{{"label":{},"why":{},"select":{},"demands":{},"cells":{}}})", r == 0 ? "" : ",",
          ScriptString(row.label), ScriptString(row.why), ScriptString(ToText(row.select)),
          ListOf(row.decides, [](const Demand& one) { return ScriptString(ToText(one)); }),
          ListOf(map.cells[g][r], CellText));
    }
    groups += fmt::format(R"({}{{"label":{},"rows":[{}]}})", g == 0 ? "" : ",",
                          ScriptString(group.label), rows);
  }
  return fmt::format(
      R"({{"title":{},"comment":{},"command":{},"states":{},"columns":{},"remarks":{},"groups":[{}]}})",
      ScriptString(map.rules.title), ScriptString(map.rules.comment), ScriptString(command),
      ListOf(kCellStates, [](CellState state) { return ScriptString(ToString(state)); }),
      ListOf(map.rules.columns, [](const MapMethod& one) { return ScriptString(one.label); }),
      Strings(map.remarks), groups);
}

std::string ProblemText(const ReportProblem& problem) {
  const bool planar = problem.picture && problem.picture->planar;
  const auto path = [&](const ReportPath& one) {
    return fmt::format(
        R"({{"label":{},"row":{},"times":{},"frames":{}}})", ScriptString(one.label),
        one.row ? std::to_string(*one.row) : "null", ListOf(one.times, Moment),
        ListOf(one.poses, [&](const Poses& poses) { return PosesJson(poses, planar, 7); }));
  };
  return fmt::format(R"({{"name":{},"missing":{},"picture":{},"paths":{}}})",
                     ScriptString(problem.name), ScriptString(problem.missing),
                     problem.picture ? ToJson(*problem.picture) : "null",
                     ListOf(problem.paths, path));
}

}  // namespace

std::vector<DataElement> ToJson(const ReportData& data) {
  const std::string warnings = Joined(MeaningsOfWarnings(), ",", [](const auto& row) {
    return ScriptString(row.first) + ":" + ScriptString(row.second);
  });
  std::vector<DataElement> elements = {
      {"tables", fmt::format(R"({{"looks":{},"warnings":{{{}}},"tables":{}}})", LooksText(),
                             warnings, ListOf(data.tables, TableText))},
      {"problems", ListOf(data.problems, ProblemText)},
      {"costs", ListOf(data.costs, CostText)},
      {"plots", ListOf(data.plots, [](const ReportPlot& plot) {
         return fmt::format(R"({{"name":"{}","title":{},"unit":{}}})", plot.name,
                            ScriptString(plot.title), ScriptString(plot.unit));
       })}};
  if (data.map) elements.push_back({"map", MapText(*data.map, data.map_command)});
  for (const ReportPlot& plot : data.plots) {
    elements.push_back({"curves-" + plot.name, CurvesText(plot)});
  }
  return elements;
}

namespace {

using Rgb = std::array<int, 3>;

Rgb Parsed(const std::string& color) {
  Rgb rgb{};
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    rgb[i] = std::stoi(color.substr(1 + 2 * i, 2), nullptr, 16);
  }
  return rgb;
}

/// Returns the contrast of two colours, from 1 to 21 (WCAG 2.1).
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

/// Moves from `color` in small steps towards `end`: returns the first or last colour with a
/// contrast to `paper` of at least `least`.
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

/// Returns colours of formulations on light and dark paper: --look-N in joint coordinates and the
/// paler --look-N-weak in absolute ones. Graphics need a contrast of 3.
std::string LookStyle() {
  constexpr double kStrong = 5.0, kWeak = 3.0;
  struct Theme {
    const char* selector;
    Rgb paper, end;  ///< --paper of web/scene.css, and black or white opposite to it
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
  return "<ul>\n" +
         Joined(lines, "",
                [](const std::string& line) { return "<li>" + EscapeXml(line) + "</li>\n"; }) +
         "</ul>\n";
}

std::string Command(const std::string& command) {
  return "<p class=\"command\"><code>" + EscapeXml(command) + "</code></p>\n";
}

std::string SummaryOf(const ReportData& data) {
  if (data.runs == 0) return "<p>The store has no accuracy runs.</p>\n";
  const std::size_t good = data.runs - data.failed - data.flagged;
  std::string text = fmt::format(
      "<p class=\"counts\"><span class=\"good\">{} finished without warnings</span> "
      "<span class=\"flagged\">{} flagged</span> <span class=\"bad\">{} failed</span></p>\n",
      good, data.flagged, data.failed);
  text += "<div class=\"bar\" role=\"img\" aria-label=\"shares of all runs\">";
  for (const auto& [name, count] :
       {std::pair{"good", good}, {"flagged", data.flagged}, {"bad", data.failed}}) {
    if (count > 0) text += fmt::format("<span class=\"{}\" style=\"flex:{}\"></span>", name, count);
  }
  return text + "</div>\n";
}

std::string FindingsOf(const ReportData& data) {
  if (data.runs > 0 && data.findings.empty()) {
    return "<p>Every run finished, and none gives warnings.</p>\n";
  }
  std::string text = "<ul class=\"findings\">\n";
  for (const ReportFinding& finding : data.findings) {
    text += fmt::format(
        "<li class=\"{}\"><b>{}</b> {} <button type=\"button\" class=\"show\" "
        "data-filter=\"{}\">Show these runs</button></li>\n",
        finding.failed ? "bad" : "flagged",
        finding.failed ? "Failed:" : "Flagged:", EscapeXml(finding.text),
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
                                                                  : "flagged";
    text += fmt::format(
        "<details class=\"claim {}\"><summary><b>{}</b> {} <span class=\"soft\">({})</span>"
        "</summary>\n<p>{}</p>\n<table class=\"plain\"><tr>",
        look, EscapeXml(ToString(claim.verdict)), EscapeXml(claim.rule.claim),
        EscapeXml(claim.rule.where), EscapeXml(claim.text));
    const Table checks = CheckTable(claim);
    text += Joined(checks.columns, "", [](const TableColumn& column) {
      return "<th>" + EscapeXml(column.header) + "</th>";
    });
    for (const Record& row : checks.rows) {
      text += "</tr>\n<tr>" + Joined(checks.columns, "", [&row](const TableColumn& column) {
                return "<td>" + EscapeXml(Cell(row, column)) + "</td>";
              });
    }
    text += "</tr>\n</table></details>\n";
  }
  return text + Command(data.claims_command);
}

}  // namespace

std::string ToHtml(const ReportData& data) {
  const std::string title = EscapeXml(data.store);
  std::string links =
      "<a href=\"#verdicts\">Verdicts</a> <a href=\"#motion\">Motion and curves</a> <a "
      "href=\"#tables\">Cases</a> ";
  if (!data.costs.empty()) links += "<a href=\"#costs\">Work and precision</a> ";
  if (data.map) links += "<a href=\"#map\">Robustness map</a> ";
  links += "<a href=\"#sources\">Sources</a>";
  std::string page = PageHead("Report of " + title);
  page += kReportStyle;
  page += LookStyle();
  page += "</style>\n</head>\n<body>\n";
  page += fmt::format(
      "<header><h1>Report of {}</h1>\n<nav aria-label=\"Sections\">{} <button type=\"button\" "
      "id=\"theme\">Dark</button></nav></header>\n<main class=\"report\">\n",
      title, links);
  page += "<section id=\"verdicts\"><h2>Verdicts and warnings: " + WithCount(data.runs, "run") +
          "</h2>\n" + SummaryOf(data) + FindingsOf(data) + ClaimsOf(data) + List(data.warnings) +
          "</section>\n";
  page += "<section id=\"motion\"><h2>Motion and curves</h2></section>\n";
  page += "<section id=\"tables\"><h2>Cases</h2></section>\n";
  if (!data.costs.empty()) {
    page += "<section id=\"costs\"><h2>Work and precision</h2></section>\n";
  }
  if (data.map) page += "<section id=\"map\"><h2>Robustness map</h2></section>\n";
  page += "<section id=\"sources\"><h2>Sources</h2>\n<h3>What made the records</h3>\n" +
          List(data.origins) + "<h3>What made this page</h3>\n" + List(data.provenance);
  if (!data.remarks.empty()) page += "<h3>What is not in this page</h3>\n" + List(data.remarks);
  page +=
      "<p class=\"soft\">Curves are drawn with uPlot, under the MIT License; its text is in "
      "the source of this page.</p>\n</section>\n</main>\n<noscript><p>Tables and curves need "
      "JavaScript; loopbench table and plot do "
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
