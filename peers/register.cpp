#include "peers/register.h"

#include "harness/run/run.h"
#include "peers/mujoco/mujoco_program.h"
#include "peers/program_peer.h"
#include "peers/simbody/simbody_program.h"

namespace loopbench::peers {

void RegisterPeers() {
  const auto add = [](const std::string& name, const ProgramFactory& make) {
    harness::RegisterPeer(name, [name, make](const MechanismDescription& description) {
      return MakeProgramPeer(name, make, description);
    });
  };
  add("peer/simbody", MakeSimbodyProgram);
  add("peer/mujoco", MakeMujocoProgram);
}

}  // namespace loopbench::peers
