#include "harness/figures/axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

namespace loopbench::harness {
namespace {

std::string PowerOfTen(int exponent) {
  constexpr const char* kDigits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string power = exponent < 0 ? "10⁻" : "10";
  for (const char digit : std::to_string(std::abs(exponent))) power += kDigits[digit - '0'];
  return power;
}

int ExponentOf(double value) { return static_cast<int>(std::floor(std::log10(std::abs(value)))); }

bool IsPlain(double value) {
  return value == 0.0 || (std::abs(value) >= 0.01 && std::abs(value) < 1e5);
}

double NiceStep(double least) {
  const double power = std::pow(10.0, ExponentOf(least));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= least * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

/// Multiples of one step, all with the same digits and power of ten.
std::vector<Tick> EvenTicks(double low, double high, int most) {
  const double step = NiceStep((high - low) / most);
  const double largest = std::max(std::abs(low), std::abs(high));
  const int power = IsPlain(largest) ? 0 : ExponentOf(largest);
  const int decimals = std::clamp(power - ExponentOf(step * (1.0 + 1e-9)), 0, 15);
  std::vector<Tick> ticks;
  const double first = std::ceil(low / step - 1e-9);
  for (int i = 0; i <= most && (first + i) * step <= high + 1e-9 * step; ++i) {
    const double at = (first + i) * step;
    std::string label = fmt::format("{:.{}f}", at / std::pow(10.0, power), decimals);
    if (first + i == 0.0) label = "0";
    if (power != 0 && first + i != 0.0) label += "·" + PowerOfTen(power);
    ticks.push_back({at, label});
  }
  return ticks;
}

/// The longest part of an axis without a label, as a share of it.
double WidestGap(const Axis& axis, const std::vector<Tick>& ticks) {
  double widest = 0.0, last = 0.0;
  for (const Tick& tick : ticks) {
    if (tick.label.empty()) continue;
    widest = std::max(widest, axis.Place(tick.at) - last);
    last = axis.Place(tick.at);
  }
  return std::max(widest, 1.0 - last);
}

/// For a logarithmic axis with too few powers of ten to read it by: labels at some digits of each
/// decade, or even ones, whichever leave the shortest gaps.
std::vector<Tick> TicksBetweenDecades(const Axis& axis, int first, int last, int most) {
  constexpr std::string_view kDigits[] = {"123456789", "12357", "125", "13", "1"};
  std::vector<Tick> best = EvenTicks(axis.low, axis.high, most);
  for (const std::string_view labelled : kDigits) {
    std::vector<Tick> ticks;
    int labels = 0;
    for (int decade = first; decade <= last; ++decade) {
      for (int digit = 1; digit < 10; ++digit) {
        const double at = digit * std::pow(10.0, decade);
        if (at < axis.low * (1.0 - 1e-9) || at > axis.high * (1.0 + 1e-9)) continue;
        Tick& tick = ticks.emplace_back(Tick{at, ""});
        if (labelled.find(static_cast<char>('0' + digit)) == std::string_view::npos) continue;
        ++labels;
        tick.label =
            IsPlain(axis.high) ? fmt::format("{:.{}f}", at, std::max(0, -decade)) : NumberText(at);
      }
    }
    if (labels <= most && WidestGap(axis, ticks) < WidestGap(axis, best)) best = std::move(ticks);
  }
  return best;
}

}  // namespace

std::string NumberText(double value) {
  if (!std::isfinite(value) || IsPlain(value)) return fmt::format("{:.6g}", value);
  const std::string text = fmt::format("{:.5e}", value);
  const std::size_t e = text.find('e');
  std::string mantissa = text.substr(0, e);
  mantissa.erase(mantissa.find_last_not_of('0') + 1);
  if (mantissa.ends_with('.')) mantissa.pop_back();
  const std::string power = PowerOfTen(std::stoi(text.substr(e + 1)));
  if (mantissa == "1") return power;
  return mantissa == "-1" ? "-" + power : mantissa + "·" + power;
}

Axis AxisRange::WithMargin(double margin) const {
  if (low_ > high_)
    return {.low = logarithmic_ ? 0.1 : 0.0, .high = 1.0, .logarithmic = logarithmic_};
  if (logarithmic_) {
    const double extent = std::log(high_ / low_);
    const double room = std::max(margin * extent, extent < 0.2 ? 0.2 : 0.0);
    return {std::max(low_ * std::exp(-room), std::numeric_limits<double>::min()),
            std::min(high_ * std::exp(room), std::numeric_limits<double>::max()), true};
  }
  const double magnitude = std::max(std::abs(low_), std::abs(high_));
  const double least = magnitude > 0.0 ? 1e-3 * magnitude : 1.0;
  const double room = std::max(margin * (high_ - low_), high_ - low_ < least ? least : 0.0);
  return {low_ - room, high_ + room, false};
}

std::vector<Tick> Ticks(const Axis& axis, int most) {
  if (!axis.logarithmic) return EvenTicks(axis.low, axis.high, most);
  const int first = static_cast<int>(std::ceil(std::log10(axis.low) - 1e-9));
  const int last = static_cast<int>(std::floor(std::log10(axis.high) + 1e-9));
  if (last - first < 2) return TicksBetweenDecades(axis, first - 1, last, most);
  const int step = (last - first) / most + 1;
  std::vector<Tick> ticks;
  for (int decade = first - 1; decade <= last; ++decade) {
    const double at = std::pow(10.0, decade);
    if (decade >= first) ticks.push_back({at, decade % step == 0 ? PowerOfTen(decade) : ""});
    for (int digit = 2; step == 1 && digit < 10; ++digit) {
      if (digit * at >= axis.low && digit * at <= axis.high) ticks.push_back({digit * at, ""});
    }
  }
  return ticks;
}

}  // namespace loopbench::harness
