#include "harness/judge/claims_report.h"

#include <fmt/format.h>

#include <cstdint>

#include "harness/text/escape.h"

namespace loopbench::harness {

Table VerdictTable(std::span<const ClaimResult> results) {
  Table table;
  table.columns = {{"id", "id", Format::kText, {}},
                   {"where", "paper", Format::kText, {}},
                   {"claim", "claim", Format::kText, {}},
                   {"verdict", "verdict", Format::kText, {}}};
  for (const ClaimResult& result : results) {
    Record row;
    row.Set("id", result.rule.id);
    row.Set("where", result.rule.where);
    row.Set("claim", result.rule.claim);
    row.Set("verdict", std::string(ToString(result.verdict)));
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table CheckTable(const ClaimResult& result) {
  Table table;
  table.columns = {
      {"condition", "condition", Format::kText, {}}, {"result", "result", Format::kText, {}},
      {"measured", "measured", Format::kText, {}},   {"expected", "expected", Format::kText, {}},
      {"rows", "rows", Format::kInteger, {}},        {"reason", "remark", Format::kText, {}}};
  for (const CheckResult& check : result.checks) {
    Record row;
    row.Set("condition", check.label);
    row.Set("result", std::string(ToString(check.state)));
    row.Set("measured", check.measured);
    row.Set("expected", check.expected);
    row.Set("rows", static_cast<std::int64_t>(check.rows));
    row.Set("reason", check.reason);
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string ClaimsMarkdown(std::span<const ClaimResult> results,
                           const std::vector<std::string>& notes) {
  std::string out = fmt::format("# Verdicts\n\n{}", ToMarkdown(VerdictTable(results)));
  for (const ClaimResult& result : results) {
    out += fmt::format("\n## {}\n\n{} (paper, {})\n\n**Verdict: {}**\n",
                       EscapeMarkdown(result.rule.id), EscapeMarkdownParagraph(result.rule.claim),
                       EscapeMarkdown(result.rule.where), EscapeMarkdown(result.text));
    if (!result.rule.note.empty()) {
      out += fmt::format("\n{}\n", EscapeMarkdownParagraph(result.rule.note));
    }
    out += fmt::format("\n{}", ToMarkdown(CheckTable(result)));
  }
  for (const std::string& note : notes) out += "\n\n" + EscapeMarkdownParagraph(note);
  return out + (notes.empty() ? "" : "\n");
}

}  // namespace loopbench::harness
