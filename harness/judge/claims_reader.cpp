#include "harness/judge/claims_reader.h"

#include <optional>

#include "harness/config/selection_reader.h"
#include "harness/json/document_kind.h"

namespace loopbench::harness {
namespace {

/// Reads `key` where the comparison uses it and reports it where it has no meaning.
std::optional<JsonNode> Belonging(const JsonNode& check, const std::string& key, bool belongs,
                                  const std::string& expected) {
  if (belongs) return check.Required(key, expected);
  if (const std::optional<JsonNode> node = check.Optional(key)) {
    node->Fail("no \"" + key + "\" with this \"compare\"");
  }
  return std::nullopt;
}

const NameList kRelationNames = {"<=", ">=", "within", "is", "is-not"};
constexpr Relation kRelations[] = {Relation::kAtMost, Relation::kAtLeast, Relation::kWithin,
                                   Relation::kIs, Relation::kIsNot};

void ReadMeasure(const JsonNode& node, Check& check) { check.demand.measure = node.Text(); }

void ReadRelation(const JsonNode& node, Check& check) {
  check.demand.relation = kRelations[node.Choice(kRelationNames, "a comparison").value_or(0)];
}

/// What the comparison asks for, and what it and a ratio ask of the statistic.
void ReadDemand(const JsonNode& node, Check& check) {
  Demand& demand = check.demand;
  const bool words = demand.IsText(), within = demand.relation == Relation::kWithin;
  if (const auto threshold = Belonging(node, "threshold", !words, "a number")) {
    demand.number = threshold->Number();
  }
  if (const auto tolerance = Belonging(node, "tolerance", within, "a number >= 0")) {
    demand.tolerance = tolerance->Number(kNotNegative);
  }
  if (const auto word = Belonging(node, "word", words, kAnyText)) demand.word = word->Text();

  const bool quantified = check.statistic == Statistic::kAll || check.statistic == Statistic::kAny;
  const std::optional<JsonNode> statistic = node.Optional("statistic");
  if (statistic && words && !quantified) statistic->Fail("\"all\" or \"any\" for a word");
  if (statistic && !check.relative_to.empty() && quantified) {
    statistic->Fail("\"max\", \"min\" or \"mean\" for a ratio");
  }
}

constexpr const char* kDemandRules = R"({"allOf": [
  {"if": {"properties": {"compare": {"enum": ["is", "is-not"]}}},
   "then": {"required": ["word"], "not": {"required": ["threshold"]},
            "properties": {"statistic": {"enum": ["all", "any"]}}},
   "else": {"required": ["threshold"], "not": {"required": ["word"]}}},
  {"if": {"properties": {"compare": {"const": "within"}}},
   "then": {"required": ["tolerance"]}, "else": {"not": {"required": ["tolerance"]}}},
  {"if": {"required": ["relative_to"]},
   "then": {"properties": {"statistic": {"enum": ["max", "min", "mean"]}}}}]})";

const Fields<Check>& CheckFields() {
  static const Fields<Check> fields(
      "check", "A demand on a statistic of some records.",
      {{"label", Text(&Check::label), "The condition in words.", kAnyText},
       {"select", SelectionOf(&Check::select), "Which records.", "an object of keys and values"},
       {"relative_to", SelectionOf(&Check::relative_to, 1),
        "Records by whose statistic that of the selected ones is divided."},
       {"require", SelectionOf(&Check::require, 1),
        "What every selected record must also satisfy, or the check fails."},
       {"measure", By(TextSchema(), ReadMeasure), "A key of the records.", kAnyText},
       {"statistic", Choice(&Check::statistic, {"max", "min", "mean", "all", "any"}, "a statistic"),
        "Of the selected records.", "a statistic"},
       {"compare", By(ChoiceSchema(kRelationNames.all()), ReadRelation), "How.", "a comparison"},
       {"threshold", NumberSchema(), "Of <=, >= and within."},
       {"tolerance", NumberSchema(kNotNegative), "Of within: how far from the threshold."},
       {"word", TextSchema(), "Of is and is-not."},
       {"", By(Json::parse(kDemandRules), ReadDemand)},
       {"failed_runs", Choice(&Check::failed_runs_hold, {"fail", "hold"}, "what a failed run does"),
        "Hold: of a check that expects failure, a run that did not finish holds."}});
  return fields;
}

const Fields<Wording>& WordingFields() {
  static const Fields<Wording> fields(
      "wording", "What a verdict says instead of its own words.",
      {{"reproduced", Text(&Wording::reproduced), "All checks hold."},
       {"not_reproduced", Text(&Wording::not_reproduced), "None holds."},
       {"only_under", Text(&Wording::only_under), "Some hold."},
       {"not_measured", Text(&Wording::not_measured), "There are no records."}});
  return fields;
}

/// A rule and what it selects for all its checks.
struct RuleInFile : ClaimRule {
  Selection common;
};

void ReadChecks(const JsonNode& node, RuleInFile& rule) {
  std::vector<std::string> labels;
  for (const JsonNode& element : node.Elements("checks")) {
    Check& check = rule.checks.emplace_back();
    if (CheckFields().Read(element, &check)) {
      check.select.insert(check.select.begin(), rule.common.begin(), rule.common.end());
      Selection& base = check.relative_to;
      if (!base.empty()) base.insert(base.begin(), rule.common.begin(), rule.common.end());
    }
    ReportRepeated(element, "label", check.label, &labels);
  }
  if (node.value().is_array() && labels.empty()) node.Fail("at least one check");
}

const Fields<RuleInFile>& RuleFields() {
  static const Fields<RuleInFile> fields(
      "claim", "What is claimed, and the checks that decide about it.",
      {{"id", Text(&ClaimRule::id), "One that no other claim has.", kAnyText},
       {"claim", Text(&ClaimRule::claim), "What is claimed, in a sentence.", kAnyText},
       {"where", Text(&ClaimRule::where), "Where it is claimed.", kAnyText},
       {"note", Text(&ClaimRule::note), "Origin of the thresholds."},
       {"select", SelectionOf(&RuleInFile::common, 1), "Joins the selection of every check."},
       {"checks", By(ArraySchema(CheckFields().Schema(), 1), ReadChecks), "All must hold.",
        "an array of checks"},
       {"wording", Object(&ClaimRule::wording, WordingFields())}});
  return fields;
}

struct ClaimsFile {
  std::vector<ClaimRule> rules;
};

void ReadRules(const JsonNode& node, ClaimsFile& file) {
  std::vector<std::string> ids;
  for (const JsonNode& element : node.Elements("claims")) {
    RuleInFile rule;
    RuleFields().Read(element, &rule);
    ReportRepeated(element, "id", rule.id, &ids);
    file.rules.push_back(std::move(rule));
  }
}

const Fields<ClaimsFile>& ClaimsFields() {
  static const Fields<ClaimsFile> fields(
      "claims",
      "Rules that turn stored records into verdicts (loopbench verdict). The program checks more "
      "than this schema: that ids, and labels of one claim, are different.",
      DocumentRows<ClaimsFile>({{"claims", By(ArraySchema(RuleFields().Schema()), ReadRules),
                                 "One after the other.", "an array of claims"}}));
  return fields;
}

}  // namespace

Json ClaimsSchema() { return ClaimsFields().OwnSchema(); }

std::vector<ClaimRule> ReadClaims(const std::filesystem::path& path) {
  return ParseClaims(ReadTextFile(path), path.string());
}

std::vector<ClaimRule> ParseClaims(std::string_view text, const std::string& file) {
  const Json document = ParseDocument(text, file);
  ErrorList errors(file, text);
  const JsonNode root(document, "", errors);
  ClaimsFile claims;
  if (ExpectDocument(root, FileKind::kClaims)) ClaimsFields().ReadRows(root, &claims);
  errors.ThrowIfAny();
  return claims.rules;
}

}  // namespace loopbench::harness
