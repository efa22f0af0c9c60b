// Before a run: its time, and the starts of its mechanisms.
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

// About how long the pieces of a suite take, from pilots: the same work over a part of its horizon.

class TemporaryFolder;

/// What pilots over a part of the horizon took, and with it the whole.
struct Rate {
  double process_s = 0.0;  ///< CPU time of a process that does nothing [s]
  double fixed_s = 0.0;    ///< of each run, whatever the horizon [s]
  double member = 1.0;     ///< what a member of an ensemble takes [of the unperturbed run]
  double running_s = 0.0;  ///< of the longest pilot, at its tolerance [s]
  double reached = 1.0;    ///< by it [of the horizon]
  double slope_s = 0.0;    ///< beyond it: CPU time of a whole horizon [s]
  double ends_at = 1.0;    ///< where a run failed; it will fail there again [of the horizon]
  /// When its limit of steps ends it [s].
  double most_s = std::numeric_limits<double>::infinity();

  /// CPU time that grows with the horizon, of this part of it [s].
  double Running(double part) const {
    const double to = std::min(part, ends_at);
    return std::min(
        most_s, to <= reached ? running_s * to / reached : running_s + slope_s * (to - reached));
  }
};

/// Pilots begin with 2 % of the horizon and grow until they have taken `share` of what the piece
/// would take, within bounds; the last two tell how it goes on, since many runs begin with short
/// steps. Runs that share scene, column and integrator share pilots at the loosest and, unless they
/// are short, at the finest tolerance, and the power of the tolerance between them; of a long sweep
/// eight combinations are tried. Each pilot runs in a process of its own under the limits of its
/// case; what these cut off is taken to end so as well.
class Estimate {
 public:
  struct Budget {
    double share = 0.1, least_s = 0.003, most_s = 2.0;  ///< of one pilot
    double usual_s = 4.0;  ///< of all pilots [s]: beyond it each may take less than most_s
    double all_s = 1e9;    ///< wall time of all pilots [s]; what is asked for later is not known
  };
  /// `experiments` must outlive this. Pilots are of tolerances at which a case passes `filter`.
  Estimate(const std::vector<Experiment>& experiments, const Budget& budget,
           const Selection& filter = {});
  ~Estimate();

  /// CPU time of a piece of the experiment [s], NaN where it is not known. Of a case: of its
  /// unperturbed run and its ensemble; or, if it is to be timed, of `simulations` in one process.
  double OfCase(std::size_t experiment, const Case& one, double simulations = 0.0);
  double OfReference(std::size_t experiment, const ReferenceCase& one);
  double OfLadder(std::size_t experiment, const LadderGroup& group);
  double OfTiming(std::size_t experiment, const TimingGroup& group);

  std::size_t pilots() const { return rates_.size(); }
  /// A sentence for each pilot that its limits cut off.
  const std::vector<std::string>& cut_off() const { return cut_off_; }

 private:
  struct Spent;
  std::size_t Nearest(std::size_t experiment) const;
  const std::pair<double, double>& Tolerances(std::size_t experiment);
  const Rate* Known(const std::string& key, const std::string& name, const ProcessLimits& limits,
                    double times, const std::function<Spent(double fraction)>& work);
  std::filesystem::path PlaceForRows();
  const Rate* RateOfCase(std::size_t experiment, const Case& one, double rtol);

  const std::vector<Experiment>& experiments_;
  Budget budget_;
  Selection filter_;
  std::map<std::size_t, std::pair<double, double>> tolerances_;  ///< the finest and the loosest
  double spent_s_ = 0.0;
  std::unique_ptr<TemporaryFolder> written_;  ///< for trajectories of pilots
  std::map<std::string, Rate> rates_;
  std::vector<std::string> cut_off_;
};

// Whether starts can be assembled, asked before anything is run.

/// Sentences about starts: faults of starts that cannot be assembled, values found and expected,
/// and guesses that are missed.
struct StartReport {
  std::vector<std::string> faults, warnings;
};

/// Assembles the mechanism in a child process; limits that cut it off are a fault.
StartReport CheckStart(const MechanismDescription& description, const ProcessLimits& limits);

/// The same for the scenes of an experiment's combinations as they are run, under the limits of
/// their cases, up to the first combination that has any fault. Scenes that combinations share are
/// assembled once; members of ensembles are not looked at.
StartReport CheckStarts(const std::vector<Experiment>& experiments);

}  // namespace loopbench::harness
