// A Model as a C++17 program of its own that builds it in Simbody 3.7.
#pragma once

#include <string>
#include <vector>

#include "harness/exchange/model.h"

namespace loopbench::exchange {

struct SimbodyProgramText {
  std::string program;  ///< one .cpp file
  std::vector<Note> notes;
};

/// Without arguments the program prints coordinates, speeds and accelerations of all joints and the
/// places of all bodies and named points at Model::q and Model::u, as JSON; with a time [s] and an
/// accuracy the same after it has integrated to there. Users' names stand in it as string literals
/// and in comments, in ASCII or escaped. Throws NotThere for what Simbody does not have here
/// (export_simbody_parts.h).
SimbodyProgramText WriteSimbodyProgram(const Model& model);

}  // namespace loopbench::exchange
