// The program loopbench with an additional joint, force, level of enforcement, observer and
// integrator. Their names are valid in all files that it reads and appear in all its output.
//
//   loopbench_parts explain mechanism.json
//   loopbench_parts run experiment.json --out run
#include "friction.h"
#include "half_velocity.h"
#include "harness/cli/program.h"
#include "harness/config/options.h"
#include "largest_speed.h"
#include "rack_and_pinion.h"

int main(int argc, char** argv) {
  own::RegisterRackAndPinion();
  loopbench::RegisterForce<own::Friction>();
  loopbench::RegisterLevel(own::HalfVelocityRow());
  loopbench::harness::RegisterObserver(own::LargestSpeedRow());
  loopbench::harness::RegisterIntegrator({.name = "ralston",
                                          .A = {{0, 0}, {2.0 / 3, 0}},
                                          .b = {0.25, 0.75},
                                          .c = {0, 2.0 / 3},
                                          .order = 2});
  return loopbench::Main(argc, argv);
}
