// The program loopbench as a function: for programs that first register formulations of their own
// (harness/config/formulations.h; examples/own-formulation/).
#pragma once

namespace loopbench {

/// Runs the command line `argv` and returns the exit code of the process: 0 done, 1 a gate failed,
/// 2 could not measure or bad input. Call it once, from main(): it sets up standard output and ends
/// with what could not be written there, and its cases run in processes forked from this one.
int Main(int argc, char** argv);

}  // namespace loopbench
