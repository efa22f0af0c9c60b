// The program loopbench with a joint, a force, a level of enforcement and an observer more: their
// names are valid in every file that it reads, and stand in what it says and writes.
//
//   loopbench_parts explain mechanism.json
//   loopbench_parts run experiment.json --out run
#include "friction.h"
#include "half_velocity.h"
#include "harness/cli/program.h"
#include "largest_speed.h"
#include "rack_and_pinion.h"

int main(int argc, char** argv) {
  own::RegisterRackAndPinion();
  loopbench::RegisterForce<own::Friction>();
  loopbench::RegisterLevel(own::HalfVelocityRow());
  loopbench::harness::RegisterObserver(own::LargestSpeedRow());
  return loopbench::Main(argc, argv);
}
