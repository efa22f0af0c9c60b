// Equations of motion of a mechanism as C99 code, recorded by harness/generate/. Includes names and
// units of the state, an example and a build file. No heap, no library except math.h.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "harness/generate/record.h"

namespace loopbench::exchange {

/// A state of a motion.
struct MotionState {
  double t = 0.0;
  std::vector<double> y;
};

struct CodeRequest {
  generate::RecordingSubject subject;    ///< its quantity is set here
  std::vector<std::string> provenance;   ///< lines of a comment: program, file, method
  std::vector<MotionState> motion = {};  ///< the first is the start
  generate::RecordingStart start = {};
  double step = 1e-3;  ///< of the example's integrator [s]
};

/// One generated C function.
struct CodeFunction {
  std::string name;
  int branches = 0;             ///< recorded
  std::int64_t operations = 0;  ///< of the first branch
  std::size_t missed = 0;       ///< number of motion states that no branch covers
};

struct CodeFile {
  std::string name, text;
};

/// Generated code: identifier, names, counts, files.
struct Code {
  std::string identifier;  ///< prefix of its functions: the mechanism's name as a C identifier
  int num_q = 0, num_rows = 0;
  std::vector<std::string> state_names, state_units, body_names;
  std::vector<double> start;                                    ///< state at the start
  std::vector<std::pair<std::string, std::string>> pose_words;  ///< numbers of a pose, with units
  std::vector<CodeFunction> functions;
  std::vector<CodeFile> files;  ///< NAME.h, NAME.c, NAME_example.c, CMakeLists.txt
};

/// Records each function per branch, at most kMaxCodeBranches + 1 times. Throws NotCovered.
Code MakeCode(const CodeRequest& request);

inline constexpr int kMaxCodeBranches = 16;

/// Returns the words of all texts: ID, the identifier, and UP, the same in capitals.
std::map<std::string, std::string> WordsOf(const Code& code);

/// Returns the bytes of an archive with the code as a Functional Mock-up Unit: FMI 2.0 for model
/// exchange and for co-simulation, with sources and a binary for 64-bit Linux. They depend only on
/// the code and the compiler. Throws generate::NotCovered if there is no C compiler.
///
/// Variables: the state, its derivatives, energies and poses. Co-simulation integrates by the
/// classical Runge-Kutta method of order 4, in steps of at most `step` [s], and projects after each
/// communication step.
std::string MakeFmu(const Code& code, const std::string& model_name, double step);

}  // namespace loopbench::exchange
