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

// A list of endings of runs, or `fallback` where there is none.
std::vector<std::string> ReadEndings(const JsonNode& owner, const std::string& key,
                                     std::vector<std::string> fallback) {
  const auto node = owner.Optional(key);
  if (!node) return fallback;
  std::vector<std::string> endings;
  for (const JsonNode& element : node->OneOrMore("endings")) {
    const auto index = element.Choice(EndingNames(), "an ending of runs");
    if (index) endings.push_back(EndingNames().all()[static_cast<std::size_t>(*index)]);
  }
  return endings;
}

void ReadNumber(const JsonNode& node, Demand* demand) {
  constexpr std::pair<const char*, Relation> kRelations[] = {
      {"limit", Relation::kAtMost}, {"at_least", Relation::kAtLeast}, {"equal", Relation::kEqual}};
  int found = 0;
  for (const auto& [key, relation] : kRelations) {
    const auto number = node.Optional(key);
    if (!number) continue;
    if (++found > 1) number->Fail("one of \"limit\", \"at_least\" and \"equal\"");
    demand->relation = relation;
    // ratios to a limit of 0 say nothing; what must be 0 is "equal" to it
    demand->number = number->Number(relation == Relation::kEqual ? Range{} : kPositive);
  }
  if (found == 0 && node.value().is_object()) {
    node.FailAs("no number", "one of \"limit\", \"at_least\" and \"equal\"");
  }
}

std::vector<Demand> ReadDemands(const JsonNode& owner, const std::vector<std::string>& right,
                                std::vector<Demand> fallback) {
  const auto node = owner.Optional("decides");
  if (!node) return fallback;
  std::vector<Demand> demands;
  for (const JsonNode& element : node->Elements("measures")) {
    Demand& demand = demands.emplace_back();
    if (!element.ExpectObject(
            {"measure", "limit", "at_least", "equal", "of", "when", "name", "unit"})) {
      continue;
    }
    demand.measure = RequiredText(element, "measure");
    demand.of = OptionalText(element, "of");
    demand.name = OptionalText(element, "name");
    demand.unit = OptionalText(element, "unit");
    demand.when = ReadEndings(element, "when", demand.when);
    const bool possible = std::ranges::all_of(demand.when, [&right](const std::string& ending) {
      return std::ranges::find(right, ending) != right.end();
    });
    if (!possible) {
      constexpr const char* kExpected = "endings that are \"right\" here";
      const auto when = element.Optional("when");
      if (when) {
        when->Fail(kExpected);
      } else {
        element.FailAs("no \"when\", which means finished", kExpected);
      }
    }
    ReadNumber(element, &demand);
  }
  return demands;
}

class GroupReader {
 public:
  explicit GroupReader(const std::vector<MapColumn>& columns) {
    for (const MapColumn& column : columns) columns_.Add(column.label);
  }

  MapGroup Read(const JsonNode& node) {
    MapGroup group;
    if (!node.ExpectObject({"label", "rows", "select", "decides", "right", "must_hold",
                            "not_applicable", "cases", "why"})) {
      return group;
    }
    MapRow common;
    common.must_hold.assign(columns_.all().size(), false);
    ReadShared(node, &common);
    group.label = RequiredText(node, "label");
    if (const auto rows = node.Required("rows", "an array of rows")) {
      std::vector<std::string> labels;
      for (const JsonNode& element : rows->Elements("rows")) {
        group.rows.push_back(ReadRow(element, common));
        ReportRepeated(element, "label", group.rows.back().label, &labels);
      }
      if (rows->value().is_array() && labels.empty()) rows->Fail("at least one row");
    }
    return group;
  }

 private:
  // What groups and rows may say; `row` holds what the group said.
  void ReadShared(const JsonNode& node, MapRow* row) {
    const Selection select = OptionalSelection(node, "select");
    row->select.insert(row->select.end(), select.begin(), select.end());
    row->right = ReadEndings(node, "right", row->right);
    row->decides = ReadDemands(node, row->right, row->decides);
    if (const auto cases = node.Optional("cases")) {
      constexpr std::int64_t kMostCases = 1'000'000;
      row->cases = static_cast<std::size_t>(cases->Integer(1, kMostCases));
    }
    if (node.Optional("why")) row->why = OptionalText(node, "why");
    // without columns everything that names one would be a mistake, and none of its own
    if (columns_.all().empty()) return;
    ReadNotApplicable(node, row);
    ReadMustHold(node, row);
  }

  void ReadNotApplicable(const JsonNode& node, MapRow* row) {
    const auto reasons = node.Optional("not_applicable");
    if (!reasons) return;
    if (reasons->value().is_string()) {
      row->others_not_applicable = reasons->Text();
      return;
    }
    if (!reasons->ExpectObject(columns_)) return;
    for (const auto& [column, reason] : reasons->Members()) {
      row->not_applicable[column] = reason.Text();
      const auto index = columns_.Find(column);  // what a group demands of all its rows
      if (index) row->must_hold[static_cast<std::size_t>(*index)] = false;
    }
  }

  void ReadMustHold(const JsonNode& node, MapRow* row) {
    const auto demanded = node.Optional("must_hold");
    if (!demanded) return;
    row->must_hold.assign(columns_.all().size(), false);
    if (demanded->value() == "all") {
      for (std::size_t c = 0; c < row->must_hold.size(); ++c) {
        row->must_hold[c] = !row->not_applicable.contains(columns_.all()[c]);
      }
      return;
    }
    const bool is_list = demanded->value().is_array();
    for (const JsonNode& element :
         is_list ? demanded->Elements("column labels") : std::vector<JsonNode>{*demanded}) {
      const auto column = element.Choice(columns_, "\"all\" or a column");
      if (!column) continue;
      row->must_hold[static_cast<std::size_t>(*column)] = true;
      if (row->not_applicable.contains(columns_.all()[static_cast<std::size_t>(*column)])) {
        element.Fail("a column that is applicable here");
      }
    }
  }

  MapRow ReadRow(const JsonNode& node, const MapRow& common) {
    MapRow row = common;
    if (!node.ExpectObject({"label", "select", "decides", "right", "must_hold", "not_applicable",
                            "cases", "why"})) {
      return row;
    }
    row.label = RequiredText(node, "label");
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
    return row;
  }

  NameList columns_;
};

std::vector<MapColumn> ReadMapColumns(const JsonNode& root) {
  std::vector<MapColumn> columns;
  const auto node = root.Required("columns", "an array of columns");
  if (!node) return columns;
  std::vector<std::string> labels;
  for (const JsonNode& element : node->Elements("columns")) {
    MapColumn& column = columns.emplace_back();
    if (!element.ExpectObject({"label", "select"})) continue;
    column.label = RequiredText(element, "label");
    ReportRepeated(element, "label", column.label, &labels);
    if (element.Required("select", "an object of keys and values")) {
      column.select = OptionalSelection(element, "select");
    }
  }
  if (node->value().is_array() && columns.empty()) node->Fail("at least one column");
  return columns;
}

}  // namespace

MapRules ReadMapRules(const std::filesystem::path& path) {
  return ParseMapRules(ReadTextFile(path), path.string());
}

MapRules ParseMapRules(std::string_view text, const std::string& file) {
  const Json document = ParseDocument(text, file);
  ErrorList errors(file, text);
  const JsonNode root(document, "", errors);
  MapRules rules;
  if (ExpectDocument(root, FileKind::kMap)) {
    rules.title = RequiredText(root, "title");
    rules.comment = OptionalText(root, "comment");
    rules.columns = ReadMapColumns(root);
    GroupReader reader(rules.columns);
    if (const auto groups = root.Required("groups", "an array of groups of rows")) {
      std::vector<std::string> labels;
      for (const JsonNode& element : groups->Elements("groups")) {
        rules.groups.push_back(reader.Read(element));
        ReportRepeated(element, "label", rules.groups.back().label, &labels);
      }
      if (groups->value().is_array() && labels.empty()) groups->Fail("at least one group");
    }
  }
  errors.ThrowIfAny();
  return rules;
}

}  // namespace loopbench::harness
