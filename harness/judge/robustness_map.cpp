#include "harness/judge/robustness_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <tuple>
#include <utility>

#include "harness/analysis/warnings.h"
#include "harness/config/selection_reader.h"
#include "harness/json/fields.h"
#include "harness/judge/rule_schemas.h"
#include "harness/tables/columns.h"
#include "harness/text/words.h"

namespace loopbench::harness {
namespace {

constexpr const char* kFinishedWord = "finished";

bool Names(const std::vector<std::string>& words, const std::string& word) {
  return std::ranges::find(words, word) != words.end();
}

CellState StateOfEnding(const std::string& outcome) {
  const auto known = std::ranges::find(kRunEndings, outcome, &RunEnding::word);
  return known == kRunEndings.end() ? CellState::kBroken : known->state;
}

// Returns the rank of a run; the greatest decides a cell. Stopped runs are ranked by time.
auto SeverityKey(const MapCell& cell) {
  return std::tuple(cell.state, std::isnan(cell.decided.ratio) ? 0.0 : cell.decided.ratio,
                    std::isnan(cell.t_reached) ? 0.0 : -cell.t_reached);
}

Selection RowAndColumn(const Selection& one, const Selection& other) {
  Selection both = one;
  both.insert(both.end(), other.begin(), other.end());
  if (std::ranges::find(both, "kind", &Condition::key) == both.end()) {
    both.push_back({"kind", {"accuracy"}});
  }
  return both;
}

std::vector<std::string> UnknownKeys(const MapRules& rules, std::span<const Record> records) {
  std::set<std::string> named;
  const auto name = [&named](const Selection& selection) {
    for (const Condition& condition : selection) named.insert(condition.key);
  };
  for (const MapMethod& column : rules.columns) name(column.select);
  for (const MapGroup& group : rules.groups) {
    for (const MapRow& row : group.rows) {
      name(row.select);
      for (const Demand& demand : row.decides) {
        named.insert(demand.measure);
        if (!demand.of.empty()) named.insert(demand.of);
      }
    }
  }
  const std::vector<std::string> known = KeysOf(records);
  std::vector<std::string> remarks;
  for (const std::string& key : named) {
    if (records.empty() || Names(known, key)) continue;
    const std::string nearest = NearestSpelling(key, known);
    remarks.push_back(fmt::format("no record has the key \"{}\"{}", key,
                                  nearest.empty() ? "" : " (did you mean \"" + nearest + "\"?)"));
  }
  return remarks;
}

// Evaluates a run with an unexpected outcome.
void JudgeEnding(const MapRow& row, const Record& record, MapCell* cell) {
  cell->state = StateOfEnding(cell->outcome);
  cell->word = cell->state == CellState::kInaccurate ? ToString(cell->state) : cell->outcome;
  cell->reason = record.Text("message");
  if (row.right == std::vector<std::string>{kFinishedWord}) return;
  cell->reason =
      fmt::format("ended as {}, right is {}{}{}", cell->outcome, fmt::join(row.right, " or "),
                  cell->reason.empty() ? "" : ": ", cell->reason);
}

}  // namespace

std::string_view ToString(CellState state) {
  constexpr std::string_view kWords[] = {"holds", "not applicable", "not measured", "stopped",
                                         "limit", "inaccurate",     "broken"};
  return kWords[static_cast<std::size_t>(state)];
}

MapCell JudgeRun(const MapRow& row, const Record& record) {
  MapCell cell;
  cell.outcome = record.Text("outcome");
  cell.case_id = record.Text("case_id");
  cell.t_reached = record.Number("t_reached");
  cell.records = 1;
  if (!Names(row.right, cell.outcome)) {
    JudgeEnding(row, record, &cell);
    return cell;
  }
  std::string beyond, lacking;
  for (const Demand& demand : row.decides) {
    if (!Names(demand.when, cell.outcome)) continue;
    const Judged judged = Judge(demand, record);
    if (!judged.measured) {
      lacking = judged.reason;
      continue;
    }
    // the met demand closest to its limit decides, unless a demand is not met
    if (judged.met ? beyond.empty() && !(judged.ratio <= cell.decided.ratio)
                   : beyond.empty() || judged.ratio > cell.decided.ratio) {
      cell.decided = judged;
    }
    if (!judged.met) beyond += (beyond.empty() ? "" : "; ") + judged.reason;
  }
  cell.state = !beyond.empty()    ? CellState::kInaccurate
               : !lacking.empty() ? CellState::kNotMeasured
                                  : CellState::kHolds;
  if (cell.state == CellState::kNotMeasured) cell.decided = {};
  cell.reason = beyond.empty() ? lacking : beyond;
  cell.holding = cell.state == CellState::kHolds ? 1 : 0;
  cell.word = ToString(cell.state);
  return cell;
}

MapCell JudgeCell(const MapRow& row, std::size_t column, const MapMethod& method,
                  std::span<const Record> records) {
  const Selection selection = RowAndColumn(row.select, method.select);
  std::optional<MapCell> worst;
  std::size_t holding = 0, count = 0, flagged = 0;
  std::map<std::string, int> warnings;
  for (const Record& record : records) {
    if (!Matches(record, selection)) continue;
    const MapCell one = JudgeRun(row, record);
    holding += one.holding;
    if (one.holding > 0 && HasWarning(record)) {
      ++flagged;
      std::istringstream codes(record.Text("warnings"));
      for (std::string code; codes >> code;) ++warnings[code];
    }
    ++count;
    if (!worst || SeverityKey(one) > SeverityKey(*worst)) worst = one;
  }
  MapCell cell;
  const auto named = row.not_applicable.find(method.label);
  const std::string excuse = named != row.not_applicable.end() ? named->second
                             : row.must_hold.at(column)        ? ""
                                                               : row.others_not_applicable;
  if (worst && (count >= row.cases || worst->state > CellState::kNotMeasured)) {
    cell = *worst;
  } else if (!worst && !excuse.empty()) {
    cell.state = CellState::kNotApplicable;
    cell.word = ToString(cell.state);
    cell.reason = excuse;
  } else {
    cell.reason =
        worst ? fmt::format("{} of {} cases have a record", count, row.cases) : "no record matches";
  }
  cell.holding = holding;
  cell.records = count;
  cell.flagged = flagged;
  for (const auto& [code, times] : warnings) {
    cell.warnings += fmt::format("{}{} {}", cell.warnings.empty() ? "" : ", ", code, times);
  }
  cell.cases = std::max(count, row.cases);
  cell.demanded = row.must_hold.at(column);
  return cell;
}

RobustnessMap MakeRobustnessMap(const MapRules& rules, std::span<const Record> records) {
  RobustnessMap map{rules, {}, UnknownKeys(rules, records)};
  for (const MapGroup& group : rules.groups) {
    auto& rows = map.cells.emplace_back();
    for (const MapRow& row : group.rows) {
      auto& cells = rows.emplace_back();
      for (std::size_t c = 0; c < rules.columns.size(); ++c) {
        cells.push_back(JudgeCell(row, c, rules.columns[c], records));
      }
    }
  }
  return map;
}

std::string ClassText(const MapCell& cell) {
  const bool named = cell.state == CellState::kHolds && cell.outcome != kFinishedWord;
  return named ? cell.word + ": " + cell.outcome : cell.word;
}

std::string DecidingNumber(const MapCell& cell) {
  if (cell.state == CellState::kNotMeasured || cell.state == CellState::kNotApplicable) return "";
  const Judged& decided = cell.decided;
  if (decided.measure.empty()) {
    if (cell.state == CellState::kInaccurate) return cell.outcome;
    return std::isnan(cell.t_reached) ? "" : fmt::format("at {:.3g} s", cell.t_reached);
  }
  const std::string name = decided.name.empty() ? "" : decided.name + " ";
  const std::string unit = decided.unit.empty() ? "" : " " + decided.unit;
  if (!std::isfinite(decided.value)) return name + "not finite";
  if (std::isnan(decided.total)) return fmt::format("{}{:.2g}{}", name, decided.value, unit);
  return fmt::format("{}{} of {}{}", name, decided.value, decided.total, unit);
}

std::string HoldingCount(const MapCell& cell) {
  const bool several = cell.cases > 1 && cell.records > 0;
  return several ? fmt::format("{}/{}", cell.holding, cell.cases) : "";
}

std::vector<std::string> BrokenDemands(const RobustnessMap& map) {
  std::vector<std::string> broken;
  EachCell(map, [&broken](const MapGroup&, const MapRow& row, const MapMethod& column,
                          const MapCell& cell) {
    if (!cell.demanded || cell.state == CellState::kHolds) return;
    const std::string number = DecidingNumber(cell);
    broken.push_back(fmt::format("{} / {}: {}{}{}{}", column.label, row.label, ClassText(cell),
                                 number.empty() ? "" : " ", number,
                                 cell.reason.empty() ? "" : " (" + cell.reason + ")"));
  });
  return broken;
}
namespace {

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
    if (index) endings.push_back(EndingNames().all()[static_cast<std::size_t>(*index)]);
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
  const bool possible = std::ranges::all_of(demand.when, [&right](const std::string& ending) {
    return std::ranges::find(right, ending) != right.end();
  });
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
    if (index) row->must_hold[static_cast<std::size_t>(*index)] = false;
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
    row->must_hold[static_cast<std::size_t>(*column)] = true;
    if (row->not_applicable.contains(columns[static_cast<std::size_t>(*column)])) {
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
    return std::ranges::any_of(row.decides, [&ending](const Demand& demand) {
      return std::ranges::find(demand.when, ending) != demand.when.end();
    });
  };
  if (std::ranges::find(row.right, "finished") != row.right.end() && !decided("finished")) {
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
  std::vector<std::string> labels;
  for (const JsonNode& element : node.Elements("rows")) {
    RowOfMap row = group.common;
    RowFields().Read(element, &row);
    ReportRepeated(element, "label", row.label, &labels);
    group.rows.push_back(row);
  }
  if (node.value().is_array() && labels.empty()) node.Fail("at least one row");
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
  std::vector<std::string> labels;
  for (const JsonNode& element : node.Elements("methods")) {
    MapMethod& column = rules.columns.emplace_back();
    if (!MethodFields().Read(element, &column)) continue;
    ReportRepeated(element, "label", column.label, &labels);
  }
  if (node.value().is_array() && rules.columns.empty()) node.Fail("at least one method");
}

void ReadMapGroups(const JsonNode& node, MapRules& rules) {
  NameList columns;
  for (const MapMethod& column : rules.columns) columns.Add(column.label);
  std::vector<std::string> labels;
  for (const JsonNode& element : node.Elements("groups")) {
    GroupOfMap group;
    group.common.columns = &columns;
    MapGroupFields().Read(element, &group);
    ReportRepeated(element, "label", group.label, &labels);
    rules.groups.push_back(group);
  }
  if (node.value().is_array() && labels.empty()) node.Fail("at least one group");
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

Json MapSchema() { return MapFields().OwnSchema(); }

MapRules ReadMapRules(const std::filesystem::path& path) {
  return ParseMapRules(ReadTextFile(path), path.string());
}

MapRules ParseMapRules(std::string_view text, const std::string& file) {
  const Json document = ParseDocument(text, file);
  ErrorList errors(file, text);
  const JsonNode root(document, "", errors);
  MapRules rules;
  if (ExpectDocument(root, FileKind::kMap)) MapFields().ReadRows(root, &rules);
  errors.ThrowIfAny();
  return rules;
}

}  // namespace loopbench::harness
