// A scene as it is run: simplified descriptions, with what is observed of them
// (docs/decisions/009).
#pragma once

#include <string>
#include <vector>

#include "harness/config/scene.h"
#include "mechanism/simplify/compile.h"

namespace loopbench::harness {

struct CompiledScene {
  Compiled compiled;
  /// Names and angles are those of the compiled bodies. Scenes that observe angles are never split,
  /// so this belongs to the only part.
  SceneObservation observe;
};

/// Angles that "observe" names are measured about the user's z: such a scene stays in one piece,
/// and in space as it is.
CompiledScene CompileScene(const MechanismDescription& description, const SceneObservation& observe,
                           CompileOptions options);

/// "planar, welds": the savings that are on; "none" when none is.
std::string ToString(const CompileOptions& options);

}  // namespace loopbench::harness
