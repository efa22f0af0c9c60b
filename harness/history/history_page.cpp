#include <array>
#include <cmath>
#include <ranges>

#include "harness/base/text.h"
#include "harness/figures/figures.h"
#include "harness/figures/view.h"
#include "harness/history/history.h"
#include "harness/judge/judge.h"

namespace loopbench::harness {
namespace {

bool IsFailure(const Finding& finding) {
  return finding.judgement == Judgement::kWorse || finding.judgement == Judgement::kDifferent;
}

/// Disables "@name" mentions in a comment.
std::string Quiet(const std::string& markdown) {
  std::string quiet;
  for (const char c : markdown) {
    quiet += c;
    if (c == '@') quiet += "&#8203;";  // zero-width space
  }
  return quiet;
}

std::string Cell(const std::string& text) { return Quiet(EscapeMarkdown(text)); }

std::string Named(const Finding& finding) {
  const auto& [key, unit] = std::pair(finding.measure.key, finding.measure.heading.unit);
  return unit.empty() ? std::string(key) : fmt::format("{} [{}]", key, unit);
}

/// Cases, and why they are not compared.
using Missing = std::pair<const std::vector<std::string>*, const char*>;

std::vector<Missing> MissingCases(const ComparisonReport& report, const CompareOptions& options) {
  std::vector<Missing> missing = {
      {&report.ambiguous, "there more than once, not compared"},
      {&report.other_content,
       "ran another mechanism, limits or ensemble under equal keys, not compared"}};
  if (!options.subset) missing.emplace_back(&report.only_base, "only in the base");
  if (!options.added) missing.emplace_back(&report.only_fresh, "only in the new measurements");
  return missing;
}

/// Lists cases by name, up to a readable number.
std::string Listed(const std::string& what, const std::vector<std::string>& cases) {
  constexpr std::size_t kMaxNamed = 20;
  if (cases.empty()) return "";
  std::string text = fmt::format("{} {}:\n\n", cases.size(), what);
  for (const std::string& one : cases | std::views::take(kMaxNamed)) {
    text += "- " + Quiet(EscapeMarkdownParagraph(one)) + "\n";
  }
  if (cases.size() > kMaxNamed) text += fmt::format("- {} more\n", cases.size() - kMaxNamed);
  return text + "\n";
}

}  // namespace

std::string ComparisonMarkdown(const ComparisonReport& report, const std::string& conclusion,
                               const std::vector<std::string>& notes) {
  constexpr int kMaxRows = 50;
  std::string text = "### Loopbench: " + EscapeMarkdown(conclusion) + "\n\n";
  std::string rows;
  int failures = 0;
  for (const Judgement judgement : {Judgement::kWorse, Judgement::kDifferent}) {
    for (const Finding& finding : report.findings) {
      if (finding.judgement != judgement || ++failures > kMaxRows) continue;
      rows += fmt::format("| {} | {} | {} | {} | {} | {} | {} |\n", ToString(judgement),
                          Cell(finding.one), Cell(Named(finding)), Cell(finding.base),
                          Cell(finding.fresh),
                          std::isfinite(finding.ratio) ? fmt::format("{:.3f}", finding.ratio) : "",
                          Cell(finding.why));
    }
  }
  if (!rows.empty()) {
    text += "| | case | measure | base | new | ratio | why |\n|---|---|---|---|---|---|---|\n" +
            rows + "\n";
  }
  if (failures > kMaxRows) text += fmt::format("and {} more\n\n", failures - kMaxRows);
  for (const auto& [cases, why] : MissingCases(report, {})) text += Listed(why, *cases);
  text += Listed("ran with other settings, compared all the same", report.other_settings);
  text += fmt::format("{} measures the same, {} better, {} worse, {} different, {} not measured\n",
                      report.Count(Judgement::kSame), report.Count(Judgement::kBetter),
                      report.Count(Judgement::kWorse), report.Count(Judgement::kDifferent),
                      report.Count(Judgement::kNotMeasured));
  for (const std::string& note : notes) text += "\n" + Quiet(EscapeMarkdownParagraph(note)) + "\n";
  return text;
}

std::string ComparisonJunit(const ComparisonReport& report, const CompareOptions& options) {
  std::string cases;
  int tests = 0, failures = 0, skipped = 0;
  for (const Finding& finding : report.findings) {
    ++tests;
    cases += fmt::format("  <testcase classname=\"{}\" name=\"{}\">", EscapeXml(finding.one),
                         EscapeXml(Named(finding)));
    if (IsFailure(finding)) {
      ++failures;
      cases +=
          fmt::format("<failure message=\"{}: base {}, new {}; {}\"/>", ToString(finding.judgement),
                      EscapeXml(finding.base), EscapeXml(finding.fresh), EscapeXml(finding.why));
    } else if (finding.judgement == Judgement::kNotMeasured) {
      ++skipped;
      cases += fmt::format("<skipped message=\"{}\"/>", EscapeXml(finding.why));
    }
    cases += "</testcase>\n";
  }
  for (const auto& [names, why] : MissingCases(report, options)) {
    for (const std::string& name : *names) {
      ++tests;
      ++failures;
      cases += fmt::format(
          "  <testcase classname=\"{}\" name=\"case\"><failure message=\"{}\"/></testcase>\n",
          EscapeXml(name), why);
    }
  }
  const int errors = failures == 0 && report.ExitCode(options) == 2;
  if (errors > 0) {
    ++tests;
    cases += fmt::format(
        "  <testcase classname=\"loopbench compare\" name=\"measured on both sides\"><error "
        "message=\"could not measure: {}\"/></testcase>\n",
        EscapeXml(report.Obstacle(options)));
  }
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n<testsuite name=\"loopbench "
      "compare\" "
      "tests=\"{}\" failures=\"{}\" skipped=\"{}\" errors=\"{}\">\n{}</testsuite>\n</testsuites>\n",
      tests, failures, skipped, errors, cases);
}
namespace {

/// "x 1.03"
std::string RatioText(const LevelChange& change) {
  return change.before > 0.0 ? fmt::format("x {:.3g}", change.after / change.before) : "from 0";
}

constexpr std::size_t kMaxCharts = 200;
constexpr double kWidth = 760, kHeight = 190, kLeft = 92, kRight = 16, kTop = 12, kBottom = 46;

struct Chart {
  const History& history;
  const HistorySeries& series;
  double low, high;
  bool logarithmic;

  Chart(const History& entries, const HistorySeries& one) : history(entries), series(one) {
    low = std::ranges::min_element(series.values, {}, &HistoryValue::value)->value;
    // clip at the frame: one slow repetition would otherwise flatten all levels
    constexpr double kRoom = 1.25;
    const double largest = std::ranges::max_element(series.values, {}, &HistoryValue::value)->value;
    high = std::min(std::ranges::max_element(series.values, {}, &HistoryValue::upper)->upper,
                    kRoom * largest);
    logarithmic = low > 0.0 && high / low > 20.0;
    // values that differ only by round-off are drawn as equal: an axis needs numbers between
    if (high - low <= 4e-12 * std::max(std::abs(low), std::abs(high))) {
      const double room = high == 0.0 ? 1.0 : 0.1 * std::abs(high);
      low -= room;
      high += room;
    } else if (!logarithmic) {
      const double room = 0.06 * (high - low);
      low -= room;
      high += room;
    }
  }

  double X(std::size_t i) const {
    const double n = std::max<double>(1.0, static_cast<double>(series.values.size()) - 1.0);
    return kLeft + 8 + (kWidth - kLeft - kRight - 16) * static_cast<double>(i) / n;
  }
  /// Returns the height of a value over the axis, 0 to 1.
  double Share(double value) const {
    return logarithmic ? std::log(std::max(value, low) / low) / std::log(high / low)
                       : (value - low) / (high - low);
  }
  double Y(double value) const { return kTop + (kHeight - kTop - kBottom) * (1.0 - Share(value)); }
  const HistoryEntry& Entry(std::size_t i) const { return history.entries[series.values[i].entry]; }

  std::string Text() const {
    const std::string unit = series.unit.empty() ? "" : fmt::format(" [{}]", series.unit);
    std::string svg = fmt::format(
        "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\" aria-label=\"{2} "
        "of {3} over {4} "
        "commits\">\n",
        kWidth, kHeight, EscapeXml(series.measure), EscapeXml(series.one), series.values.size());
    for (const Tick& tick : Ticks({low, high, logarithmic}, 5)) {
      if (tick.label.empty()) continue;
      svg += fmt::format(
          "<line class=\"grid\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/><text x=\"{}\" "
          "y=\"{:.1f}\" "
          "text-anchor=\"end\">{}</text>\n",
          kLeft, kWidth - kRight, Y(tick.at), Y(tick.at), kLeft - 6, Y(tick.at) + 4, tick.label);
    }
    const double bottom = kHeight - kBottom;
    svg += fmt::format(
        "<line class=\"axis\" x1=\"{0}\" x2=\"{0}\" y1=\"{1}\" y2=\"{2}\"/>"
        "<line class=\"axis\" x1=\"{0}\" x2=\"{3}\" y1=\"{2}\" y2=\"{2}\"/>\n",
        kLeft, kTop, bottom, kWidth - kRight);
    const std::size_t by = std::max<std::size_t>(1, (series.values.size() + 6) / 7);
    for (std::size_t i = 0; i < series.values.size(); i += by) {
      constexpr double kHalfLabel = 44;  // width of twelve digits
      const bool is_last = X(i) + kHalfLabel > kWidth;
      svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n",
                         is_last ? kWidth - 2 : X(i), bottom + 16, is_last ? "end" : "middle",
                         EscapeXml(ShortCommit(Entry(i).commit)));
    }
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">commit</text>\n",
                       0.5 * (kLeft + kWidth - kRight), kHeight - 8);
    svg += fmt::format(
        "<text x=\"14\" y=\"{0:.1f}\" text-anchor=\"middle\" transform=\"rotate(-90 14 "
        "{0:.1f})\">{1}</text>\n",
        0.5 * (kTop + bottom), EscapeXml(series.measure + unit));
    std::size_t begin = 0;
    for (std::size_t k = 0; k <= series.changes.size() && !series.changes.empty(); ++k) {
      const bool is_last = k == series.changes.size();
      const std::size_t end = is_last ? series.values.size() : series.changes[k].at;
      const double level = is_last ? series.changes.back().after : series.changes[k].before;
      svg += fmt::format(
          "<line class=\"level\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>\n",
          X(begin), X(end - 1), Y(level), Y(level));
      begin = end;
    }
    for (const LevelChange& change : series.changes) {
      const double x = 0.5 * (X(change.at - 1) + X(change.at));
      svg += fmt::format(
          "<line class=\"step\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/>"
          "<text x=\"{3:.1f}\" y=\"{4}\">{5}</text>\n",
          x, kTop, bottom, x + 3, kTop + 12, RatioText(change));
    }
    for (std::size_t i = 0; i < series.values.size(); ++i) {
      const HistoryValue& one = series.values[i];
      if (one.upper > one.value) {
        svg += fmt::format(
            "<line class=\"spread\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\"/>",
            X(i), Y(one.value), Y(std::min(one.upper, high)));
      }
      svg += fmt::format(
          "<circle class=\"dot{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.6\"><title>{} {}: "
          "{:.6g}{}{}</title></circle>\n",
          one.is_steady ? "" : " other", X(i), Y(one.value),
          EscapeXml(ShortCommit(Entry(i).commit)), EscapeXml(Entry(i).date), one.value,
          EscapeXml(unit), one.is_steady ? "" : ", the machine had another speed");
    }
    return svg + "</svg>\n";
  }
};

/// The values of a series as a small line.
std::string Sparkline(const History& history, const HistorySeries& series) {
  constexpr double kLong = 120, kHigh = 22, kEdge = 3;
  const Chart chart(history, series);
  std::string path;
  double x = 0.0, y = 0.0;
  for (std::size_t i = 0; i < series.values.size(); ++i) {
    const double last = std::max<double>(1.0, static_cast<double>(series.values.size()) - 1.0);
    x = kEdge + (kLong - 2 * kEdge) * static_cast<double>(i) / last;
    y = kEdge +
        (kHigh - 2 * kEdge) * (1.0 - chart.Share(std::min(series.values[i].value, chart.high)));
    path += fmt::format("{}{:.1f} {:.1f}", i == 0 ? "M" : "L", x, y);
  }
  return fmt::format(
      "<svg class=\"spark\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
      "aria-hidden=\"true\">"
      "<path d=\"{2}\"/><circle class=\"dot\" cx=\"{3:.1f}\" cy=\"{4:.1f}\" r=\"2\"/></svg>",
      kLong, kHigh, path, x, y);
}

/// Begins a table with this heading.
template <class Names>
std::string BeginTable(const Names& names) {
  return "<div class=\"wide\"><table><thead><tr>" +
         Joined(names, "", [](const std::string& name) { return "<th>" + name + "</th>"; }) +
         "</tr></thead><tbody>\n";
}

constexpr const char* kEndTable = "</tbody></table></div>\n";

/// Rows of all series in this order, with their last value and their last step.
std::string SeriesRows(const History& history, const std::vector<const HistorySeries*>& order) {
  std::string text =
      BeginTable(std::array{"case", "measure", "machine", "values", "last", "last step"});
  for (const HistorySeries* one : order) {
    std::string step;
    if (!one->changes.empty()) {
      const LevelChange& change = one->changes.back();
      step = fmt::format("{} at {}", RatioText(change),
                         ShortCommit(history.entries[one->values[change.at].entry].commit));
    }
    text += fmt::format(
        "<tr class=\"series\"><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td "
        "class=\"n\">{:.4g}{}</td><td>{}</td></tr>\n",
        EscapeXml(one->one), EscapeXml(one->measure), EscapeXml(one->machine),
        Sparkline(history, *one), one->values.back().value,
        one->unit.empty() ? "" : " " + EscapeXml(one->unit), EscapeXml(step));
  }
  return text + kEndTable;
}

/// Rows of all steps, by commit.
std::string StepRows(const History& history, const HistoryFindings& found) {
  const Table table = StepTable(history, found);
  if (table.rows.empty()) {
    return "<p>No step found: every series keeps its level, every case its ending.</p>\n";
  }
  constexpr std::size_t kOfCommit = 2;  // the first columns
  const auto columns = table.columns | std::views::drop(kOfCommit);
  std::string text = BeginTable(Mapped<std::string>(columns, &TableColumn::header)), commit;
  for (const Record& row : table.rows) {
    if (const std::string own = row.Text("commit"); own != commit) {
      commit = own;
      text += fmt::format(
          "<tr class=\"commit\"><th colspan=\"{}\">{} <span class=\"soft\">{}</span></th></tr>\n",
          columns.size(), EscapeXml(commit), EscapeXml(row.Text("date")));
    }
    text += "<tr>";
    for (const TableColumn& column : columns) {
      const bool is_worse = column.key == "ratio" && row.Number("ratio") > 1.0;
      text += fmt::format("<td{}>{}</td>",
                          is_worse                            ? " class=\"n worse\""
                          : column.format == Format::kSeconds ? " class=\"n\""
                                                              : "",
                          EscapeXml(Cell(row, column)));
    }
    text += "</tr>\n";
  }
  return text + kEndTable;
}

}  // namespace

std::string HistoryPage(const History& history, const HistoryFindings& found,
                        const std::string& title, const std::vector<std::string>& provenance) {
  std::vector<const HistorySeries*> order;
  for (const HistorySeries& one : found.series) order.push_back(&one);
  std::ranges::stable_sort(order, [](const HistorySeries* a, const HistorySeries* b) {
    return !a->changes.empty() && b->changes.empty();
  });
  std::string page = PageHead(EscapeXml(title));
  page += kHistoryStyle;
  page += fmt::format(
      "</style>\n<script>{}</script>\n</head>\n<body>\n<header><h1>{}</h1><p class=\"soft\">{} "
      "entries, {} series, {} "
      "steps "
      "(other endings, and changes of level that noise would show {} times in "
      "all)</p></header>\n<main>\n"
      "<h2>Steps</h2>\n",
      kHistoryScript, EscapeXml(title), history.entries.size(), found.series.size(), found.Steps(),
      kFalseAlarms);
  page += StepRows(history, found);
  page +=
      "<h2>Series</h2>\n<p><input id=\"filter\" type=\"search\" aria-label=\"filter\" "
      "placeholder=\"words of case, measure, machine\"></p>\n";
  page += SeriesRows(history, order);
  page +=
      "<h2>Charts</h2>\n<p class=\"soft\">Dots: a commit each; of times the least, with a line up "
      "to the 90th percentile. "
      "Hollow dots: the machine had another speed than usual, so that they decide nothing. "
      "Lines: levels. Broken lines: steps, with the ratio of the levels.</p>\n";
  for (std::size_t i = 0; i < std::min(order.size(), kMaxCharts); ++i) {
    page += fmt::format(
        "<figure><figcaption>{}: {}</figcaption><p class=\"soft\">{}</p>\n{}</figure>\n",
        EscapeXml(order[i]->one), EscapeXml(order[i]->measure), EscapeXml(order[i]->machine),
        Chart(history, *order[i]).Text());
  }
  if (order.size() > kMaxCharts) {
    page +=
        fmt::format("<p>{} more series, without steps or after {} with them, are not drawn.</p>\n",
                    order.size() - kMaxCharts, kMaxCharts);
  }
  page +=
      "<h2>Commits</h2>\n" + BeginTable(std::array{"commit", "date", "machine", "mark", "note"});
  for (const HistoryEntry& entry : history.entries) {
    page += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                        EscapeXml(entry.commit), EscapeXml(entry.date), EscapeXml(entry.machine),
                        EscapeXml(entry.mark), EscapeXml(entry.note));
  }
  page += kEndTable;
  for (const std::string& line : provenance)
    page += "<p class=\"soft\">" + EscapeXml(line) + "</p>\n";
  return page + "</main>\n</body>\n</html>\n";
}

}  // namespace loopbench::harness
