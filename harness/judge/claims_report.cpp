#include "harness/judge/claims_report.h"

#include <fmt/format.h>

#include <cstdint>

#include "harness/text/escape.h"

namespace loopbench::harness {

namespace {

std::string VerdictColour(const Record& row, const TableColumn& column) {
  if (column.key != "verdict") return "";
  const std::string verdict = row.Text("verdict");
  if (verdict == ToString(Verdict::kReproduced)) return "32";
  return verdict == ToString(Verdict::kNotReproduced) ? "31" : "33";
}

}  // namespace

Table VerdictTable(std::span<const ClaimResult> results) {
  Table table;
  table.colour = &VerdictColour;
  table.columns = {{"id", "id"}, {"where", "paper"}, {"claim", "claim"}, {"verdict", "verdict"}};
  for (const auto& [rule, checks, verdict, text] : results) {
    AddRow({rule.id, rule.where, rule.claim, std::string(ToString(verdict))}, &table);
  }
  return table;
}

Table CheckTable(const ClaimResult& result) {
  Table table;
  table.columns = {{"condition", "condition"},         {"result", "result"},
                   {"measured", "measured"},           {"expected", "expected"},
                   {"rows", "rows", Format::kInteger}, {"reason", "remark"}};
  for (const auto& [label, state, rows, measured, expected, reason] : result.checks) {
    AddRow({label, std::string(ToString(state)), measured, expected,
            static_cast<std::int64_t>(rows), reason},
           &table);
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
