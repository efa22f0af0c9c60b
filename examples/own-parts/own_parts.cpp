// The program loopbench with a joint, a force, a level of enforcement, an observer and an
// integrator more: their names are valid in every file that it reads, and stand in what it says and
// writes.
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
