// loopbench with peers: the command line of harness/cli/main.cpp in builds with LOOPBENCH_PEERS.
#include "harness/cli/program.h"
#include "peers/register.h"

int main(int argc, char** argv) {
  loopbench::peers::RegisterPeers();
  return loopbench::Main(argc, argv);
}
