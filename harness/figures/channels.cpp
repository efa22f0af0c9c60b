#include "harness/figures/channels.h"

#include <algorithm>
#include <array>

#include "harness/analysis/doubts.h"
#include "harness/config/experiment.h"
#include "harness/config/formulations.h"

namespace loopbench::harness {
namespace {

constexpr const char* kNeutral = "#707070";  // of samples that tell something else than hue

std::string ColorOf(const Record& record) {
  const FormulationRow* row = FindFormulation(record.Text("formulation"));
  return row == nullptr ? kNeutral : row->color;  // of another program
}

std::size_t DashOf(const Record& record) {
  const auto level = Parse<Enforcement>(record.Text("enforcement"));
  return static_cast<std::size_t>(level.value_or(Enforcement())) % kDashes;
}

Shape ShapeOf(const Record& record) {
  return record.Text("coordinates") == "absolute" ? Shape::kTriangle : Shape::kCircle;
}

double WidthOfSolver(const Record& record) {
  return record.Text("solver") == ToString(SolverKind::kAsPublished) ? 0.7 : 1.5;
}

/// What an item of each channel shows of a run.
LegendItem ItemOf(const Record& record, std::string_view key) {
  const CurveStyle style = StyleOf(record);
  LegendItem item{.text = record.Text(key), .style = {.color = kNeutral}};
  if (key == "formulation") item.style = {.color = style.color, .width = 2.5};
  if (key == "enforcement") item.style.dash = style.dash;
  if (key == "solver") item.style.width = style.width;
  if (key == "coordinates") {
    item.style.shape = style.shape;
    item.line = false;
  }
  return item;
}

/// One item per value, in the order of the records.
LegendRow ItemsOf(std::span<const Record> records, const std::string& key) {
  LegendRow row;
  for (const Record& record : records) {
    LegendItem item = ItemOf(record, key);
    const bool is_new =
        std::ranges::none_of(row, [&](const LegendItem& other) { return other.text == item.text; });
    if (is_new && !record.Text(key).empty()) row.push_back(std::move(item));
  }
  return row;
}

}  // namespace

bool Varies(std::span<const Record> records, const std::string& key) {
  return std::ranges::any_of(
      records, [&](const Record& record) { return record.Text(key) != records[0].Text(key); });
}

CurveStyle StyleOf(const Record& record) {
  return {.color = ColorOf(record),
          .dash = DashOf(record),
          .width = WidthOfSolver(record),
          .shape = ShapeOf(record),
          .doubtful = HasDoubt(record)};
}

std::string MethodLabel(const Record& record, std::span<const Record> all) {
  std::string label;
  for (const char* key : kChannelKeys) {
    if (Varies(all, key)) label += (label.empty() ? "" : ", ") + record.Text(key);
  }
  return label.empty() ? record.Text("formulation") : label;
}

std::vector<LegendRow> ChannelLegend(std::span<const Record> records) {
  std::vector<LegendRow> rows;
  if (LegendRow hues = ItemsOf(records, "formulation"); !hues.empty())
    rows.push_back(std::move(hues));
  if (Varies(records, "enforcement")) rows.push_back(ItemsOf(records, "enforcement"));
  LegendRow others;
  for (const char* key : {"coordinates", "solver"}) {
    if (!Varies(records, key)) continue;
    for (LegendItem& item : ItemsOf(records, key)) others.push_back(std::move(item));
  }
  if (!others.empty()) rows.push_back(std::move(others));
  return rows;
}

}  // namespace loopbench::harness
