// Right-hand sides as compiled code: printed, compiled, loaded, called.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "harness/generate/record.h"
#include "mechanism/formulation/system.h"

namespace loopbench::generate {

// Compiles generated C by the system's compiler and loads it.
//
// The compiler is $CC or cc, started without a shell, for at most kCompilerSeconds. Libraries stay
// in $XDG_CACHE_HOME/loopbench or ~/.cache/loopbench under names made from text, compiler and
// flags, each with a checksum at its end. A folder or file that another user owns or can write, and
// a file with a wrong checksum, is rejected. If the folder cannot be made, nothing is kept.

inline constexpr int kCompilerSeconds = 120;

/// -ffp-contract=off: the same bits as the library's general text.
inline constexpr const char* kCompilerFlags[] = {
    "-std=c99",         "-O2", "-fPIC", "-shared", "-ffp-contract=off", "-fno-math-errno",
#ifdef __AVX2__  // this program needs as much
    "-march=x86-64-v3",
#endif
};

/// Output of the compiler with these arguments. Throws NotCovered (record.h) if there is no
/// compiler or if it fails.
std::string RunCompiler(const std::vector<std::string>& arguments);

/// The function that a text defines (print_c.h); it stays loaded until the process ends.
struct CompiledBranch {
  int (*function)(const double* x, double* y, double* w) = nullptr;
  int room = 0;  ///< numbers that w has room for
};

/// Throws NotCovered (record.h) if there is no compiler, if it fails, or if the cache is rejected.
CompiledBranch CompileBranch(const std::string& text);

// A system's right-hand side as generated code: recorded, compiled, loaded, called.
//
// A recording holds where all its comparisons come out as they did (graph.h). Where they do not,
// the library evaluates; after some such evaluations the branch of the state at hand is recorded
// too. Compiled branches stay until the mode of the system changes.

template <class Space>
class GeneratedDerivative final : public CompiledDerivative {
 public:
  /// `system` has started. It and the subject's description must outlive the object.
  /// Throws NotCovered if the right-hand side at the start cannot be recorded or compiled.
  GeneratedDerivative(const RecordingSubject& subject, const System<Space, double>& system);

  bool Evaluate(double t, std::span<const double> y, std::span<double> ydot) override;
  bool Jacobian(double t, std::span<const double> y, std::span<double> jacobian) override;
  void ModeChanged() override;
  std::int64_t misses() const override { return misses_; }
  double seconds() const override { return seconds_; }

  /// Branches that are compiled for the current mode.
  int branches() const { return static_cast<int>(branches_.size()); }

 private:
  /// Notes time, positions and speeds of the system, which start the mode of recordings.
  void NoteStart();
  void AddBranch(double t, std::span<const double> y);
  /// Puts time and state where compiled functions read them.
  void SetInputs(double t, std::span<const double> y);
  bool Call(const CompiledBranch& function, std::span<double> results);
  CompiledBranch Compile(const RecordedFunction& recorded);

  struct Branch {
    std::unique_ptr<const RecordedFunction> recorded;  ///< branches are swapped often
    CompiledBranch derivative;
    CompiledBranch jacobian = {};  ///< compiled at its first use
    bool has_no_jacobian = false;  ///< it is too long
  };

  RecordingSubject subject_;
  const System<Space, double>& system_;
  RecordingStart start_;
  std::vector<Branch> branches_;  ///< the one that served last stands first
  std::vector<double> x_, room_;  ///< time and state; intermediate values
  std::int64_t misses_ = 0;
  int misses_left_ = 0;  ///< until the next branch is recorded
  int attempts_ = 0;     ///< recordings in this mode
  double seconds_ = 0.0;
};

}  // namespace loopbench::generate
