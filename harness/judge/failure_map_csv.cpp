#include "harness/judge/failure_map_csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <vector>

#include "harness/text/config_error.h"
#include "harness/text/escape.h"

namespace loopbench::harness {
namespace {

/// Fields of one line; a quoted one may have commas and doubled quotes. Texts have no line ends
/// (EscapeCsv).
std::vector<std::string> FieldsOf(std::string_view line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      fields.back() += line[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else if (c != '\r') {
      fields.back() += c;
    }
  }
  return fields;
}

/// As the file has it.
std::string Written(const std::string& label) { return FieldsOf(EscapeCsv(label)).front(); }

std::optional<CellState> StateNamed(std::string_view name) {
  const auto* state =
      std::ranges::find(kCellStates, name, [](CellState one) { return ToString(one); });
  if (state == kCellStates.end()) return std::nullopt;
  return *state;
}

using Place = std::vector<std::string>;  // group, row, column

std::map<Place, MapCell*> PlacesOf(FailureMap& map) {
  std::map<Place, MapCell*> places;
  for (std::size_t g = 0; g < map.cells.size(); ++g) {
    const MapGroup& group = map.rules.groups[g];
    for (std::size_t r = 0; r < map.cells[g].size(); ++r) {
      for (std::size_t c = 0; c < map.cells[g][r].size(); ++c) {
        places[{Written(group.label), Written(group.rows[r].label),
                Written(map.rules.columns[c].label)}] = &map.cells[g][r][c];
      }
    }
  }
  return places;
}

}  // namespace

FailureMap MapFromCsv(const MapRules& rules, std::string_view csv, const std::string& file) {
  FailureMap map = MakeFailureMap(rules, {});
  map.remarks.clear();
  std::map<Place, MapCell*> places = PlacesOf(map);
  std::vector<std::string> heading;
  std::size_t number = 0;
  for (std::size_t start = 0; start < csv.size(); ++number) {
    const std::size_t end = std::min(csv.find('\n', start), csv.size());
    const std::string_view line = csv.substr(start, end - start);
    start = end + 1;
    if (line.empty() || line.front() == '#') continue;
    const std::vector<std::string> fields = FieldsOf(line);
    const auto fail = [&](const std::string& found, const char* expected) {
      throw ConfigError(
          fmt::format("{}:{}: found {}, expected {}", file, number + 1, found, expected));
    };
    if (heading.empty()) {
      heading = fields;
      continue;
    }
    if (fields.size() != heading.size()) {
      fail(fmt::format("{} fields", fields.size()), "as many as in the heading");
    }
    const auto field = [&](const char* key) {
      const auto at = std::ranges::find(heading, key);
      if (at == heading.end()) {
        fail(fmt::format("no column \"{}\"", key), "failure-map.csv of \"loopbench map\"");
      }
      return fields[static_cast<std::size_t>(at - heading.begin())];
    };
    const auto cell = places.find({field("group"), field("row"), field("column")});
    if (cell == places.end()) {
      fail(
          fmt::format("\"{}\" of \"{}\" for \"{}\"", field("row"), field("group"), field("column")),
          "each cell of the rules once");
    }
    const auto state = StateNamed(field("state"));
    if (!state) fail(fmt::format("state \"{}\"", field("state")), "a state of cells");
    cell->second->state = *state;
    cell->second->demanded = field("must_hold") == "true";
    cell->second->doubted = 0;
    places.erase(cell);
  }
  if (!places.empty()) {
    const Place& place = places.begin()->first;
    throw ConfigError(
        fmt::format("{}: found no \"{}\" of \"{}\" for \"{}\", expected each cell of the rules",
                    file, place[1], place[0], place[2]));
  }
  return map;
}

}  // namespace loopbench::harness
