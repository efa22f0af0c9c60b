// Shapes by which MuJoCo's viewer shows a mechanism; they have no mass and touch nothing.
#pragma once

#include <string>
#include <vector>

#include "harness/exchange/model.h"

namespace loopbench::exchange {

/// By body, elements `geom`: bars from its first joint to the others, or to its centre of mass
/// where it has one joint; a ball where that leaves nothing.
std::vector<std::vector<std::string>> ShapesOf(const Model& model);

}  // namespace loopbench::exchange
