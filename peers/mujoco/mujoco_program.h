// A model in MuJoCo 2.2 (https://mujoco.org). C++17, as harness/exchange/model.h.
#pragma once

#include <memory>

#include "harness/exchange/model.h"
#include "peers/program.h"

namespace loopbench::peers {

/// Makes the program from the document of harness/exchange/export_mjcf.h at zero, and corrects
/// closures that do not hold there. Throws exchange::Unsupported for parts that MJCF does not have.
///
/// MuJoCo has no error control and no projection. The fixed step of its classical Runge-Kutta
/// method is 0.1 s tolerance^(1/4): its error of order four is then proportional to the tolerance.
/// Closures are as stiff as these steps allow.
std::unique_ptr<Program> MakeMujocoProgram(const exchange::Model& model);

}  // namespace loopbench::peers
