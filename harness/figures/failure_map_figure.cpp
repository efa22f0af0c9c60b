#include "harness/figures/failure_map_figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "harness/text/escape.h"

namespace loopbench::harness {
namespace {

// All lengths in points from the lower left corner.
constexpr double kMargin = 6.0, kRoom = 4.0;
constexpr double kShareWidth = 26.0;   // of the numbers at the right
constexpr double kPageHeight = 680.0;  // 240 mm, what a page has

// From all rows hold to none does. Letters are white on the last two.
constexpr std::array kShades = {"#ffffff", "#dfe5ec", "#b7c4d3", "#8599b0", "#4b6384", "#16294a"};

std::size_t ShadeOf(const FoldedCell& cell) {
  if (cell.judged == 0 || cell.holding == cell.judged) return 0;
  return 1 + static_cast<std::size_t>(std::floor((1.0 - cell.Share()) * 4.0));
}

/// A point type of gnuplot, or a text.
struct Glyph {
  int point = 0;
  double size = 0.0;
  const char* text = "";
  const char* meaning = "";
};

Glyph GlyphOf(CellState state) {
  switch (state) {
    case CellState::kHolds:
      return {7, 0.25, "", "holds"};
    case CellState::kStopped:
      return {8, 0.6, "", "stopped and said why"};
    case CellState::kLimit:
      return {6, 0.55, "", "did not end by itself"};
    case CellState::kInaccurate:
      return {2, 0.55, "", "wrong without a word"};
    case CellState::kBroken:
      return {3, 0.6, "", "crashed, or no result"};
    case CellState::kNotApplicable:
      return {0, 0.0, "–", "not applicable"};
    case CellState::kNotMeasured:
      break;
  }
  return {0, 0.0, "?", "not measured"};
}

class MapPainter {
 public:
  MapPainter(const FailureMap& map, FigureSize size) : map_(map), groups_(Folded(map)) {
    page_.width = std::round(PointsOf(size == FigureSize::kOneColumn ? 85.0 : 178.0));
    const auto columns = static_cast<double>(map.rules.columns.size());
    label_width_ = 0.34 * page_.width;
    const double room = page_.width - 2 * kMargin - label_width_ - kShareWidth;
    cell_width_ = std::min(room / columns, 40.0);
    label_letters_ = static_cast<std::size_t>((label_width_ - kRoom) / kLetterWidth);
    std::size_t head = 1, lines = 1;
    for (const MapColumn& column : map.rules.columns) head = std::max(head, Letters(column.label));
    for (const FoldedGroup& group : groups_) {
      lines = std::max(lines, Wrapped(group.label, label_letters_).size());
    }
    head_height_ = kLetterWidth * static_cast<double>(head) + kRoom;
    cell_height_ =
        std::max({kLineHeight * static_cast<double>(lines) + 1.0, 0.8 * cell_width_, 11.0});
    const double foot = kLineHeight * (size == FigureSize::kOneColumn ? 6.0 : 4.0) + kRoom;
    const auto height = [&] {
      return 2 * kMargin + 2 * kLineHeight + head_height_ + foot +
             cell_height_ * static_cast<double>(groups_.size());
    };
    if (height() > kPageHeight && !groups_.empty()) {
      cell_height_ -= (height() - kPageHeight) / static_cast<double>(groups_.size());
      cell_height_ = std::max(cell_height_, kLineHeight);
    }
    page_.height = std::round(height());
  }

  MapDrawing Draw() {
    double y = page_.height - kMargin - 0.5 * kLineHeight;
    Text(map_.rules.title, kMargin, y, "left");
    y -= 0.5 * kLineHeight + head_height_;
    for (std::size_t c = 0; c < map_.rules.columns.size(); ++c) {
      Text(map_.rules.columns[c].label, Left(c) + 0.5 * cell_width_, y + 0.5 * kRoom,
           "left rotate by 90");
    }
    Text("hold", Left(map_.rules.columns.size()) + kRoom, y + 0.5 * kLineHeight, "left");
    for (const FoldedGroup& group : groups_) {
      y -= cell_height_;
      DrawGroup(group, y);
    }
    DrawLegend(y - kRoom - 0.5 * kLineHeight);
    return {page_, fmt::format("set encoding utf8\nset margins 0,0,0,0\nunset border\nunset tics\n"
                               "unset key\nset xrange [0:1]\nset yrange [0:1]\n{}plot -1 notitle\n",
                               commands_)};
  }

 private:
  double Left(std::size_t column) const {
    return kMargin + label_width_ + cell_width_ * static_cast<double>(column);
  }

  void Text(const std::string& text, double x, double y, std::string_view options) {
    commands_ += TextAt(page_, text, x, y, fmt::format("{} front", options));
  }

  void Box(double x, double y, double width, double height, std::string_view look) {
    commands_ += fmt::format(
        "set object rect from screen {:.5f}, screen {:.5f} to screen {:.5f}, screen {:.5f} {}\n",
        x / page_.width, y / page_.height, (x + width) / page_.width, (y + height) / page_.height,
        look);
  }

  void Shade(double x, double y, double width, double height, std::size_t shade) {
    Box(x, y, width, height,
        fmt::format("fc rgb '{}' fs solid border rgb '#9aa5b1' lw 0.4", kShades[shade]));
  }

  void Draw(const Glyph& glyph, bool hollow, double x, double y, std::string_view color) {
    if (glyph.point == 0) {
      Text(glyph.text, x, y, fmt::format("center tc rgb '{}'", color));
      return;
    }
    // hollow circles are points of the type before that of filled ones
    commands_ += TextAt(page_, "", x, y,
                        fmt::format("point pt {} ps {:g} lw 1.1 lc rgb '{}' front",
                                    hollow ? glyph.point - 1 : glyph.point, glyph.size, color));
  }

  void DrawGroup(const FoldedGroup& group, double y) {
    const std::vector<std::string> lines = Wrapped(group.label, label_letters_);
    double at = y + 0.5 * cell_height_ + 0.5 * kLineHeight * static_cast<double>(lines.size() - 1);
    for (const std::string& line : lines) {
      Text(line, kMargin, at, "left");
      at -= kLineHeight;
    }
    for (std::size_t c = 0; c < group.cells.size(); ++c) {
      const FoldedCell& cell = group.cells[c];
      const std::size_t shade = ShadeOf(cell);
      Shade(Left(c), y, cell_width_, cell_height_, shade);
      const bool hollow = cell.worst == CellState::kHolds && cell.in_doubt;
      doubts_ = doubts_ || hollow;
      Draw(GlyphOf(cell.worst), hollow, Left(c) + 0.5 * cell_width_, y + 0.5 * cell_height_,
           shade + 2 >= kShades.size() ? "#ffffff" : "#000000");
      if (!cell.fails_demand) continue;
      framed_ = true;
      Box(Left(c) + 1.0, y + 1.0, cell_width_ - 2.0, cell_height_ - 2.0,
          "front fs empty border rgb '#000000' lw 1.6");
    }
    Text(fmt::format("{:.0f} %", 100.0 * group.Share()), Left(group.cells.size()) + kRoom,
         y + 0.5 * cell_height_, "left");
  }

  // In rows: shades, then glyphs that occur.
  void DrawLegend(double y) {
    const double left = kMargin;
    double x = left;
    const auto place = [&](const std::string& text, double sample) {
      const double width = sample + WidthOf(text) + 10.0;
      if (x > left && x + width > page_.width) {
        x = left;
        y -= kLineHeight;
      }
      const double at = x;
      x += width;
      return at;
    };
    const auto words = [&](const std::string& text) { Text(text, place(text, 0.0), y, "left"); };
    words("rows of the extreme that hold:");
    constexpr const char* kShares[] = {"all", "3/4 and more", "1/2", "1/4", "fewer", "none"};
    for (std::size_t shade = 0; shade < kShades.size(); ++shade) {
      const double at = place(kShares[shade], 13.0);
      Shade(at, y - 4.0, 10.0, 8.0, shade);
      Text(kShares[shade], at + 13.0, y, "left");
    }
    x = left;
    y -= kLineHeight;
    words("the worst of them:");
    for (const CellState state : kCellStates) {
      const bool occurs = std::ranges::any_of(groups_, [state](const FoldedGroup& group) {
        return std::ranges::find(group.cells, state, &FoldedCell::worst) != group.cells.end();
      });
      if (!occurs) continue;
      const Glyph glyph = GlyphOf(state);
      const double at = place(glyph.meaning, 12.0);
      Draw(glyph, false, at + 5.0, y, "#000000");
      Text(glyph.meaning, at + 12.0, y, "left");
    }
    if (doubts_) {
      const double at = place("holds, in doubt", 12.0);
      Draw(GlyphOf(CellState::kHolds), true, at + 5.0, y, "#000000");
      Text("holds, in doubt", at + 12.0, y, "left");
    }
    if (framed_) words("frame: must hold and does not");
  }

  const FailureMap& map_;
  std::vector<FoldedGroup> groups_;
  GnuplotPage page_;
  double label_width_ = 0.0, cell_width_ = 0.0, cell_height_ = 0.0, head_height_ = 0.0;
  std::size_t label_letters_ = 0;
  bool framed_ = false, doubts_ = false;
  std::string commands_;
};

/// How bad a state is, for the worst of several: what is not applicable says nothing.
int Badness(CellState state) {
  return state == CellState::kNotApplicable ? -1 : static_cast<int>(state);
}

}  // namespace

double FoldedCell::Share() const {
  return judged == 0 ? 1.0 : static_cast<double>(holding) / static_cast<double>(judged);
}

double FoldedGroup::Share() const {
  FoldedCell all;
  for (const FoldedCell& cell : cells) {
    all.holding += cell.holding;
    all.judged += cell.judged;
  }
  return all.Share();
}

std::vector<FoldedGroup> Folded(const FailureMap& map) {
  std::vector<FoldedGroup> groups;
  for (std::size_t g = 0; g < map.cells.size(); ++g) {
    const MapGroup& rules = map.rules.groups[g];
    FoldedGroup& group = groups.emplace_back();
    group.label = rules.short_label.empty() ? rules.label : rules.short_label;
    group.rows = map.cells[g].size();
    group.cells.resize(map.rules.columns.size());
    for (const std::vector<MapCell>& row : map.cells[g]) {
      for (std::size_t c = 0; c < row.size(); ++c) {
        FoldedCell& folded = group.cells[c];
        const MapCell& cell = row[c];
        if (Badness(cell.state) > Badness(folded.worst)) folded.worst = cell.state;
        folded.judged += cell.state == CellState::kNotApplicable ? 0 : 1;
        folded.holding += cell.state == CellState::kHolds ? 1 : 0;
        folded.in_doubt = folded.in_doubt || HoldsInDoubt(cell);
        folded.fails_demand =
            folded.fails_demand || (cell.demanded && cell.state != CellState::kHolds);
      }
    }
  }
  std::ranges::stable_sort(groups, {}, &FoldedGroup::Share);
  return groups;
}

MapDrawing DrawMap(const FailureMap& map, FigureSize size) { return MapPainter(map, size).Draw(); }

std::optional<std::string> WriteMapFigure(const std::filesystem::path& path, const FailureMap& map,
                                          FigureSize size, const std::string& gnuplot) {
  const MapDrawing drawing = DrawMap(map, size);
  return DrawWithGnuplot(path, drawing.page, drawing.script, gnuplot);
}

}  // namespace loopbench::harness
