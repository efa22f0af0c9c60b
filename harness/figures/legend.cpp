#include "harness/figures/legend.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "harness/figures/panel.h"
#include "harness/text/escape.h"

namespace loopbench::harness {
namespace {

constexpr double kSample = 17.0, kSampleGap = 4.0, kItemGap = 10.0;  // [pt]

// "A", ..., "Z", "A1", ...
std::string Letter(std::size_t index) {
  const std::string letter(1, static_cast<char>('A' + index % 26));
  return index < 26 ? letter : letter + std::to_string(index / 26);
}

double SampleOf(const LegendItem& item) {
  if (item.line) return kSample + kSampleGap;
  return item.style.shape == Shape::kNone ? 0.0 : 6.0 + kSampleGap;
}

double WidthOfItem(const LegendItem& item) {
  return SampleOf(item) + WidthOf(item.text) + kItemGap;
}

LegendItem TextItem(const std::string& text) { return {.text = text, .line = false}; }

LegendRow SignsOf(const std::vector<Curve>& curves, const std::vector<std::string>& failures) {
  const auto any = [&](const auto& is) { return std::ranges::any_of(curves, is); };
  LegendRow row;
  if (any([](const Curve& curve) { return curve.style.doubtful || !curve.hollow.empty(); })) {
    row.push_back({"doubtful", {.shape = Shape::kCircle, .doubtful = true}, false});
  }
  if (any([](const Curve& curve) { return curve.ends_early || !curve.crosses.empty(); })) {
    row.push_back(TextItem(fmt::format("×: failed run{}{}{}", failures.empty() ? "" : " (",
                                       fmt::join(failures, "; "), failures.empty() ? "" : ")")));
  }
  if (any([](const Curve& curve) { return curve.guide.has_value(); })) {
    row.push_back(TextItem("numbers: fitted power of time"));
  }
  if (any([](const Curve& curve) { return curve.remark.ends_with('?'); })) {
    row.push_back(TextItem("?: not resolved"));
  }
  return row;
}

// Items in rows no wider than `width`.
std::vector<LegendRow> Broken(const LegendRow& items, double width) {
  std::vector<LegendRow> rows;
  double used = 0.0;
  for (const LegendItem& item : items) {
    const double own = WidthOfItem(item);
    if (rows.empty() || used + own - kItemGap > width) {
      rows.emplace_back();
      used = 0.0;
    }
    rows.back().push_back(item);
    used += own;
  }
  return rows;
}

void Append(std::vector<LegendRow> rows, std::vector<LegendRow>* all) {
  for (LegendRow& row : rows) all->push_back(std::move(row));
}

}  // namespace

std::string LineLook(const CurveStyle& style) {
  // [pt]; gnuplot multiplies them by half the line's width
  constexpr std::array<std::array<double, 6>, kDashes> kPatterns = {
      {{}, {6, 2.5}, {1.2, 1.8}, {6, 2, 1.2, 2}, {6, 2, 1.2, 2, 1.2, 2}, {3, 2}}};
  std::string lengths;
  for (const double length : kPatterns[style.dash % kDashes]) {
    if (length == 0.0) continue;
    lengths += fmt::format("{}{:.3g}", lengths.empty() ? "" : ",", 2.0 * length / style.width);
  }
  return fmt::format("lc rgb '{}' dt {} lw {:.4g}", style.color,
                     lengths.empty() ? "solid" : "(" + lengths + ")", style.width);
}

std::string MarkLook(const CurveStyle& style) {
  constexpr std::array kOpen = {6, 6, 8, 4, 12, 10};  // in the order of Shape; filled is the next
  const int open = kOpen[static_cast<std::size_t>(style.shape)];
  return fmt::format("pt {} ps 0.4 lw 1 lc rgb '{}'", style.doubtful ? open : open + 1,
                     style.color);
}

bool NamesAtEnds(const Figure& figure, const std::vector<Curve>& merged) {
  const auto named = std::ranges::count_if(
      merged, [](const Curve& curve) { return !curve.label.empty() && curve.merges; });
  return figure.legend.empty() &&
         (figure.names_at_ends || named > static_cast<std::ptrdiff_t>(kLegendRows));
}

std::vector<std::string> EndTexts(const Figure& figure, const std::vector<Curve>& merged,
                                  bool names, std::size_t letters) {
  std::vector<std::string> texts;
  std::size_t next = 0;
  for (const Curve& curve : merged) {
    std::string text = names && curve.merges ? curve.label : "";
    if (!figure.legend.empty() && curve.several && next++ < letters) text = Letter(next - 1);
    if (!curve.remark.empty()) text += (text.empty() ? "" : " ") + curve.remark;
    texts.push_back(text);
  }
  return texts;
}

Legend LegendOf(const Figure& figure, const std::vector<Curve>& merged, FigureSize size,
                const std::vector<std::string>& failures) {
  const double width = WidthOfPage(size) - 16.0;
  std::vector<LegendRow> rows;
  if (!figure.legend_title.empty()) rows.push_back({TextItem(figure.legend_title)});
  for (const LegendRow& row : figure.legend) Append(Broken(row, width), &rows);
  if (rows.size() > 3) {  // then without a row of its own for each channel
    LegendRow all;
    for (const LegendRow& row : rows) all.insert(all.end(), row.begin(), row.end());
    rows = Broken(all, width);
  }
  LegendRow named;
  std::vector<std::string> several;
  const bool at_ends = NamesAtEnds(figure, merged);
  for (const Curve& curve : merged) {
    if (curve.label.empty()) continue;
    if (!figure.legend.empty()) {
      if (curve.several) {
        several.push_back(Letter(several.size()) + ": " + curve.label);
      }
    } else if (!at_ends || !curve.merges) {
      named.push_back({curve.label, curve.style, curve.line || !curve.points});
    }
  }
  Append(Broken(named, width), &rows);
  Append(Broken(SignsOf(merged, failures), width), &rows);
  std::size_t letters = several.size();
  const auto list = [&] {
    std::string words = "coincide: ";
    for (std::size_t i = 0; i < letters; ++i) words += (i == 0 ? "" : ";  ") + several[i];
    if (letters < several.size()) words += letters == 0 ? "…" : ";  …";
    return Wrapped(words, static_cast<std::size_t>(width / kLetterWidth));
  };
  const auto has_room = [&] { return rows.size() + list().size() <= kLegendRows; };
  while (size == FigureSize::kOneColumn && letters > 0 && !has_room()) --letters;
  if (!several.empty()) {
    for (const std::string& line : list()) rows.push_back({TextItem(line)});
  }
  return {std::move(rows), letters};
}

std::string DrawLegend(const std::vector<LegendRow>& rows, const GnuplotPage& page, double top) {
  // gnuplot 5.4 draws lines of one colour and width in SVG with the dashes of the first: each has
  // a width of its own, by a thousandth
  std::string commands;
  double width = 0.0;
  double y = top - 0.5 * kLineHeight;
  for (const LegendRow& row : rows) {
    double x = 8.0;
    for (const LegendItem& item : row) {
      if (item.line) {
        CurveStyle style = item.style;
        style.width += width += 0.001;
        commands += fmt::format(
            "set arrow from screen {0:.5f}, screen {1:.5f} to screen {2:.5f}, screen {1:.5f} "
            "nohead {3}\n",
            x / page.width, y / page.height, (x + kSample) / page.width, LineLook(style));
      }
      if (item.style.shape != Shape::kNone) {
        const double middle = x + (item.line ? 0.5 * kSample : 3.0);
        commands += TextAt(page, "", middle, y, "point " + MarkLook(item.style));
      }
      commands += TextAt(page, item.text, x + SampleOf(item), y, "left");
      x += WidthOfItem(item);
    }
    y -= kLineHeight;
  }
  return commands;
}

}  // namespace loopbench::harness
