// Is the machine quiet enough for its times to be compared? Three signs, each with a threshold.
#pragma once

#include <string>
#include <vector>

namespace loopbench::harness {

/// What is seen of the machine while it times.
struct MachineState {
  double load1 = 0;    ///< load average of the last minute: processes that run or want to
  int processors = 1;  ///< those that this process may use
  std::string
      governor;  ///< of the processor's frequency, "" when it cannot be read (as on most VMs)
};

/// Reads /proc/loadavg and cpufreq's governor. `load1` is NaN where it cannot be read.
MachineState ReadMachineState();

/// Value at a fraction of the sorted sample (nearest rank); NaN for an empty one.
double Quantile(std::vector<double> sample, double fraction);

/// A/A spread: one subject timed twice as if it were two columns, batch by batch in turn. The
/// relative difference of the two medians, |a - b| / min(a, b), is what a difference of two columns
/// would show if there were none. NaN when either sample is empty.
double AaSpread(const std::vector<double>& first, const std::vector<double>& second);

struct NoiseThresholds {
  /// 2 % is the least difference that `compare` calls an effect; where equal things differ by more,
  /// no such difference can be believed.
  double aa_spread = 0.02;

  /// Runnable processes per processor. Up to 1 there is a free processor for the one that is timed;
  /// above, the system takes turns. (After accuracy runs of the same command the load is that of
  /// their jobs, so a smaller threshold would blame the program itself.)
  double load_per_processor = 1.0;

  /// Other governors change the frequency with the load, so that the first batches are slower.
  std::string governor = "performance";
};

/// Times whose yardsticks (harness/timing/yardstick.h) differ by more than this factor are those of
/// two machines, as far as times of a program go. Where nothing else runs, medians of the yardstick
/// differ by less than 1 %; a host that gives less, or a lower clock, takes 5 % and more.
inline constexpr double kOtherSpeed = 1.03;

/// As many of some rounds of measurements as are `wanted`, ascending: those during which no
/// yardstick took longer than on a machine that has nothing else to do, the first of them, and then
/// the least disturbed.
/// @param slowest  by round: the longest yardstick [ns]
/// @param alone    of the machine alone [ns]
std::vector<std::size_t> QuietRounds(const std::vector<double>& slowest, double alone,
                                     std::size_t wanted);

/// The reasons why the machine counts as noisy, as one sentence without units to look up, e.g.
/// "A/A spread 5.1 % (quiet: up to 2 %)"; "" when it counts as quiet. NaN is no reason: what was
/// not measured is not known to be noisy.
std::string NoiseReasons(const MachineState& machine, double aa_spread_rhs, double aa_spread_wall,
                         const NoiseThresholds& thresholds = {});

}  // namespace loopbench::harness
