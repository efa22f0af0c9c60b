// The program loopbench with a joint and a force more: their names are valid in every file that it
// reads, and stand in what it says about them.
//
//   loopbench_parts explain mechanism.json
//   loopbench_parts run experiment.json --out run
#include "friction.h"
#include "harness/cli/program.h"
#include "rack_and_pinion.h"

int main(int argc, char** argv) {
  own::RegisterRackAndPinion();
  loopbench::RegisterForce<own::Friction>();
  return loopbench::Main(argc, argv);
}
