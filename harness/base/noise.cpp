#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>
#include <thread>

#include "harness/base/record.h"

namespace loopbench::harness {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

void Append(std::string& reasons, const std::string& reason) {
  reasons += (reasons.empty() ? "" : "; ") + reason;
}

}  // namespace

MachineState ReadMachineState() {
  MachineState machine;
  machine.processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  if (!(std::ifstream("/proc/loadavg") >> machine.load1)) machine.load1 = kNaN;
  std::ifstream("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor") >> machine.governor;
  return machine;
}

double Quantile(std::vector<double> sample, double fraction) {
  if (sample.empty()) return kNaN;
  std::ranges::sort(sample);
  const double rank = fraction * static_cast<double>(sample.size() - 1);
  return sample[static_cast<std::size_t>(rank + 0.5)];
}

double AaSpread(const std::vector<double>& first, const std::vector<double>& second) {
  const double a = Quantile(first, 0.5), b = Quantile(second, 0.5);
  return std::abs(a - b) / std::min(a, b);
}

std::vector<std::size_t> QuietRounds(const std::vector<double>& slowest, double alone,
                                     std::size_t wanted) {
  std::vector<std::size_t> rounds(slowest.size());
  std::iota(rounds.begin(), rounds.end(), 0);
  std::ranges::stable_sort(
      rounds, {}, [&](std::size_t round) { return std::max(slowest[round], kOtherSpeed * alone); });
  rounds.resize(std::min(wanted, rounds.size()));
  std::ranges::sort(rounds);
  return rounds;
}

std::string NoiseReasons(const MachineState& machine, double aa_spread_rhs, double aa_spread_wall,
                         const NoiseThresholds& thresholds) {
  std::string reasons;
  const auto check_spread = [&](const char* of, double spread) {
    if (spread > thresholds.aa_spread) {
      Append(reasons, fmt::format("A/A spread {:.1f} % {} (quiet: up to {:.0f} %)", 100 * spread,
                                  of, 100 * thresholds.aa_spread));
    }
  };
  check_spread("of right-hand sides", aa_spread_rhs);
  check_spread("of whole simulations", aa_spread_wall);
  if (machine.load1 > thresholds.load_per_processor * machine.processors) {
    Append(reasons, fmt::format("load {:.1f} on {} processor{}", machine.load1, machine.processors,
                                machine.processors == 1 ? "" : "s"));
  }
  if (!machine.governor.empty() && machine.governor != thresholds.governor) {
    Append(reasons, fmt::format("CPU governor {}", machine.governor));
  }
  return reasons;
}

}  // namespace loopbench::harness
