// Compiles generated C by the system's compiler and loads it.
//
// The compiler is $CC or cc, started without a shell, for at most kCompilerSeconds. Libraries stay
// in $XDG_CACHE_HOME/loopbench or ~/.cache/loopbench under names made from text, compiler and
// flags, each with a checksum at its end. A folder or file that another user owns or can write, and
// a file with a wrong checksum, is rejected. If the folder cannot be made, nothing is kept.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace loopbench::generate {

inline constexpr int kCompilerSeconds = 120;

// Without -fno-tree-slp-vectorize, GCC 12 fuses multiply-add even with -ffp-contract=off.
inline constexpr const char* kCompilerFlags[] = {
    "-std=c99",         "-O2", "-fPIC", "-shared", "-fno-math-errno", "-fno-tree-slp-vectorize",
#ifdef __AVX2__  // this program needs as much
    "-march=x86-64-v3",
#endif
#ifdef __AVX512F__
    "-mavx512f",
#endif
};

/// Rounding of a product and a sum: separate, with the bits of the library's general code, or once
/// (fused multiply-add). Fused code also computes all sines and cosines by the library's own
/// function, for all lanes at once. Its error is at most 1.1 units in the last place (lanes.h).
enum class Contraction { kNone, kFused };

/// Output of the compiler with these arguments. Throws NotCovered (record.h) if there is no
/// compiler, if it fails, or if it takes more than `seconds`. `folder` is for its temporary files.
std::string RunCompiler(const std::vector<std::string>& arguments,
                        const std::filesystem::path& folder = {}, int seconds = kCompilerSeconds);

/// The function that a text defines (print_c.h); it stays loaded until the process ends.
struct CompiledBranch {
  int (*function)(const double* x, const double* c, double* y, double* w) = nullptr;
  int room = 0;  ///< numbers that w has room for
};

/// Compiles the text that `print` returns; `key` names it within the process, which prints it once.
/// Throws NotCovered (record.h) if there is no compiler, if it fails, or if the cache is rejected.
CompiledBranch CompileBranch(const std::string& key, const std::function<std::string()>& print,
                             Contraction contraction = Contraction::kNone);

}  // namespace loopbench::generate
