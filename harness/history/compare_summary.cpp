#include "harness/history/compare_summary.h"

#include <fmt/format.h>

#include <cmath>
#include <ranges>

#include "harness/judge/rules.h"
#include "harness/text/escape.h"
#include "harness/view/svg.h"

namespace loopbench::harness {
namespace {

bool IsFailure(const Finding& finding) {
  return finding.judgement == Judgement::kWorse || finding.judgement == Judgement::kDifferent;
}

/// Nobody is called by an "@name" in a comment.
std::string Quiet(const std::string& markdown) {
  std::string quiet;
  for (const char c : markdown) {
    quiet += c;
    if (c == '@') quiet += "&#8203;";  // a space without width
  }
  return quiet;
}

std::string Cell(const std::string& text) { return Quiet(EscapeMarkdown(text)); }

std::string Named(const Finding& finding) {
  const auto& [key, unit] = std::pair(finding.measure.key, finding.measure.heading.unit);
  return unit.empty() ? std::string(key) : fmt::format("{} [{}]", key, unit);
}

struct Missing {
  const std::vector<std::string>* cases;
  const char* why;
};

std::vector<Missing> MissingCases(const ComparisonReport& report, const CompareOptions& options) {
  std::vector<Missing> missing = {
      {&report.ambiguous, "there more than once, not compared"},
      {&report.other_content,
       "ran another mechanism, limits or ensemble under equal keys, not compared"}};
  if (!options.subset) missing.push_back({&report.only_base, "only in the base"});
  if (!options.added) missing.push_back({&report.only_fresh, "only in the new measurements"});
  return missing;
}

/// A list of cases, named as far as one looks at them.
std::string Listed(const std::string& what, const std::vector<std::string>& cases) {
  constexpr std::size_t kMostNamed = 20;
  if (cases.empty()) return "";
  std::string text = fmt::format("{} {}:\n\n", cases.size(), what);
  for (const std::string& one : cases | std::views::take(kMostNamed)) {
    text += "- " + Quiet(EscapeMarkdownParagraph(one)) + "\n";
  }
  if (cases.size() > kMostNamed) text += fmt::format("- {} more\n", cases.size() - kMostNamed);
  return text + "\n";
}

}  // namespace

std::string ComparisonMarkdown(const ComparisonReport& report, const std::string& conclusion,
                               const std::vector<std::string>& notes) {
  constexpr int kMostRows = 50;
  std::string text = "### Loopbench: " + EscapeMarkdown(conclusion) + "\n\n";
  std::string rows;
  int failures = 0;
  for (const Judgement judgement : {Judgement::kWorse, Judgement::kDifferent}) {
    for (const Finding& finding : report.findings) {
      if (finding.judgement != judgement || ++failures > kMostRows) continue;
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
  if (failures > kMostRows) text += fmt::format("and {} more\n\n", failures - kMostRows);
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

}  // namespace loopbench::harness
