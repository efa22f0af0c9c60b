// Checks if the machine is quiet enough to compare times: three criteria with thresholds.
#pragma once

#include <string>
#include <vector>

namespace loopbench::harness {

/// State of the machine during timing.
struct MachineState {
  double load1 = 0;    ///< load average of the last minute: processes that run or are ready to run
  int processors = 1;  ///< processors that this process may use
  std::string governor;  ///< frequency governor of the processor, "" if unreadable (as on most VMs)
};

/// Reads /proc/loadavg and cpufreq's governor. `load1` is NaN if it cannot be read.
MachineState ReadMachineState();

/// Returns the value at a fraction of the sorted sample (nearest rank); NaN for an empty one.
double Quantile(std::vector<double> sample, double fraction);

/// Returns the A/A spread: one subject timed twice as if it were two methods, alternating batch by
/// batch. The relative difference of the medians, |a - b| / min(a, b), is the apparent difference
/// of two equal methods. NaN if either sample is empty.
double AaSpread(const std::vector<double>& first, const std::vector<double>& second);

struct NoiseThresholds {
  /// 2 % is the smallest difference that `compare` reports as an effect. If equal subjects differ
  /// by more, no such difference is credible.
  double aa_spread = 0.02;

  /// Runnable processes per processor. Up to 1 the timed process has a free processor; above, the
  /// system takes turns. (After accuracy runs of the same command the load comes from their jobs,
  /// so a smaller threshold would blame the program itself.)
  double load_per_processor = 1.0;

  /// Other governors change the frequency with the load, so that the first batches are slower.
  std::string governor = "performance";
};

/// Times whose calibrations (harness/timing/calibration.h) differ by more than this factor count as
/// times of two machines. On an idle machine, medians of the calibration differ by less than 1 %;
/// with a loaded host or a lower clock they are 5 % longer or more.
inline constexpr double kOtherSpeed = 1.03;

/// Returns `wanted` rounds of measurements, ascending: first the rounds in which no calibration
/// took longer than on an idle machine, in order, then the least disturbed ones.
/// @param slowest  longest calibration of each round [ns]
/// @param alone    calibration of the idle machine [ns]
std::vector<std::size_t> QuietRounds(const std::vector<double>& slowest, double alone,
                                     std::size_t wanted);

/// Returns the reasons why the machine counts as noisy, as one sentence such as "A/A spread 5.1 %
/// (quiet: up to 2 %)"; "" if it counts as quiet. NaN is no reason: the value was not measured.
std::string NoiseReasons(const MachineState& machine, double aa_spread_rhs, double aa_spread_wall,
                         const NoiseThresholds& thresholds = {});

}  // namespace loopbench::harness
