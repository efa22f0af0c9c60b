// The program loopbench as a function, for programs that first register their own formulations
// (harness/config/formulations.h; examples/own-formulation/).
#pragma once

namespace loopbench {

/// Runs the command line `argv` and returns the exit code of the process: 0 done, 1 a gate failed,
/// 2 could not measure or bad input. Call it once, from main(): it sets up standard output, returns
/// 2 if output could not be written, and forks processes for its cases.
int Main(int argc, char** argv);

}  // namespace loopbench
