#include "harness/judge/claims.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "harness/config/selection_reader.h"
#include "harness/json/fields.h"
#include "harness/judge/demand.h"
#include "harness/judge/rule_schemas.h"
#include "harness/record/noise.h"
#include "harness/tables/table.h"
#include "harness/text/escape.h"

namespace loopbench::harness {
namespace {

constexpr std::string_view kStatistics[] = {"max", "min", "mean", "every", "any"};

bool IsQuantified(const Check& check) {
  return check.statistic == Statistic::kAll || check.statistic == Statistic::kAny;
}

// Rows of one selection, counted by usability.
struct Sample {
  std::vector<Record> rows;
  std::vector<double> values;  // finite measures of usable runs
  std::size_t failed = 0, unmet = 0, missing = 0;
};

Sample Take(const Check& check, const Selection& selection, std::span<const Record> records) {
  const std::string& measure = check.demand.measure;
  // if the outcome is checked, a failed run is a valid observation
  const bool examines_outcome =
      measure == "outcome" ||
      std::ranges::find(check.select, "outcome", &Condition::key) != check.select.end();
  Sample sample;
  std::vector<const Record*> selected;
  std::set<std::string> kinds;  // kinds of records with the measure
  for (const Record& record : records) {
    if (!Matches(record, selection)) continue;
    selected.push_back(&record);
    if (record.Find(measure) != nullptr) kinds.insert(record.Text("kind"));
  }
  for (const Record* one : selected) {
    const Record& record = *one;
    const bool failed = HasFailed(record) && !examines_outcome;
    if (!kinds.contains(record.Text("kind")) && !failed) continue;
    sample.rows.push_back(record);
    const double value = record.Number(measure);
    if (failed) {
      ++sample.failed;
    } else if (!Matches(record, check.require)) {
      ++sample.unmet;
    } else if (check.demand.IsText() ? record.Text(measure).empty() : !std::isfinite(value)) {
      ++sample.missing;
    }
    if (!failed && std::isfinite(value)) sample.values.push_back(value);
  }
  return sample;
}

// Returns "2 of 3 runs failed", or "" if all rows of the sample are usable.
std::string Defect(const Check& check, const Sample& sample) {
  const std::size_t rows = sample.rows.size();
  if (sample.failed > 0 && !check.failed_runs_hold) {
    return fmt::format("{} of {} runs did not finish", sample.failed, rows);
  }
  if (sample.unmet > 0) {
    return fmt::format("{} of {} rows without {}", sample.unmet, rows, ToText(check.require));
  }
  return "";
}

// Returns "1 of 2 values missing or not finite", or "". Incomplete samples decide nothing.
std::string NumbersMissing(const Sample& sample) {
  if (sample.missing == 0) return "";
  return fmt::format("{} of {} values missing or not finite", sample.missing, sample.rows.size());
}

double Apply(Statistic statistic, const std::vector<double>& values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  if (statistic == Statistic::kMax) return std::ranges::max(values);
  if (statistic == Statistic::kMin) return std::ranges::min(values);
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Returns true if all values, or any value, meet the demand.
template <typename Value>
bool Quantify(const Check& check, const std::vector<Value>& values) {
  const auto meets = [&check](const Value& value) { return Meets(check.demand, value); };
  return check.statistic == Statistic::kAny ? std::ranges::any_of(values, meets)
                                            : std::ranges::all_of(values, meets);
}

// HoldsOf...(): return true if the demand is met, with the numbers in `measured`.
bool HoldsOfTexts(const Check& check, const Sample& sample, std::string* measured) {
  std::vector<std::string> words;
  std::map<std::string, int> counts;
  for (const Record& row : sample.rows) words.push_back(row.Text(check.demand.measure));
  for (const std::string& word : words) ++counts[word];
  for (const auto& [word, count] : counts) {
    *measured += fmt::format("{}{} ({})", measured->empty() ? "" : ", ", word, count);
  }
  return Quantify(check, words);
}

bool HoldsOfNumbers(const Check& check, const Sample& sample, std::string* measured) {
  // if all runs failed in a check that expects failure, it holds without a number
  bool holds = true;
  *measured = "no number";
  if (!sample.values.empty()) {
    const auto [low, high] = std::ranges::minmax(sample.values);
    const double value = Apply(check.statistic, sample.values);
    const bool quantified = IsQuantified(check);
    *measured = quantified ? fmt::format("{:.3g} .. {:.3g}", low, high)
                           : fmt::format("{:.3g} ({:.3g} .. {:.3g})", value, low, high);
    holds = quantified ? Quantify(check, sample.values) : Meets(check.demand, value);
  }
  if (sample.failed > 0) {
    *measured += fmt::format(", {} of {} did not finish", sample.failed, sample.rows.size());
  }
  return holds;
}

/// Returns the ratio of machine speeds between these rows; 1 if the measure is not a time.
double OtherSpeed(const Check& check, const Sample& above, const Sample& below) {
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (const Sample* sample : {&above, &below}) {
    for (const Record& row : sample->rows) {
      const double calibration = CalibrationOf(row, check.demand.measure);
      if (!(calibration > 0.0)) continue;
      least = std::min(least, calibration);
      most = std::max(most, calibration);
    }
  }
  return most > kOtherSpeed * least ? most / least : 1.0;
}

bool HoldsOfRatio(const Check& check, const Sample& above, const Sample& below,
                  std::string* measured, std::string* uncertain) {
  const double numerator = Apply(check.statistic, above.values);
  const double denominator = Apply(check.statistic, below.values);
  const double ratio = numerator / denominator;
  *measured = fmt::format("{:.3g} ({:.3g} / {:.3g})", ratio, numerator, denominator);
  const double speed = OtherSpeed(check, above, below);
  const bool holds = Meets(check.demand, ratio);
  if (Meets(check.demand, ratio * speed) != holds || Meets(check.demand, ratio / speed) != holds) {
    *uncertain = fmt::format(
        "the machine's speed changed by a factor of {:.3g} in between (calibration_ns): time again "
        "with run --timing-only --rerun all",
        speed);
  }
  return holds;
}

}  // namespace

CheckResult Evaluate(const Check& check, std::span<const Record> records) {
  const bool is_ratio = !check.relative_to.empty();
  const Sample sample = Take(check, check.select, records);
  const Sample base = is_ratio ? Take(check, check.relative_to, records) : Sample{};
  CheckResult result;
  result.label = check.label;
  result.rows = sample.rows.size() + base.rows.size();
  const auto statistic = kStatistics[static_cast<std::size_t>(check.statistic)];
  result.expected = ToText(
      check.demand,
      fmt::format("{}{} {}", is_ratio ? "ratio of " : "", statistic, check.demand.measure), true);
  if (sample.rows.empty() || (is_ratio && base.rows.empty())) {
    result.reason =
        "no record of " + ToText(sample.rows.empty() ? check.select : check.relative_to);
    return result;
  }
  std::string uncertain;
  const bool holds = is_ratio ? HoldsOfRatio(check, sample, base, &result.measured, &uncertain)
                     : check.demand.IsText() ? HoldsOfTexts(check, sample, &result.measured)
                                             : HoldsOfNumbers(check, sample, &result.measured);
  const std::string defect = Defect(check, sample);
  result.reason = defect.empty() ? Defect(check, base) : defect;
  result.state = holds && result.reason.empty() ? CheckState::kHolds : CheckState::kFails;
  for (const Sample* one : {&sample, &base}) {
    if (uncertain.empty()) uncertain = NumbersMissing(*one);
  }
  if (result.reason.empty() && !uncertain.empty()) {
    result.reason = uncertain;
    result.state = CheckState::kNotMeasured;
  }
  return result;
}
namespace {

/// Reads `key` if the comparison uses it, otherwise reports it.
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

/// Reads the keys of the comparison and checks the statistic.
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
      "check", "Condition on a statistic of selected records.",
      {{"label", Text(&Check::label), "Condition in words.", kAnyText},
       {"select", SelectionOf(&Check::select), "Selected records.", "an object of keys and values"},
       {"relative_to", SelectionOf(&Check::relative_to, 1),
        "Records whose statistic divides the statistic of the selected records."},
       {"require", SelectionOf(&Check::require, 1),
        "Conditions on every selected record; otherwise the check fails."},
       {"measure", By(TextSchema(), ReadMeasure), "Key of the records.", kAnyText},
       {"statistic", Choice(&Check::statistic, {"max", "min", "mean", "all", "any"}, "a statistic"),
        "Statistic over the selected records.", "a statistic"},
       {"compare", By(ChoiceSchema(kRelationNames.all()), ReadRelation), "Relation.",
        "a comparison"},
       {"threshold", NumberSchema(), "Threshold of <=, >= and within."},
       {"tolerance", NumberSchema(kNotNegative), "Tolerance of within, around the threshold."},
       {"word", TextSchema(), "Word of is and is-not."},
       {"", By(Json::parse(kDemandRules), ReadDemand)},
       {"failed_runs", Choice(&Check::failed_runs_hold, {"fail", "hold"}, "what a failed run does"),
        "hold: runs that did not finish satisfy a check that expects failure."}});
  return fields;
}

const Fields<Wording>& WordingFields() {
  static const Fields<Wording> fields(
      "wording", "Sentences that are printed after the verdict.",
      {{"reproduced", Text(&Wording::reproduced), "Sentence if all checks hold."},
       {"not_reproduced", Text(&Wording::not_reproduced), "Sentence if no check holds."},
       {"partially_reproduced", Text(&Wording::only_under), "Sentence if some checks hold."},
       {"not_measured", Text(&Wording::not_measured), "Sentence if no check was measured."}});
  return fields;
}

/// Rule with the common selection of its checks.
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
      "claim", "A claim and its checks, which must all hold.",
      {{"id", Text(&ClaimRule::id), "Unique identifier of the claim.", kAnyText},
       {"claim", Text(&ClaimRule::claim), "The claim in one sentence.", kAnyText},
       {"where", Text(&ClaimRule::where), "Section or figure that makes the claim.", kAnyText},
       {"note", Text(&ClaimRule::note), "Origin of the thresholds."},
       {"select", SelectionOf(&RuleInFile::common, 1), "Selection that is added to every check."},
       {"checks", By(ArraySchema(CheckFields().Schema(), 1), ReadChecks), "Checks.",
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
      "Rules that turn stored records into verdicts (loopbench check-claims). The program also "
      "checks that ids, and labels of one claim, are different.",
      DocumentRows<ClaimsFile>({{"claims", By(ArraySchema(RuleFields().Schema()), ReadRules),
                                 "List of claims.", "an array of claims"}}));
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
    AddRow({rule.id, rule.where, rule.claim, verdict}, &table);
  }
  return table;
}

Table CheckTable(const ClaimResult& result) {
  Table table;
  table.columns = {{"condition", "condition"},         {"result", "result"},
                   {"measured", "measured"},           {"expected", "expected"},
                   {"rows", "rows", Format::kInteger}, {"reason", "remark"}};
  for (const auto& [label, state, rows, measured, expected, reason] : result.checks) {
    AddRow({label, state, measured, expected, rows, reason}, &table);
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

// Verdict on a claim, from the states of its checks.

namespace {

std::string Labels(const std::vector<CheckResult>& checks, CheckState state) {
  std::string labels;
  for (const CheckResult& check : checks) {
    if (check.state == state) labels += (labels.empty() ? "" : "; ") + check.label;
  }
  return labels;
}

}  // namespace

ClaimResult Evaluate(const ClaimRule& rule, std::span<const Record> records) {
  ClaimResult result;
  result.rule = rule;
  for (const Check& check : rule.checks) result.checks.push_back(Evaluate(check, records));
  const std::string holds = Labels(result.checks, CheckState::kHolds);
  const std::string fails = Labels(result.checks, CheckState::kFails);
  const std::string missing = Labels(result.checks, CheckState::kNotMeasured);

  if (holds.empty()) {
    result.verdict = fails.empty() ? Verdict::kNotMeasured : Verdict::kNotReproduced;
  } else {
    result.verdict = fails.empty() && missing.empty() ? Verdict::kReproduced : Verdict::kOnlyUnder;
  }
  result.text = ToString(result.verdict);
  if (result.verdict == Verdict::kOnlyUnder) {
    result.text += ": " + holds;
    if (!fails.empty()) result.text += ". Not under: " + fails;
  }
  if (result.verdict != Verdict::kNotMeasured && !missing.empty()) {
    result.text += ". Not measured: " + missing;
  }
  const auto& [reproduced, not_reproduced, only_under, not_measured] = rule.wording;
  const std::string* const sentences[] = {&reproduced, &not_reproduced, &only_under, &not_measured};
  const std::string& sentence = *sentences[static_cast<std::size_t>(result.verdict)];
  if (!sentence.empty()) result.text += ". " + sentence;
  return result;
}

std::string_view ToString(Verdict verdict) {
  constexpr std::string_view kWords[] = {"reproduced", "not reproduced", "partially reproduced",
                                         "not measured"};
  return kWords[static_cast<std::size_t>(verdict)];
}

std::string_view ToString(CheckState state) {
  constexpr std::string_view kWords[] = {"holds", "fails", "not measured"};
  return kWords[static_cast<std::size_t>(state)];
}

}  // namespace loopbench::harness
