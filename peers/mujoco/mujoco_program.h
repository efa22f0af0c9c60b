// A model in MuJoCo 2.2 (https://mujoco.org). C++17, as model.h.
#pragma once

#include <memory>

#include "peers/model.h"
#include "peers/program.h"

namespace loopbench::peers {

/// Tree joints are chains of MuJoCo's slides, hinges and balls, joints that close loops are
/// equality constraints of points, springs and dampers its own. Throws NotThere for what has no
/// such parts: helical joints, closures other than revolute, spherical, weld and rod, forces at
/// points, preloads that no free length stands for.
///
/// MuJoCo has no error control and no projection. Its closures are soft: each is held by a spring
/// and damper (`solref`) and by forces that leave a share 1 - `solimp` of the acceleration
/// unopposed. Here they are as stiff as it allows: a time constant of two steps, and a share of
/// 1e-4. Steps are of one length, by its classical Runge-Kutta method: 0.1 s tolerance^(1/4), which
/// makes an error of order four proportional to the tolerance.
std::unique_ptr<Program> MakeMujocoProgram(const Model& model);

}  // namespace loopbench::peers
