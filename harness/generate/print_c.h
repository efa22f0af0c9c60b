// A graph as C99: straight-line functions of some hundred operations each, which pass values on
// through an array. The time to compile a function grows faster than its length.
#pragma once

#include <string>

#include "harness/generate/record.h"

namespace loopbench::generate {

/// Functions that printed text calls; to be printed once before it.
extern const char* const kPrintedHelpers;

/// A static function
///
///   int NAME(const double* x, double* y, double* w)
///
/// x holds the inputs, y receives the outputs, and w has room for *room numbers. It returns 0 if a
/// comparison comes out otherwise than it was recorded; y is unspecified then. It calls
/// `sines(angle, &sine, &cosine)` for the angle of a planar pose, which must be defined before.
/// The text depends on the graph alone.
std::string PrintFunction(const RecordedFunction& recorded, const std::string& name, int* room);

/// PrintFunction() as a translation unit for CompileBranch() (compile.h), which defines
///
///   void loopbench_use_sines(void (*sines)(double, double*, double*))   to be called first
///   int loopbench_function(const double* x, const double* c, double* y, double* w)
///   const int loopbench_room
///
/// c holds ConstantsOf() the function. The text contains no number, so mechanisms with other masses
/// or lengths share it.
/// With `own_sines`, the function that loopbench_use_sines() receives computes all sines.
std::string PrintLibrary(const RecordedFunction& recorded, bool own_sines = false);
/// Values of Graph::Given().
std::vector<double> ConstantsOf(const RecordedFunction& recorded);

/// Prints the same function for `lanes` states at once, in vector types of GCC and clang:
///
///   void loopbench_use_lane_sines(void (*sines)(const double*, double*, double*))
///
/// receives sines and cosines of as many angles. x, c, y and w are arrays of vectors: the numbers
/// of a quantity in all lanes follow each other. Bit i of the result is set if all comparisons come
/// out as recorded in lane i. Without fused multiply-add, lanes have PrintLibrary()'s bits.
std::string PrintLanes(const RecordedFunction& recorded, int lanes, bool own_sines = false);

}  // namespace loopbench::generate
