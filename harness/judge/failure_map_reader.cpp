#include "harness/judge/failure_map_reader.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "harness/config/selection_reader.h"
#include "harness/json/document_kind.h"

namespace loopbench::harness {
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

/// A demand, and how the runs may end that it is made on.
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
    // ratios to a limit of 0 say nothing; what must be 0 is "equal" to it
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
  constexpr const char* kExpected = "endings that are \"right\" here";
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
      "demand", "A measure and the number it is held to.",
      {{"measure", Text(&Demand::measure), "A key of the records.", kAnyText},
       {"limit", NumberSchema(kPositive), "At most this."},
       {"at_least", NumberSchema(kPositive), "At least this."},
       {"equal", NumberSchema(), "Exactly this."},
       {"of", Text(&Demand::of), "The number counts this many times another key of the record."},
       {"when", By(EndingsSchema(), ReadWhen),
        "Endings of runs that it applies to, default finished."},
       {"name", Text(&Demand::name), "A short word for cells."},
       {"unit", Text(&Demand::unit), "Of the measure, for cells."},
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

/// A row, or what a group says of its rows, and the labels of the columns.
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
    const auto index = row->columns->Find(column);  // what a group demands of all its rows
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
    const auto column = element.Choice(*row->columns, "\"all\" or a column");
    if (!column) continue;
    row->must_hold[static_cast<std::size_t>(*column)] = true;
    if (row->not_applicable.contains(columns[static_cast<std::size_t>(*column)])) {
      element.Fail("a column that is applicable here");
    }
  }
}

constexpr std::int64_t kMostCases = 1'000'000;

/// What groups and rows may say; `row` holds what the group said. Some keys look at others, so they
/// are read in an order of their own.
void ReadShared(const JsonNode& node, RowOfMap* row) {
  if (const auto select = node.Optional("select")) {
    const Selection own = ReadSelection(*select, 1);
    row->select.insert(row->select.end(), own.begin(), own.end());
  }
  if (const auto right = node.Optional("right")) row->right = ReadEndings(*right);
  if (const auto decides = node.Optional("decides")) {
    row->decides = ReadDemands(*decides, row->right);
  }
  if (const auto cases = node.Optional("cases")) {
    row->cases = static_cast<std::size_t>(cases->Integer(1, kMostCases));
  }
  if (const auto why = node.Optional("why")) row->why = why->Text();
  // without columns everything that names one would be a mistake, and none of its own
  if (row->columns->all().empty()) return;
  if (const auto reasons = node.Optional("not_applicable")) ReadNotApplicable(*reasons, row);
  if (const auto demanded = node.Optional("must_hold")) ReadMustHold(*demanded, row);
}

/// The rows of ReadShared() behind others.
template <class T>
std::vector<Field<T>> WithShared(std::vector<Field<T>> rows) {
  const Json text = TextSchema();
  const std::vector<Field<T>> shared = {
      {"select", SelectionSchema(1), "Which records, with those of the group and the column."},
      {"decides", ArraySchema(DemandFields().Schema()), "Measures that must all be as demanded."},
      {"right", EndingsSchema(), "How a run may end, default finished."},
      {"must_hold", EitherSchema({text, ArraySchema(text)}),
       "\"all\" or labels of columns, for --gate."},
      {"not_applicable", EitherSchema({text, MapSchema(text)}),
       "Why a column has no record here, by its label, or one reason for all that need not hold."},
      {"cases", IntegerSchema(1, kMostCases), "How many records there should be, default 1."},
      {"why", text, "Where the limits come from."}};
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
                "\"decides\" with a measure, here or in the group");
  }
}

const Fields<RowOfMap>& RowFields() {
  static const Fields<RowOfMap> fields(
      "row", "An extreme, and what decides about it.",
      WithShared<RowOfMap>({{"label", Text(&MapRow::label), "Its name.", kAnyText},
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
      "What a group says of its rows: select and not_applicable join theirs, each other key stands "
      "where a row has none.",
      WithShared<GroupOfMap>({{"", By(Json::object(), ReadCommon)},
                              {"label", Text(&MapGroup::label), "Its name.", kAnyText},
                              {"short", Text(&MapGroup::short_label),
                               "A shorter one for pictures, default the label."},
                              {"rows", By(ArraySchema(RowFields().Schema(), 1), ReadMapRows),
                               "Extremes.", "an array of rows"}}));
  return fields;
}

const Fields<MapColumn>& MethodFields() {
  static const Fields<MapColumn> fields("method", "A method: a column of the map.",
                                        {{"label", Text(&MapColumn::label), "Its name.", kAnyText},
                                         {"select", SelectionOf(&MapColumn::select, 1),
                                          "Which records.", "an object of keys and values"}});
  return fields;
}

void ReadMapColumns(const JsonNode& node, MapRules& rules) {
  std::vector<std::string> labels;
  for (const JsonNode& element : node.Elements("columns")) {
    MapColumn& column = rules.columns.emplace_back();
    if (!MethodFields().Read(element, &column)) continue;
    ReportRepeated(element, "label", column.label, &labels);
  }
  if (node.value().is_array() && rules.columns.empty()) node.Fail("at least one column");
}

void ReadMapGroups(const JsonNode& node, MapRules& rules) {
  NameList columns;
  for (const MapColumn& column : rules.columns) columns.Add(column.label);
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
      "Rules that hold stored records against limits, a cell per row and column (loopbench map). "
      "The program checks more than this schema: that labels are different, that \"must_hold\" and "
      "\"not_applicable\" name columns, and that a row, with its group, selects records and says "
      "what decides about a run that ends as it should.",
      DocumentRows<MapRules>(
          {{"title", Text(&MapRules::title), "Of the map.", kAnyText},
           {"comment", Text(&MapRules::comment), "Free text for readers."},
           {"columns", By(ArraySchema(MethodFields().Schema(), 1), ReadMapColumns), "Methods.",
            "an array of columns"},
           {"groups", By(ArraySchema(MapGroupFields().Schema(), 1), ReadMapGroups),
            "Rows, in groups.", "an array of groups of rows"}}));
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
