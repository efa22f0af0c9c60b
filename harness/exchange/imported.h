// What reading a description of another program gives.
#pragma once

#include <string>
#include <vector>

#include "harness/config/scene.h"

namespace loopbench::harness {

/// Something of the file that the mechanism does not have, or has in another way.
struct ImportNote {
  int line = 0;         ///< in the file
  std::string element;  ///< <joint name="knee">, perhaps with an attribute behind it
  std::string reason;   ///< what became of it, and why
  bool changes_motion = false;
};

struct Imported {
  std::string format;  ///< "mjcf", "urdf" or "sdf"
  MechanismDescription description;
  SceneObservation observe;
  std::vector<ImportNote> notes;  ///< by line
};

}  // namespace loopbench::harness
