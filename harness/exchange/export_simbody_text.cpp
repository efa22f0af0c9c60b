#include "harness/exchange/export_simbody_text.h"

#include "harness/exchange/export_names.h"

namespace loopbench::exchange {
namespace {

constexpr const char* kHead = R"(//
// Debian's libsimbody-dev has Simbody. To compile and run:
//   g++ -std=c++17 -O2 -isystem /usr/include/simbody FILE.cpp -o FILE -lSimTKsimbody -lSimTKmath -lSimTKcommon
//   ./FILE              JSON: the start with its accelerations
//   ./FILE 1            the same after 1 s
//   ./FILE 1 1e-10      by a smaller error of a step (1e-8 where it is not said)
//
)";

// The texts are files of their own: a program prints in other ways than Loopbench does.
constexpr const char* kDeclarations =
#include "harness/exchange/export_simbody_begin.inc"
    ;
constexpr const char* kTail =
#include "harness/exchange/export_simbody_end.inc"
    ;

}  // namespace

std::string SimbodyHead(const std::string& name, const std::vector<Note>& notes) {
  return CommentLines("// ",
                      "\"" + name +
                          "\", a mechanism of Loopbench at its assembled start, as a program "
                          "for Simbody 3.7. SI units, angles in rad.") +
         kHead + CommentOfNotes("// ", notes) + kDeclarations;
}

std::string SimbodyTail() { return kTail; }

}  // namespace loopbench::exchange
