// A model in MuJoCo 2.2 (https://mujoco.org). C++17, as harness/exchange/model.h.
#pragma once

#include <memory>

#include "harness/exchange/model.h"
#include "peers/program.h"

namespace loopbench::peers {

/// The document is that of harness/exchange/export_mjcf.h, at zero, with its closures put right
/// where they do not hold there. Throws exchange::NotThere for what MJCF does not have.
///
/// MuJoCo has no error control and no projection. Steps are of one length, by its classical
/// Runge-Kutta method: 0.1 s tolerance^(1/4), which makes an error of order four proportional to
/// the tolerance. Closures are as stiff as these steps allow.
std::unique_ptr<Program> MakeMujocoProgram(const exchange::Model& model);

}  // namespace loopbench::peers
