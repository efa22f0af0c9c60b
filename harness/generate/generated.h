// A system's right-hand side as generated code: recorded, compiled, loaded, called.
//
// A recording is valid if all its comparisons have their recorded outcomes (graph.h). Otherwise the
// library evaluates; after several such evaluations the branch of the current state is recorded
// too. Compiled branches stay until the mode of the system changes. Batched runs (members of an
// ensemble) call compiled code together, each in a lane of a function for kLanes states
// (mechanism/formulation/side_by_side.h); without fused multiply-add with the bits of a single run.
// In each mode a member records its first branch. If another member has recorded an equal one, both
// have the same mode and mechanism, and the member takes further branches from there.
//
// Compiled code receives the recorded constants. Two recordings share it if they differ in the
// numbers of constants alone: members of an ensemble, or cases of a sweep over lengths or masses. A
// number that is 0 or 1 simplifies the graph of its own mechanism only, which then has its own
// code.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "harness/generate/compile.h"
#include "harness/generate/record.h"
#include "mechanism/formulation/system.h"

namespace loopbench::generate {

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
  bool Jacobian(double t, std::span<const double> y, std::span<double> jacobian) override;
  void ModeChanged() override;
  std::int64_t misses() const override { return misses_; }
  double seconds() const override { return seconds_; }

  /// Branches that are compiled for the current mode.
  int branches() const { return static_cast<int>(branches_.size()); }

 private:
  /// Notes time, positions and speeds of the system, which start the mode of recordings.
  void NoteStart();
  /// Adds the branch at x_, of the batch or recorded.
  void AddBranch();
  /// Puts time and state where compiled functions read them.
  void SetInputs(double t, std::span<const double> y);
  bool Call(const Code& code, std::span<double> results);
  bool CallDerivative(const Code& code, std::span<double> ydot);
  std::shared_ptr<const Code> Compile(RecordedFunction recorded, bool in_lanes);

  struct Branch {
    std::shared_ptr<const Code> derivative;     ///< in lanes if the run has one
    std::shared_ptr<const Code> jacobian = {};  ///< compiled at its first use
    bool has_no_jacobian = false;               ///< it is too long
  };

  RecordingSubject subject_;
  const Contraction contraction_;
  const System<Space, double>& system_;
  std::unique_ptr<Lane> lane_;  ///< if other runs are beside this one
  std::vector<std::shared_ptr<const Code>>* shared_ = nullptr;  ///< by the batch, in this mode
  RecordingStart start_;
  std::vector<Branch> branches_;  ///< last used branch first
  std::vector<double> x_, room_;  ///< time and state; intermediate values
  std::int64_t misses_ = 0;
  int misses_left_ = 0;  ///< until the next branch is recorded
  int attempts_ = 0;     ///< recordings in this mode
  double seconds_ = 0.0;
};

}  // namespace loopbench::generate
