// What a description of another program cannot say, beside it: loops, forces and a start, with the
// keys of mechanism files (docs/exchange.md).
#pragma once

#include <filesystem>
#include <vector>

#include "harness/config/scene.h"
#include "mechanism/description/joint_frames.h"

namespace loopbench::harness {

struct SidecarFacts {
  SceneObservation observe;
  bool has_gravity = false;
};

/// Adds to `description` what the file says; its start takes the place of the description's.
/// `at_rest` has the bodies in ground axes where all coordinates are 0: loops that are given on one
/// side close there. Throws ConfigError with all mistakes, one per line.
SidecarFacts ReadSidecar(const std::filesystem::path& path, const std::vector<Frame>& at_rest,
                         MechanismDescription* description);

}  // namespace loopbench::harness
