// Curves that coincide, drawn as one.
#include <algorithm>
#include <string>
#include <vector>

#include "harness/figures/drawn_points.h"
#include "harness/figures/panel.h"

namespace loopbench::harness {
namespace {

std::vector<std::string> PartsOf(const std::string& label) {
  std::vector<std::string> parts;
  for (std::size_t from = 0; from <= label.size();) {
    const std::size_t end = std::min(label.find(", ", from), label.size());
    parts.push_back(label.substr(from, end - from));
    from = end + 2;
  }
  return parts;
}

std::string Joined(const std::vector<std::string>& words, const char* between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

// The different parts of labels at each place; empty where labels have different numbers of them.
std::vector<std::vector<std::string>> ValuesOf(const std::vector<std::string>& labels) {
  std::vector<std::vector<std::string>> values;
  for (const std::string& label : labels) {
    const std::vector<std::string> parts = PartsOf(label);
    if (values.empty()) values.resize(parts.size());
    if (parts.size() != values.size()) return {};
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (std::ranges::find(values[i], parts[i]) == values[i].end()) values[i].push_back(parts[i]);
    }
  }
  return values;
}

// "odca = lagrange, joint" where the labels are all combinations, else one after the other. `all`
// are those of the panel.
std::string LabelOfSeveral(const std::vector<std::string>& labels,
                           const std::vector<std::string>& all) {
  const auto values = ValuesOf(labels), possible = ValuesOf(all);
  std::size_t combinations = values.empty() ? 0 : 1;
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < values.size(); ++i) {
    combinations *= values[i].size();
    const bool is_any = i > 0 && values[i].size() > 1 && i < possible.size() &&
                        values[i].size() == possible[i].size();
    texts.push_back(is_any ? "all" : Joined(values[i], " = "));
  }
  return combinations == labels.size() ? Joined(texts, ", ") : Joined(labels, " = ");
}

bool MayMerge(const Curve& curve) {
  return curve.merges && curve.line && !curve.label.empty() && !curve.ends_early &&
         curve.crosses.empty() && curve.hollow.empty();
}

/// The look of `one` where `other` has the same, else black, solid, unmarked.
void KeepCommon(const CurveStyle& other, CurveStyle* one) {
  const CurveStyle several;
  if (one->color != other.color) one->color = several.color;
  if (one->dash != other.dash) one->dash = several.dash;
  if (one->shape != other.shape) one->shape = several.shape;
  one->width = std::max(one->width, other.width);
}

}  // namespace

std::vector<Curve> MergedCurves(const Figure& panel, FigureSize size) {
  const PlotArea area = AreaOf(panel, size);
  std::vector<Curve> merged;
  std::vector<std::vector<Point>> points;
  std::vector<std::vector<std::string>> labels;
  for (const Curve& curve : panel.curves) {
    const std::vector<Point> own = Decimated(area, Drawable(area, curve));
    std::size_t i = 0;
    for (; i < merged.size(); ++i) {
      const bool alike = MayMerge(curve) && MayMerge(merged[i]) &&
                         curve.style.doubtful == merged[i].style.doubtful;
      if (alike && Coincide(area, own, points[i])) break;
    }
    if (i == merged.size()) {
      merged.push_back(curve);
      points.push_back(own);
      labels.push_back({curve.label});
      continue;
    }
    if (curve.label != labels[i].front()) labels[i].push_back(curve.label);
    KeepCommon(curve.style, &merged[i].style);
    if (merged[i].remark.ends_with('?') && !curve.remark.ends_with('?')) {
      merged[i].remark = curve.remark;  // the one that is resolved
      merged[i].guide = curve.guide;
    }
  }
  std::vector<std::string> all;
  for (const Curve& curve : panel.curves) {
    if (curve.merges && !curve.label.empty()) all.push_back(curve.label);
  }
  for (std::size_t i = 0; i < merged.size(); ++i) {
    merged[i].several = labels[i].size() > 1;
    if (merged[i].several) merged[i].label = LabelOfSeveral(labels[i], all);
  }
  return merged;
}

}  // namespace loopbench::harness
