#include "harness/judge/claims_reader.h"

#include <optional>

#include "harness/config/selection_reader.h"
#include "harness/json/document_kind.h"

namespace loopbench::harness {
namespace {

// The index of a required word; the first one after an error, which refuses the file anyway.
int RequiredChoice(const JsonNode& owner, const std::string& key,
                   const std::vector<std::string>& known, const std::string& what) {
  const std::optional<JsonNode> node = owner.Required(key, what);
  return node ? node->Choice(known, what).value_or(0) : 0;
}

// Reads `key` where the comparison uses it and reports it where it has no meaning.
std::optional<JsonNode> Belonging(const JsonNode& check, const std::string& key, bool belongs,
                                  const std::string& expected) {
  if (belongs) return check.Required(key, expected);
  if (const std::optional<JsonNode> node = check.Optional(key)) {
    node->Fail("no \"" + key + "\" with this \"compare\"");
  }
  return std::nullopt;
}

void ReadDemand(const JsonNode& node, Check* check) {
  constexpr Relation kRelations[] = {Relation::kAtMost, Relation::kAtLeast, Relation::kWithin,
                                     Relation::kIs, Relation::kIsNot};
  Demand& demand = check->demand;
  check->statistic = static_cast<Statistic>(
      RequiredChoice(node, "statistic", {"max", "min", "mean", "all", "any"}, "a statistic"));
  demand.relation = kRelations[RequiredChoice(
      node, "compare", {"<=", ">=", "within", "is", "is-not"}, "a comparison")];
  const bool words = demand.IsText(), within = demand.relation == Relation::kWithin;
  if (const auto threshold = Belonging(node, "threshold", !words, "a number")) {
    demand.number = threshold->Number();
  }
  if (const auto tolerance = Belonging(node, "tolerance", within, "a number >= 0")) {
    demand.tolerance = tolerance->Number(kNotNegative);
  }
  if (const auto word = Belonging(node, "word", words, kAnyText)) demand.word = word->Text();

  const bool quantified =
      check->statistic == Statistic::kAll || check->statistic == Statistic::kAny;
  const std::optional<JsonNode> statistic = node.Optional("statistic");
  if (statistic && words && !quantified) statistic->Fail("\"all\" or \"any\" for a word");
  if (statistic && !check->relative_to.empty() && quantified) {
    statistic->Fail("\"max\", \"min\" or \"mean\" for a ratio");
  }
}

// `common` is what the rule selects for all its checks.
Check ReadCheck(const JsonNode& node, const Selection& common) {
  Check check;
  if (!node.ExpectObject({"label", "select", "relative_to", "require", "measure", "statistic",
                          "compare", "threshold", "tolerance", "word", "failed_runs"})) {
    return check;
  }
  check.label = RequiredText(node, "label");
  check.demand.measure = RequiredText(node, "measure");
  if (const auto select = node.Required("select", "an object of keys and values")) {
    check.select = ReadSelection(*select);
  }
  check.relative_to = OptionalSelection(node, "relative_to");
  check.require = OptionalSelection(node, "require");
  check.select.insert(check.select.begin(), common.begin(), common.end());
  if (!check.relative_to.empty()) {
    check.relative_to.insert(check.relative_to.begin(), common.begin(), common.end());
  }
  ReadDemand(node, &check);
  if (node.Optional("failed_runs")) {
    check.failed_runs_hold =
        RequiredChoice(node, "failed_runs", {"fail", "hold"}, "what a failed run does") == 1;
  }
  return check;
}

Wording ReadWording(const JsonNode& node) {
  Wording wording;
  if (!node.ExpectObject({"reproduced", "not_reproduced", "only_under", "not_measured"})) {
    return wording;
  }
  wording.reproduced = OptionalText(node, "reproduced");
  wording.not_reproduced = OptionalText(node, "not_reproduced");
  wording.only_under = OptionalText(node, "only_under");
  wording.not_measured = OptionalText(node, "not_measured");
  return wording;
}

ClaimRule ReadRule(const JsonNode& node) {
  ClaimRule rule;
  if (!node.ExpectObject({"id", "claim", "where", "note", "select", "checks", "wording"}))
    return rule;
  rule.id = RequiredText(node, "id");
  rule.claim = RequiredText(node, "claim");
  rule.where = RequiredText(node, "where");
  rule.note = OptionalText(node, "note");
  const Selection common = OptionalSelection(node, "select");
  if (const auto checks = node.Required("checks", "an array of checks")) {
    std::vector<std::string> labels;
    for (const JsonNode& check : checks->Elements("checks")) {
      rule.checks.push_back(ReadCheck(check, common));
      ReportRepeated(check, "label", rule.checks.back().label, &labels);
    }
    if (checks->value().is_array() && labels.empty()) checks->Fail("at least one check");
  }
  if (const auto wording = node.Optional("wording")) rule.wording = ReadWording(*wording);
  return rule;
}

}  // namespace

std::vector<ClaimRule> ReadClaims(const std::filesystem::path& path) {
  return ParseClaims(ReadTextFile(path), path.string());
}

std::vector<ClaimRule> ParseClaims(std::string_view text, const std::string& file) {
  const Json document = ParseDocument(text, file);
  ErrorList errors(file, text);
  const JsonNode root(document, "", errors);
  std::vector<ClaimRule> rules;
  std::vector<std::string> ids;
  if (ExpectDocument(root, FileKind::kClaims)) {
    if (const auto claims = root.Required("claims", "an array of claims")) {
      for (const JsonNode& claim : claims->Elements("claims")) {
        rules.push_back(ReadRule(claim));
        ReportRepeated(claim, "id", rules.back().id, &ids);
      }
    }
  }
  errors.ThrowIfAny();
  return rules;
}

}  // namespace loopbench::harness
