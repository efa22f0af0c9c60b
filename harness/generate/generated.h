// A system's right-hand side and steps of level projection as generated code.
//
// A recording is valid if all its comparisons have their recorded outcomes (graph.h). Otherwise the
// library evaluates; after several such evaluations the branch of the current state is recorded
// too. Branches are valid in one mode of the system; earlier modes keep theirs. Batched runs
// (members of an ensemble) call compiled code together, each in a lane of a function for kLanes
// states (mechanism/formulation/side_by_side.h); without fused multiply-add with the bits of a
// single run. Each lane has its own constants, so cases of a sweep share a call, too. Short code is
// called alone (record.h). Each run records its first branch. Members of an ensemble with equal
// first branches share their branches of all modes.
//
// Compiled code receives the recorded constants. Two recordings share it if they differ in the
// numbers of constants alone. A constant of 0 or 1 simplifies the graph.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "harness/generate/record.h"
#include "mechanism/formulation/system.h"

namespace loopbench::generate {

// Compiled code: generated C, compiled by the system's compiler and loaded.
//
// The compiler is $CC or cc, started without a shell, for at most kCompilerSeconds. Libraries stay
// in $XDG_CACHE_HOME/loopbench or ~/.cache/loopbench under names made from text, compiler and
// flags, each with a checksum at its end. A folder or file that another user owns or can write, and
// a file with a wrong checksum, is rejected. If the folder cannot be made, nothing is kept.

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

/// The function that a text defines (print_c.cpp); it stays loaded until the process ends.
struct CompiledBranch {
  int (*function)(const double* x, const double* c, double* y, double* w) = nullptr;
  int room = 0;  ///< numbers that w has room for
};

/// Compiles the text that `print` returns; `key` names it within the process, which prints it once.
/// Throws NotCovered (record.h) if there is no compiler, if it fails, or if the cache is rejected.
CompiledBranch CompileBranch(const std::string& key, const std::function<std::string()>& print,
                             Contraction contraction = Contraction::kNone);

class Lane;

/// A recorded function and its compiled text, with the constants that the text receives.
struct Code {
  RecordedFunction recorded;
  CompiledBranch compiled;
  std::vector<double> constants;
};

template <class Space>
class GeneratedDerivative final : public CompiledDerivative {
 public:
  /// `system` has started. It and the subject's description must outlive the object.
  /// Throws NotCovered if the right-hand side at the start cannot be recorded or compiled.
  GeneratedDerivative(const RecordingSubject& subject, const System<Space, double>& system,
                      Contraction contraction = Contraction::kNone);
  ~GeneratedDerivative() override;

  bool Evaluate(double t, std::span<const double> y, std::span<double> ydot) override;
  bool is_regularized() const override { return is_regularized_; }
  bool Jacobian(double t, std::span<const double> y, std::span<double> jacobian) override;
  bool Project(ProjectionStep step, double t, std::span<const double> q, std::span<const double> u,
               std::span<double> results) override;
  void StepAccepted() override { FindMode(); }
  std::int64_t misses() const override { return misses_; }
  double seconds() const override { return seconds_; }

  /// Branches of a function for the current mode: dy/dt, or a step of level projection.
  int branches(Quantity quantity = Quantity::kDerivative) const {
    const auto found = mode_->functions.find(quantity);
    return found == mode_->functions.end() ? 0 : static_cast<int>(found->second.branches.size());
  }
  /// Modes with branches.
  int modes() const { return static_cast<int>(modes_.size()); }

 private:
  /// Makes mode_ the mode of the system.
  void FindMode();
  struct Function;
  /// Adds the branch at x_, of the batch or recorded.
  void AddBranch(Quantity quantity, Function& function);
  /// Puts time and state where compiled functions read them.
  void SetInputs(double t, std::span<const double> y);
  /// Returns false if no branch is valid at x_. After several such calls that of x_ is added.
  bool Compute(Quantity quantity, std::span<double> results);
  bool Call(const Code& code, std::span<double> results);
  std::shared_ptr<const Code> Compile(RecordedFunction recorded, bool in_lanes);

  struct Branch {
    std::shared_ptr<const Code> code;           ///< for lanes if in_lanes_
    std::shared_ptr<const Code> jacobian = {};  ///< of dy/dt, compiled at its first use
    bool has_no_jacobian = false;               ///< it is too long
  };
  struct Function {
    std::vector<Branch> branches;  ///< last used branch first
    int misses_left = 0;           ///< until the next branch is recorded
    int attempts = 0;              ///< recordings
  };
  using ModeKey = std::vector<double>;  ///< released directions, gains, choices of the solver
  struct Mode {
    RecordingStart start;  ///< where the system came into it
    std::map<Quantity, Function> functions;
  };

  RecordingSubject subject_;
  const Contraction contraction_;
  const System<Space, double>& system_;
  std::unique_ptr<Lane> lane_;  ///< if other runs are beside this one
  bool in_lanes_ = false;       ///< true: runs call code together; false: they share recordings
  std::map<ModeKey, Mode> modes_;
  Mode* mode_ = nullptr;
  ModeKey key_, scratch_;  ///< of mode_
  std::vector<int> choices_;
  std::vector<double> x_, room_;  ///< time and state; intermediate values
  bool is_regularized_ = false;
  std::int64_t misses_ = 0;
  double seconds_ = 0.0;
};

}  // namespace loopbench::generate
