// Before a run: its estimated time, and checks of the start states.
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/isolation/processes.h"
#include "harness/suite/reference_cases.h"
#include "harness/timing/time_cases.h"

namespace loopbench::harness {

// Estimates the time of the pieces of a suite from pilots: the same work over a shorter horizon.

class TemporaryFolder;

/// CPU times measured by pilots, and the extrapolation to the full horizon.
struct Rate {
  double process_s = 0.0;  ///< CPU time of an empty process [s]
  double fixed_s = 0.0;    ///< per run, independent of the horizon [s]
  double member = 1.0;     ///< CPU time of an ensemble member [relative to the unperturbed run]
  double running_s = 0.0;  ///< CPU time of the longest pilot, at its tolerance [s]
  double reached = 1.0;    ///< part covered by this pilot [of the horizon]
  double slope_s = 0.0;    ///< slope beyond it: CPU time of a whole horizon [s]
  double ends_at = 1.0;    ///< part at which a run failed, and will again [of the horizon]
  /// CPU time at which the step limit ends the run [s].
  double most_s = std::numeric_limits<double>::infinity();

  /// Returns the CPU time that grows with the horizon, for this part of it [s].
  double Running(double part) const {
    const double to = std::min(part, ends_at);
    return std::min(
        most_s, to <= reached ? running_s * to / reached : running_s + slope_s * (to - reached));
  }
};

/// Pilots begin with 2 % of the horizon and grow until they have used `share` of the estimated time
/// of the piece, within bounds. The last two give the slope, since many runs begin with short
/// steps. Runs with equal problem, method and integrator share pilots at the loosest tolerance and,
/// unless they are short, at the finest. A power law interpolates between them. For a long sweep
/// eight combinations are tried. Each pilot runs in its own process under the limits of its case.
/// If these stop it, the case is assumed to end in the same way.
class Estimate {
 public:
  struct Budget {
    double share = 0.1, least_s = 0.003, most_s = 2.0;  ///< per pilot
    double usual_s = 4.0;  ///< all pilots [s]: beyond it each may use less than most_s
    double all_s = 1e9;    ///< wall time of all pilots [s]; later requests remain unknown
  };
  /// `experiments` must outlive this. Pilots use tolerances of cases that pass `filter`.
  Estimate(const std::vector<Experiment>& experiments, const Budget& budget,
           const Selection& filter = {});
  ~Estimate();

  /// Returns the CPU time of a piece of the experiment [s], NaN if unknown. A case includes its
  /// unperturbed run and its ensemble, or, if timed, `simulations` runs in one process.
  double OfCase(std::size_t experiment, const Case& one, double simulations = 0.0);
  double OfReference(std::size_t experiment, const ReferenceCase& one);
  double OfLadder(std::size_t experiment, const LadderGroup& group);
  double OfTiming(std::size_t experiment, const TimingGroup& group);

  std::size_t pilots() const { return rates_.size(); }
  /// Returns a sentence for each pilot stopped by its limits.
  const std::vector<std::string>& cut_off() const { return cut_off_; }

 private:
  struct PilotCost;
  std::size_t Nearest(std::size_t experiment) const;
  const std::pair<double, double>& Tolerances(std::size_t experiment);
  const Rate* Known(const std::string& key, const std::string& name, const ProcessLimits& limits,
                    double times, const std::function<PilotCost(double fraction)>& work);
  std::filesystem::path PlaceForRows();
  const Rate* RateOfCase(std::size_t experiment, const Case& one, double rtol);

  const std::vector<Experiment>& experiments_;
  Budget budget_;
  Selection filter_;
  std::map<std::size_t, std::pair<double, double>> tolerances_;  ///< finest and loosest
  double spent_s_ = 0.0;
  std::unique_ptr<TemporaryFolder> written_;  ///< for trajectories of pilots
  std::map<std::string, Rate> rates_;
  std::vector<std::string> cut_off_;
};

// Checks before any run that the start states can be assembled.

/// Sentences about starts: faults (not assembled, with found and expected values) and warnings
/// (initial guesses that are not met).
struct StartReport {
  std::vector<std::string> faults, warnings;
};

/// Assembles the mechanism in a child process; exceeding the limits is a fault.
StartReport CheckStart(const MechanismDescription& description, const ProcessLimits& limits);

/// Checks the problems of an experiment's combinations as they are run, under the limits of their
/// cases, up to the first combination with a fault. Shared problems are assembled once; members of
/// ensembles are not checked.
StartReport CheckStarts(const std::vector<Experiment>& experiments);

/// Throws ConfigError for mechanisms that do not have the degrees of freedom that their files
/// expect, analysed in a child process; exceeding the limits is an error, too.
void RequireFreedom(const MechanismFile& file, const ProcessLimits& limits);
void RequireFreedom(const std::vector<Experiment>& experiments);

}  // namespace loopbench::harness
