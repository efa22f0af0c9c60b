// Curves that coincide, drawn as one.
#include <algorithm>
#include <set>
#include <string>
#include <utility>
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

/// The values of each property: {{"odca", "lagrange"}, {"joint"}} is "odca = lagrange, joint".
using Product = std::vector<std::vector<std::string>>;

/// The only property in which both differ; the number of properties if there is none or several.
std::size_t PlaceApart(const Product& one, const Product& other) {
  std::size_t place = one.size();
  if (one.size() != other.size()) return place;
  for (std::size_t i = 0; i < one.size(); ++i) {
    if (one[i] == other[i]) continue;
    if (place != one.size()) return one.size();
    place = i;
  }
  return place;
}

/// As few products as possible that contain all `labels`, and no others.
std::vector<Product> ProductsOf(const std::vector<std::string>& labels) {
  std::vector<Product> products;
  for (const std::string& label : labels) {
    Product& product = products.emplace_back();
    for (const std::string& part : PartsOf(label)) product.push_back({part});
  }
  for (std::size_t i = 0; i < products.size();) {
    const auto other = std::find_if(
        products.begin() + static_cast<std::ptrdiff_t>(i) + 1, products.end(),
        [&](const Product& one) { return PlaceApart(products[i], one) < products[i].size(); });
    if (other == products.end()) {
      ++i;
      continue;
    }
    const std::size_t place = PlaceApart(products[i], *other);
    for (const std::string& value : (*other)[place]) products[i][place].push_back(value);
    products.erase(other);
    i = 0;
  }
  return products;
}

std::size_t NumberOfValues(const std::vector<std::string>& labels, std::size_t place) {
  std::set<std::string> values;
  for (const std::string& label : labels) {
    const std::vector<std::string> parts = PartsOf(label);
    if (place < parts.size()) values.insert(parts[place]);
  }
  return values.size();
}

// "odca = lagrange, joint"; `all` are the labels of the panel.
std::string LabelOfSeveral(const std::vector<std::string>& labels,
                           const std::vector<std::string>& all) {
  std::vector<std::string> products;
  for (const Product& product : ProductsOf(labels)) {
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < product.size(); ++i) {
      const bool is_any =
          i > 0 && product[i].size() > 1 && product[i].size() == NumberOfValues(all, i);
      texts.push_back(is_any ? "all" : Joined(product[i], " = "));
    }
    products.push_back(Joined(texts, ", "));
  }
  return Joined(products, " and ");
}

bool MayMerge(const Curve& curve) {
  return curve.merges && !curve.label.empty() && !curve.ends_early;
}

/// The failed runs of a curve alone, which keep its colour if it is drawn as one with others.
Curve FailuresOf(Curve* curve) {
  return {.style = curve->style, .merges = false, .crosses = std::exchange(curve->crosses, {})};
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
  std::vector<Curve> failures;
  for (Curve curve : panel.curves) {
    const std::vector<Point> all = Drawable(area, curve);
    const std::vector<Point> own = curve.line ? Decimated(area, all) : all;
    std::size_t i = 0;
    for (; i < merged.size(); ++i) {
      const bool alike = MayMerge(curve) && MayMerge(merged[i]) && curve.line == merged[i].line &&
                         curve.style.doubtful == merged[i].style.doubtful;
      if (alike && Coincide(area, own, points[i], curve.line)) break;
    }
    if (i == merged.size()) {
      merged.push_back(curve);
      points.push_back(own);
      labels.push_back({curve.label});
      continue;
    }
    if (std::ranges::find(labels[i], curve.label) == labels[i].end()) {
      labels[i].push_back(curve.label);
    }
    for (Curve* one : {&merged[i], &curve}) {
      if (!one->crosses.empty()) failures.push_back(FailuresOf(one));
    }
    merged[i].hollow.insert(merged[i].hollow.end(), curve.hollow.begin(), curve.hollow.end());
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
  merged.insert(merged.end(), failures.begin(), failures.end());
  return merged;
}

}  // namespace loopbench::harness
