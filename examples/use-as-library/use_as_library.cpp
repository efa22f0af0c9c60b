// A mechanism built and integrated in C++: a parallelogram of unit bars falls for two seconds, its
// loop closed by O-DCA and held closed after every step.
#include <cmath>
#include <cstdio>
#include <vector>

#include "harness/config/formulations.h"
#include "harness/integrator/arkode.h"
#include "mechanism/description/library.h"
#include "mechanism/start/assembly.h"

using namespace loopbench;

int main() {
  // 1 window, bars at 1 rad, at rest
  const MechanismDescription description = Ladder(1, 1.0, 0.0);
  const Mechanism<Planar, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Planar>(description, mechanism);

  const auto odca =
      harness::MakeFormulation<Planar>("odca", mechanism, {.enforcement = Enforcement::kPosition});
  odca->Start(0.0, start.q, start.u);
  std::vector<double> y(static_cast<std::size_t>(odca->state_size()));
  odca->ToState(start.q, start.u, y);
  const auto energy = [&](double t) {
    odca->FromState(t, y);
    return ComputeEnergy(odca->kinematics()).total();
  };
  const double before = energy(0.0);

  harness::IntegratorOptions options;
  options.profile = "dormand-prince";
  options.rtol = options.atol = 1e-10;
  const auto observe = [&](double t, std::span<double> state) {
    return odca->BeginStep(t, state) ? harness::StepAction::kRestart
                                     : harness::StepAction::kContinue;
  };
  const auto result = harness::Integrate(*odca, 0.0, 2.0, y, options, observe);

  const double error = std::abs(energy(result.t_reached) - before);
  std::printf("%.0f s: crank at %.6f rad, energy error %s 1e-8 J\n", result.t_reached, y[0],
              error < 1e-8 ? "below" : "above");
  return error < 1e-8 ? 0 : 1;
}
