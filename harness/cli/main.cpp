// loopbench: the command line.
#include "harness/cli/program.h"

int main(int argc, char** argv) { return loopbench::Main(argc, argv); }
