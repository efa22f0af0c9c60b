#include "harness/generate/generated.h"

#include <algorithm>
#include <chrono>

#include "harness/generate/differentiate.h"
#include "harness/generate/print_c.h"

namespace loopbench::generate {

namespace {

// A first miss may be alone: starts at rest have branches of their own. Each further recording,
// also after one that failed, needs twice as many misses as the one before.
constexpr int kFirstMisses = 2, kMostDoublings = 20;
constexpr std::size_t kMostBranches = 8;

/// Adds the time of its life to a sum [s].
class Timer {
 public:
  explicit Timer(double& sum) : sum_(sum) {}
  ~Timer() {
    sum_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  double& sum_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace

template <class Space>
GeneratedDerivative<Space>::GeneratedDerivative(const RecordingSubject& subject,
                                                const System<Space, double>& system)
    : subject_(subject), system_(system) {
  subject_.with_work = system.size() > system.state_size();
  x_.assign(static_cast<std::size_t>(system.size()) + 1, 0.0);
  NoteStart();
  misses_left_ = kFirstMisses;
  std::vector<double> y(x_.size() - 1);
  system.ToState(start_.q, start_.u, y);
  const Timer timer(seconds_);
  AddBranch(start_.t, y);
}

template <class Space>
void GeneratedDerivative<Space>::NoteStart() {
  start_ = {system_.kinematics().time(), system_.q(), system_.u()};
  subject_.options = system_.options();
  // gains that the level has chosen meanwhile
  if (subject_.options.enforcement == Enforcement::kBaumgarte) {
    subject_.options.gains = system_.level().gains();
  }
}

template <class Space>
void GeneratedDerivative<Space>::AddBranch(double t, std::span<const double> y) {
  RecordedFunction recorded = RecordFunction(subject_, start_, t, {y.begin(), y.end()});
  for (int i = 0; i < system_.num_state_speeds(); ++i) {
    if (system_.state_speed(i) != recorded.carried_speeds[static_cast<std::size_t>(i)]) {
      throw NotCovered("the state carries other speeds in the recorded text than in double");
    }
  }
  const CompiledBranch derivative = Compile(recorded);
  branches_.insert(branches_.begin(),
                   Branch{std::make_unique<RecordedFunction>(std::move(recorded)), derivative});
}

template <class Space>
CompiledBranch GeneratedDerivative<Space>::Compile(const RecordedFunction& recorded) {
  RequireShort(recorded);
  const CompiledBranch function = CompileBranch(PrintLibrary(recorded));
  room_.resize(std::max(room_.size(), static_cast<std::size_t>(function.room)));
  return function;
}

template <class Space>
void GeneratedDerivative<Space>::ModeChanged() {
  const Timer timer(seconds_);  // graphs are large
  branches_.clear();
  NoteStart();
  attempts_ = misses_left_ = 0;  // the next evaluation is recorded
}

template <class Space>
bool GeneratedDerivative<Space>::Call(const CompiledBranch& function, std::span<double> results) {
  return function.function(x_.data(), results.data(), room_.data()) != 0;
}

template <class Space>
void GeneratedDerivative<Space>::SetInputs(double t, std::span<const double> y) {
  x_[0] = t;
  std::ranges::copy(y, x_.begin() + 1);
}

template <class Space>
bool GeneratedDerivative<Space>::Evaluate(double t, std::span<const double> y,
                                          std::span<double> ydot) {
  if (y.size() + 1 != x_.size() || ydot.size() < y.size()) return false;
  SetInputs(t, y);
  for (std::size_t i = 0; i < branches_.size(); ++i) {
    if (!Call(branches_[i].derivative, ydot)) continue;
    if (i > 0) std::swap(branches_[0], branches_[i]);
    return true;
  }
  ++misses_;
  if (--misses_left_ > 0 || branches_.size() >= kMostBranches) return false;
  misses_left_ = kFirstMisses << std::min(++attempts_, kMostDoublings);
  const Timer timer(seconds_);
  try {
    AddBranch(t, y);
  } catch (const NotCovered&) {
    return false;  // it counts as a miss
  }
  return false;
}

template <class Space>
bool GeneratedDerivative<Space>::Jacobian(double t, std::span<const double> y,
                                          std::span<double> jacobian) {
  if (y.size() + 1 != x_.size()) return false;
  SetInputs(t, y);
  for (Branch& branch : branches_) {
    const bool is_known = branch.jacobian.function != nullptr || branch.has_no_jacobian;
    if (!is_known && branch.recorded->graph.Holds(branch.recorded->graph.Values(x_))) {
      const Timer timer(seconds_);
      const std::vector<int>& inputs = branch.recorded->inputs;
      const auto columns = static_cast<std::ptrdiff_t>(jacobian.size() / y.size());
      RecordedFunction function = *branch.recorded;
      function.outputs = Differentiate(function.graph, branch.recorded->outputs,
                                       {inputs.begin() + 1, inputs.begin() + 1 + columns},
                                       function.graph.Values(x_));
      try {
        branch.jacobian = Compile(function);
      } catch (const NotCovered&) {
        branch.has_no_jacobian = true;
      }
    }
    if (branch.jacobian.function != nullptr && Call(branch.jacobian, jacobian)) return true;
  }
  ++misses_;
  return false;
}

template class GeneratedDerivative<Planar>;
template class GeneratedDerivative<Spatial>;

}  // namespace loopbench::generate
