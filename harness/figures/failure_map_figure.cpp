#include "harness/figures/failure_map_figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "harness/text/escape.h"

namespace loopbench::harness {
namespace {

// All lengths in pixels from the upper left corner.
constexpr double kTextSize = 11.0, kLine = 14.0,
                 kLetter = 6.3;  // of text: size, distance, mean width
constexpr double kMargin = 12.0, kCellPadding = 8.0, kTitleHeight = 34.0, kHeading = 24.0;
constexpr std::size_t kRowLetters = 46, kColumnLetters = 18;  // where labels are wrapped

// What a state looks like. Blues and oranges stay apart for every kind of colour blindness, and no
// two of these have the same lightness.
struct Look {
  const char *fill, *text, *meaning;
};

Look LookOf(CellState state) {
  switch (state) {
    case CellState::kHolds:
      return {"#a9d3ee", "#000000", "holds: ended as it should, all measures within their limits"};
    case CellState::kStopped:
      return {"#f7f0a8", "#000000", "stopped early and said why"};
    case CellState::kLimit:
      return {"#c79bc4", "#000000", "did not end by itself"};
    case CellState::kInaccurate:
      return {"#e08214", "#000000", "inaccurate: ended as if all were well"};
    case CellState::kBroken:
      return {"#3a3a3a", "#ffffff", "broken: crashed, or no result"};
    case CellState::kNotApplicable:
      return {"#e2e2e2", "#000000", "not applicable"};
    case CellState::kNotMeasured:
      break;
  }
  return {"#ffffff", "#606060", "not measured"};
}

std::size_t Letters(std::string_view text) {
  return static_cast<std::size_t>(std::ranges::count_if(
      text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0u) != 0x80u; }));
}

// Lines of at most `most` letters, broken at spaces; a longer word stays whole.
std::vector<std::string> Wrapped(const std::string& text, std::size_t most) {
  std::vector<std::string> lines(1);
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find(' ', start), text.size());
    const std::string word = text.substr(start, end - start);
    if (!lines.back().empty() && Letters(lines.back()) + 1 + Letters(word) > most) {
      lines.emplace_back();
    }
    lines.back() += (lines.back().empty() ? "" : " ") + word;
    start = end + 1;
  }
  return lines;
}

double WidthOf(const std::vector<std::string>& lines) {
  std::size_t longest = 0;
  for (const std::string& line : lines) longest = std::max(longest, Letters(line));
  return kLetter * static_cast<double>(longest);
}

// Class with count, and number.
std::vector<std::string> CellLines(const MapCell& cell) {
  const std::string count = HoldingCount(cell), number = DecidingNumber(cell);
  std::vector<std::string> lines = {ClassText(cell) + (count.empty() ? "" : " " + count)};
  if (!number.empty()) lines.push_back(number);
  return lines;
}

class MapPainter {
 public:
  MapPainter(const FailureMap& map, double point) : map_(map), point_(point) {
    for (const MapColumn& column : map.rules.columns) {
      const auto lines = Wrapped(column.label, kColumnLetters);
      head_lines_ = std::max(head_lines_, lines.size());
      cell_width_ = std::max(cell_width_, WidthOf(lines));
    }
    for (std::size_t g = 0; g < map.cells.size(); ++g) {
      for (std::size_t r = 0; r < map.cells[g].size(); ++r) {
        const auto label = Wrapped(map.rules.groups[g].rows[r].label, kRowLetters);
        row_lines_ = std::max(row_lines_, label.size());
        label_width_ = std::max(label_width_, WidthOf(label));
        for (const MapCell& cell : map.cells[g][r]) {
          cell_width_ = std::max(cell_width_, WidthOf(CellLines(cell)));
        }
      }
    }
    cell_width_ += kCellPadding;
    label_width_ += kCellPadding;
  }

  MapDrawing Draw() {
    y_ = kMargin;
    Text({map_.rules.title}, kMargin, y_ + kTitleHeight / 2, "left", "#000000", 16.0);
    y_ += kTitleHeight;
    DrawHead();
    for (std::size_t g = 0; g < map_.cells.size(); ++g) DrawGroup(g);
    DrawLegend();
    const GnuplotPage page{static_cast<int>(Width()), static_cast<int>(y_ + kMargin),
                           static_cast<int>(kTextSize * point_ + 0.5)};
    return {page,
            fmt::format("set encoding utf8\nset margins 0,0,0,0\nunset border\nunset tics\n"
                        "unset key\nset xrange [0:{}]\nset yrange [{}:0]\n{}plot -1 notitle\n",
                        page.width, page.height, commands_)};
  }

 private:
  double Width() const {
    const double grid =
        2 * kMargin + label_width_ + cell_width_ * static_cast<double>(map_.rules.columns.size());
    return std::max({grid, 2 * kMargin + 1.4 * WidthOf({map_.rules.title}), 480.0});
  }
  double Left(std::size_t column) const {
    return kMargin + label_width_ + cell_width_ * static_cast<double>(column);
  }

  // Lines of text around a middle.
  void Text(const std::vector<std::string>& lines, double x, double y, std::string_view align,
            std::string_view colour, double size = kTextSize) {
    y -= 0.5 * kLine * static_cast<double>(lines.size() - 1);
    for (const std::string& line : lines) {
      commands_ +=
          fmt::format("set label {} at {:.1f},{:.1f} {} front tc rgb '{}' font ',{:.3g}'\n",
                      QuoteGnuplot(line), x, y, align, colour, size * point_);
      y += kLine;
    }
  }

  void Box(double x, double y, double width, double height, std::string_view fill,
           std::string_view border, double line) {
    commands_ += fmt::format(
        "set object rect from {:.1f},{:.1f} to {:.1f},{:.1f} fc rgb '{}' fs solid border rgb '{}' "
        "lw {:.3g}\n",
        x, y, x + width, y + height, fill, border, line);
  }

  void DrawHead() {
    const double height = kLine * static_cast<double>(head_lines_) + kCellPadding;
    for (std::size_t c = 0; c < map_.rules.columns.size(); ++c) {
      Text(Wrapped(map_.rules.columns[c].label, kColumnLetters), Left(c) + cell_width_ / 2,
           y_ + height / 2, "center", "#000000");
    }
    y_ += height;
  }

  void DrawGroup(std::size_t group) {
    Text({map_.rules.groups[group].label}, kMargin, y_ + kHeading / 2, "left", "#000000", 13.5);
    y_ += kHeading;
    const double height = kLine * static_cast<double>(std::max<std::size_t>(2, row_lines_)) + 6.0;
    for (std::size_t r = 0; r < map_.cells[group].size(); ++r) {
      Text(Wrapped(map_.rules.groups[group].rows[r].label, kRowLetters), kMargin, y_ + height / 2,
           "left", "#000000");
      for (std::size_t c = 0; c < map_.cells[group][r].size(); ++c) {
        const MapCell& cell = map_.cells[group][r][c];
        const Look look = LookOf(cell.state);
        Box(Left(c), y_, cell_width_, height, look.fill,
            cell.state == CellState::kNotMeasured ? "#b0b0b0" : "#ffffff", 1.0);
        if (cell.demanded && cell.state != CellState::kHolds) {
          commands_ += fmt::format(
              "set object rect from {:.1f},{:.1f} to {:.1f},{:.1f} front fs empty border rgb "
              "'#000000' lw 2.5\n",
              Left(c) + 2, y_ + 2, Left(c) + cell_width_ - 2, y_ + height - 2);
          framed_ = true;
        }
        Text(CellLines(cell), Left(c) + cell_width_ / 2, y_ + height / 2, "center", look.text);
      }
      y_ += height;
    }
  }

  void DrawLegend() {
    y_ += kHeading;
    constexpr double kSwatch = 14.0, kRow = 20.0;
    for (const CellState state : kCellStates) {
      const Look look = LookOf(state);
      Box(kMargin, y_ - kSwatch / 2, kSwatch, kSwatch, look.fill, "#808080", 1.0);
      Text({look.meaning}, kMargin + kSwatch + 8.0, y_, "left", "#000000");
      y_ += kRow;
    }
    std::vector<std::string> remarks = {
        "Number: the measure that decided, or when a run ended. k/n: of n runs k hold, the worst "
        "is "
        "shown."};
    if (framed_) remarks.push_back("Frame: must hold and does not.");
    for (const std::string& remark : remarks) {
      for (const std::string& line :
           Wrapped(remark, static_cast<std::size_t>((Width() - 2 * kMargin) / kLetter))) {
        Text({line}, kMargin, y_, "left", "#000000");
        y_ += kRow;
      }
    }
  }

  const FailureMap& map_;
  double point_;
  std::size_t head_lines_ = 1, row_lines_ = 1;
  double cell_width_ = 0.0, label_width_ = 0.0, y_ = 0.0;
  bool framed_ = false;
  std::string commands_;
};

}  // namespace

MapDrawing DrawMap(const FailureMap& map, double point) { return MapPainter(map, point).Draw(); }

std::optional<std::string> WriteMapFigure(const std::filesystem::path& path, const FailureMap& map,
                                          const std::string& gnuplot) {
  constexpr double kPdfPoint = 1.1;  // with the terminal's own scale of fonts
  const MapDrawing drawing = DrawMap(map, path.extension() == ".pdf" ? kPdfPoint : 1.0);
  return DrawWithGnuplot(path, drawing.page, drawing.script, gnuplot);
}

}  // namespace loopbench::harness
