// Files of rules: claims, and robustness maps.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/base/fields.h"
#include "harness/base/text.h"
#include "harness/judge/judge.h"
#include "harness/judge/rule_schemas.h"

namespace loopbench::harness {
namespace {

constexpr const char* kAnyText = "a string that is not empty";

// Returns a scalar as the text of a Condition: 1e-6 becomes "1e-06", true becomes "true".
std::string ConditionValue(const JsonNode& node) {
  const Json& value = node.value();
  if (value.is_string()) return node.Text();
  if (value.is_boolean()) return value.get<bool>() ? "true" : "false";
  if (value.is_number_integer()) return value.dump();
  if (value.is_number()) return fmt::format("{}", value.get<double>());
  node.Fail("a string, a number, a bool or a list of them");
  return "";
}

/// {"key": value, "key": [value, ...]} with at least `least` keys (no key would select everything).
/// Strings, numbers and bools become the texts that a Condition compares with.
Selection ReadSelection(const JsonNode& node, std::size_t least = 0) {
  Selection selection;
  for (const auto& [key, member] : node.Members()) {
    Condition condition{key, {}};
    for (const JsonNode& value : member.OneOrMore("values")) {
      condition.values.push_back(ConditionValue(value));
    }
    selection.push_back(std::move(condition));
  }
  if (selection.size() < least && node.value().is_object()) node.Fail("at least one key");
  return selection;
}

Json SelectionSchema(std::size_t least = 0) {
  const Json other = {{"type", {"number", "boolean"}}, {"words", "a number, `true`, `false`"}};
  const Json value = Named("value", EitherSchema({TextSchema(), other}));
  return Named(least > 0 ? "someSelection" : "selection", MapSchema(OneOrMoreSchema(value), least));
}

template <class T>
FieldValue<T> SelectionOf(Selection T::*member, std::size_t least = 0) {
  return {SelectionSchema(least),
          [=](const JsonNode& node, T& owner) { owner.*member = ReadSelection(node, least); }};
}

/// Reads the objects of an array (JsonNode::Elements) into `list`. Their names, under `key`, must
/// be unique. `start` has the defaults.
template <class T, class Part>
void ReadNamed(const std::vector<JsonNode>& elements, const char* key, std::string T::*name,
               const Part& start, const Fields<Part>& fields, std::vector<T>* list) {
  std::vector<std::string> names;
  for (const JsonNode& element : elements) {
    Part part = start;
    fields.Read(element, &part);
    const std::optional<JsonNode> member = element.Optional(key);
    if (member && Contains(names, part.*name)) member->Fail("each name once");
    names.push_back(part.*name);
    list->push_back(std::move(part));
  }
}

template <class T>
T ParseRules(std::string_view text, const std::string& file, FileKind kind,
             const Fields<T>& fields) {
  return ReadDocument(text, file, [&](const JsonNode& root) {
    T rules;
    if (ExpectDocument(root, kind)) fields.ReadRows(root, &rules);
    return rules;
  });
}

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
       {"failed_runs",
        Choice(&Check::failed_runs_hold, {"fail", "hold"}, "the effect of a failed run"),
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
  ReadNamed(node.Elements("checks", "at least one check"), "label", &Check::label, Check(),
            CheckFields(), &rule.checks);
  for (Check& check : rule.checks) {
    check.select.insert(check.select.begin(), rule.common.begin(), rule.common.end());
    Selection& base = check.relative_to;
    if (!base.empty()) base.insert(base.begin(), rule.common.begin(), rule.common.end());
  }
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
  ReadNamed(node.Elements("claims", "at least one claim"), "id", &ClaimRule::id, RuleInFile(),
            RuleFields(), &file.rules);
}

const Fields<ClaimsFile>& ClaimsFields() {
  static const Fields<ClaimsFile> fields(
      "claims",
      "Rules that turn stored records into verdicts (loopbench check-claims). The program also "
      "checks that ids, and labels of one claim, are different.",
      DocumentRows<ClaimsFile>({{"claims", By(ArraySchema(RuleFields().Schema(), 1), ReadRules),
                                 "List of claims.", "an array of claims"}}));
  return fields;
}

const NameList& EndingNames() {
  static const NameList names = [] {
    NameList list;
    for (const RunEnding& ending : kRunEndings) list.Add(std::string(ending.word));
    return list;
  }();
  return names;
}

std::vector<std::string> ReadEndings(const JsonNode& node) {
  std::vector<std::string> endings;
  for (const JsonNode& element : node.OneOrMore("endings")) {
    const auto index = element.Choice(EndingNames(), "an ending of runs");
    if (index) endings.push_back(EndingNames().all()[*index]);
  }
  return endings;
}

Json EndingsSchema() {
  return Named("endings", OneOrMoreSchema(ChoiceSchema(EndingNames().all())));
}

/// Demand with the expected outcomes of its row.
struct DemandOfRow : Demand {
  const std::vector<std::string>* right = nullptr;
};

void ReadNumber(const JsonNode& node, DemandOfRow& demand) {
  constexpr std::pair<const char*, Relation> kNumbers[] = {
      {"limit", Relation::kAtMost}, {"at_least", Relation::kAtLeast}, {"equal", Relation::kEqual}};
  int found = 0;
  for (const auto& [key, relation] : kNumbers) {
    const auto number = node.Optional(key);
    if (!number) continue;
    if (++found > 1) number->Fail("one of \"limit\", \"at_least\" and \"equal\"");
    demand.relation = relation;
    // ratios to a limit of 0 are meaningless; "equal" allows 0
    demand.number = number->Number(relation == Relation::kEqual ? Range{} : kPositive);
  }
  if (found == 0 && node.value().is_object()) {
    node.FailAs("no number", "one of \"limit\", \"at_least\" and \"equal\"");
  }
}

void ReadWhen(const JsonNode& node, DemandOfRow& demand) { demand.when = ReadEndings(node); }

void CheckWhen(const JsonNode& node, DemandOfRow& demand) {
  const std::vector<std::string>& right = *demand.right;
  const bool possible = std::ranges::all_of(
      demand.when, [&right](const std::string& ending) { return Contains(right, ending); });
  if (possible) return;
  constexpr const char* kExpected = "endings that are \"expected_outcome\" here";
  if (const auto when = node.Optional("when")) {
    when->Fail(kExpected);
  } else {
    node.FailAs("no \"when\", which means finished", kExpected);
  }
}

const Fields<DemandOfRow>& DemandFields() {
  static const Json one_number = {
      {"oneOf", {Requires({"limit"}), Requires({"at_least"}), Requires({"equal"})}}};
  static const Fields<DemandOfRow> fields(
      "demand", "A measure and its limit.",
      {{"measure", Text(&Demand::measure), "Key of the records.", kAnyText},
       {"limit", NumberSchema(kPositive), "Largest allowed value."},
       {"at_least", NumberSchema(kPositive), "Smallest allowed value."},
       {"equal", NumberSchema(), "Required value."},
       {"relative_to", Text(&Demand::of), "Key of the record whose value multiplies the number."},
       {"when", By(EndingsSchema(), ReadWhen),
        "Outcomes of runs to which it applies; default: finished."},
       {"name", Text(&Demand::name), "Short name for cells."},
       {"unit", Text(&Demand::unit), "Unit of the measure, for cells."},
       {"", By(Json::object(), CheckWhen)},
       {"", By(one_number, ReadNumber)}});
  return fields;
}

std::vector<Demand> ReadDemands(const JsonNode& node, const std::vector<std::string>& right) {
  std::vector<Demand> demands;
  for (const JsonNode& element : node.Elements("measures")) {
    DemandOfRow demand;
    demand.right = &right;
    DemandFields().Read(element, &demand);
    demands.push_back(demand);
  }
  return demands;
}

/// Row, or common values of a group's rows, with the labels of columns.
struct RowOfMap : MapRow {
  const NameList* columns = nullptr;
};
struct GroupOfMap : MapGroup {
  RowOfMap common;
};

void ReadNotApplicable(const JsonNode& reasons, RowOfMap* row) {
  if (reasons.value().is_string()) {
    row->others_not_applicable = reasons.Text();
    return;
  }
  if (!reasons.ExpectObject(*row->columns)) return;
  for (const auto& [column, reason] : reasons.Members()) {
    row->not_applicable[column] = reason.Text();
    const auto index = row->columns->Find(column);  // overrides the group's "required"
    if (index) row->must_hold[*index] = false;
  }
}

void ReadMustHold(const JsonNode& demanded, RowOfMap* row) {
  const std::vector<std::string>& columns = row->columns->all();
  row->must_hold.assign(columns.size(), false);
  if (demanded.value() == "all") {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      row->must_hold[c] = !row->not_applicable.contains(columns[c]);
    }
    return;
  }
  const bool is_list = demanded.value().is_array();
  for (const JsonNode& element :
       is_list ? demanded.Elements("column labels") : std::vector<JsonNode>{demanded}) {
    const auto column = element.Choice(*row->columns, "\"all\" or a method");
    if (!column) continue;
    row->must_hold[*column] = true;
    if (row->not_applicable.contains(columns[*column])) {
      element.Fail("a column that is applicable here");
    }
  }
}

constexpr std::int64_t kMaxMapCases = 1'000'000;

/// Reads the common keys of groups and rows; `row` contains the group's values. Some keys depend on
/// others, so the order is fixed.
void ReadShared(const JsonNode& node, RowOfMap* row) {
  if (const auto select = node.Optional("select")) {
    const Selection own = ReadSelection(*select, 1);
    row->select.insert(row->select.end(), own.begin(), own.end());
  }
  if (const auto right = node.Optional("expected_outcome")) row->right = ReadEndings(*right);
  if (const auto decides = node.Optional("criteria")) {
    row->decides = ReadDemands(*decides, row->right);
  }
  if (const auto cases = node.Optional("cases")) {
    row->cases = static_cast<std::size_t>(cases->Integer(1, kMaxMapCases));
  }
  if (const auto why = node.Optional("rationale")) row->why = why->Text();
  // without columns, every reference to a column would be a consequential error
  if (row->columns->all().empty()) return;
  if (const auto reasons = node.Optional("not_applicable")) ReadNotApplicable(*reasons, row);
  if (const auto demanded = node.Optional("required")) ReadMustHold(*demanded, row);
}

/// Returns `rows` followed by the rows of ReadShared().
template <class T>
std::vector<Field<T>> WithShared(std::vector<Field<T>> rows) {
  const Json text = TextSchema();
  const std::vector<Field<T>> shared = {
      {"select", SelectionSchema(1), "Selection of records, added to the group's and method's."},
      {"criteria", ArraySchema(DemandFields().Schema()), "Criteria that must all be met."},
      {"expected_outcome", EndingsSchema(), "Expected outcomes of a run; default: finished."},
      {"required", EitherSchema({text, ArraySchema(text)}),
       "\"all\" or labels of methods that must pass, for --fail-on required."},
      {"not_applicable", EitherSchema({text, MapSchema(text)}),
       "Reason for missing records, by method label, or one reason for all methods not required."},
      {"cases", IntegerSchema(1, kMaxMapCases), "Expected number of records; default: 1."},
      {"rationale", text, "Origin of the limits."}};
  rows.insert(rows.end(), shared.begin(), shared.end());
  return rows;
}

void ReadRow(const JsonNode& node, RowOfMap& row) {
  ReadShared(node, &row);
  if (row.select.empty() && !node.Optional("select")) {
    node.FailAs("no \"select\"", "an object of keys and values, here or in the group");
  }
  const auto decided = [&row](const std::string& ending) {
    return std::ranges::any_of(
        row.decides, [&ending](const Demand& demand) { return Contains(demand.when, ending); });
  };
  if (Contains(row.right, "finished") && !decided("finished")) {
    node.FailAs("nothing that decides about a finished run",
                "\"criteria\" with a measure, here or in the group");
  }
}

const Fields<RowOfMap>& RowFields() {
  static const Fields<RowOfMap> fields(
      "row", "A stress test and its criteria.",
      WithShared<RowOfMap>({{"label", Text(&MapRow::label), "Name of the row.", kAnyText},
                            {"", By(Json::object(), ReadRow)}}));
  return fields;
}

void ReadCommon(const JsonNode& node, GroupOfMap& group) {
  group.common.must_hold.assign(group.common.columns->all().size(), false);
  ReadShared(node, &group.common);
}

void ReadMapRows(const JsonNode& node, GroupOfMap& group) {
  ReadNamed(node.Elements("rows", "at least one row"), "label", &MapRow::label, group.common,
            RowFields(), &group.rows);
}

const Fields<GroupOfMap>& MapGroupFields() {
  static const Fields<GroupOfMap> fields(
      "group",
      "Group of rows. Its select and not_applicable are added to each row's; its other keys are "
      "defaults for the rows.",
      WithShared<GroupOfMap>(
          {{"", By(Json::object(), ReadCommon)},
           {"label", Text(&MapGroup::label), "Name of the group.", kAnyText},
           {"short", Text(&MapGroup::short_label), "Short name for pictures; default: the label."},
           {"rows", By(ArraySchema(RowFields().Schema(), 1), ReadMapRows), "Rows of stress tests.",
            "an array of rows"}}));
  return fields;
}

const Fields<MapMethod>& MethodFields() {
  static const Fields<MapMethod> fields(
      "map-method", "Method: a column of the map.",
      {{"label", Text(&MapMethod::label), "Method name.", kAnyText},
       {"select", SelectionOf(&MapMethod::select, 1), "Selection of records.",
        "an object of keys and values"}});
  return fields;
}

void ReadMapColumns(const JsonNode& node, MapRules& rules) {
  ReadNamed(node.Elements("methods", "at least one method"), "label", &MapMethod::label,
            MapMethod(), MethodFields(), &rules.columns);
}

void ReadMapGroups(const JsonNode& node, MapRules& rules) {
  NameList columns;
  for (const MapMethod& column : rules.columns) columns.Add(column.label);
  GroupOfMap start;
  start.common.columns = &columns;
  ReadNamed(node.Elements("groups", "at least one group"), "label", &MapGroup::label, start,
            MapGroupFields(), &rules.groups);
}

const Fields<MapRules>& MapFields() {
  static const Fields<MapRules> fields(
      "map",
      "Rules that compare stored records with limits, one cell per row and column (loopbench "
      "robustness). The program also checks that labels are different, that \"required\" and "
      "\"not_applicable\" name methods, and that each row, with its group, selects records and "
      "has a criterion for finished runs if it expects them.",
      DocumentRows<MapRules>(
          {{"title", Text(&MapRules::title), "Title of the map.", kAnyText},
           {"comment", Text(&MapRules::comment), "Free text for readers."},
           {"methods", By(ArraySchema(MethodFields().Schema(), 1), ReadMapColumns),
            "Methods, the columns of the map.", "an array of methods"},
           {"groups", By(ArraySchema(MapGroupFields().Schema(), 1), ReadMapGroups),
            "Groups of rows.", "an array of groups of rows"}}));
  return fields;
}

}  // namespace

Json ClaimsSchema() { return ClaimsFields().OwnSchema(); }

std::vector<ClaimRule> ReadClaims(const std::filesystem::path& path) {
  return ParseClaims(ReadTextFile(path), path.string());
}

std::vector<ClaimRule> ParseClaims(std::string_view text, const std::string& file) {
  return ParseRules(text, file, FileKind::kClaims, ClaimsFields()).rules;
}

Json MapSchema() { return MapFields().OwnSchema(); }

MapRules ReadMapRules(const std::filesystem::path& path) {
  return ParseMapRules(ReadTextFile(path), path.string());
}

MapRules ParseMapRules(std::string_view text, const std::string& file) {
  return ParseRules(text, file, FileKind::kMap, MapFields());
}

}  // namespace loopbench::harness
