#include "harness/generate/generated.h"

#include <algorithm>
#include <array>
#include <map>

#include "harness/base/text.h"
#include "harness/generate/graph.h"
#include "harness/generate/print_c.h"
#include "mechanism/algebra/lanes.h"
#include "mechanism/formulation/side_by_side.h"

namespace loopbench::generate {

namespace {

// A first miss may be alone: starts at rest have branches of their own. Each further recording,
// also after one that failed, needs twice as many misses as the one before.
constexpr int kFirstMisses = 2, kMaxDoublings = 20;
constexpr std::size_t kMaxBranches = 8, kMaxModes = 16;

/// Recordings of one mechanism, each of them once, and by mode.
struct SharedBranches {
  using Codes = std::vector<std::shared_ptr<const Code>>;
  Codes all;
  std::map<std::pair<Quantity, std::vector<double>>, Codes> of_mode;
};

/// Calls of compiled functions by runs of one thread, kLanes runs at once.
class LaneCalls final : public SharedWork {
 public:
  static LaneCalls& Of(SideBySide& beside) {
    for (const std::unique_ptr<SharedWork>& work : beside.works) {
      if (auto* calls = dynamic_cast<LaneCalls*>(work.get())) return *calls;
    }
    auto calls = std::make_unique<LaneCalls>();
    LaneCalls& found = *calls;
    beside.works.push_back(std::move(calls));
    return found;
  }

  /// -1 if no lane is free.
  int Take() {
    const auto free = std::ranges::find(taken_, false);
    if (free == taken_.end()) return -1;
    *free = true;
    return static_cast<int>(free - taken_.begin());
  }
  void GiveBack(int lane) {
    taken_[lane] = false;
    for (auto& [function, constants] : constants_) constants.of[lane] = nullptr;
  }

  /// Branches of runs with this mechanism whose first recordings have this key.
  std::shared_ptr<SharedBranches> Shared(const void* mechanism, const std::string& first_key) {
    if (mechanism == nullptr) return std::make_shared<SharedBranches>();
    std::shared_ptr<SharedBranches>& known = shared_[{mechanism, first_key}];
    if (known == nullptr) known = std::make_shared<SharedBranches>();
    return known;
  }

  void Want(int lane, const Code& wanted, std::span<const double> x, std::span<double> y) {
    const auto grow = [](std::vector<Lanes>& numbers, std::size_t size) {
      if (numbers.size() < size) numbers.resize(size);
    };
    grow(x_, x.size());
    grow(y_, y.size());
    grow(w_, static_cast<std::size_t>(wanted.compiled.room));
    Constants& constants = constants_[wanted.compiled.function];
    grow(constants.numbers, wanted.constants.size());
    if (constants.of[lane] != &wanted) {
      constants.of[lane] = &wanted;
      SetLane(wanted.constants, lane, constants.numbers);
    }
    calls_[lane] = {&wanted, x, y};
  }
  bool Held(int lane) const { return calls_[lane].held; }

  void Do() noexcept override {
    for (const Call& first : calls_) {
      if (first.code == nullptr) continue;
      const auto function = first.code->compiled.function;
      const auto is_together = [function](const Call& call) {
        return call.code != nullptr && call.code->compiled.function == function;
      };
      for (int lane = 0; lane < kLanes; ++lane) {
        if (is_together(calls_[lane])) SetLane(calls_[lane].x, lane, x_);
      }
      const int held =
          function(reinterpret_cast<const double*>(x_.data()),
                   reinterpret_cast<const double*>(constants_[function].numbers.data()),
                   reinterpret_cast<double*>(y_.data()), reinterpret_cast<double*>(w_.data()));
      for (int lane = 0; lane < kLanes; ++lane) {
        Call& call = calls_[lane];
        if (!is_together(call)) continue;
        call.code = nullptr;
        call.held = (held >> lane & 1) != 0;
        for (std::size_t i = 0; i < call.y.size(); ++i) call.y[i] = y_[i][lane];
      }
    }
  }

 private:
  struct Call {
    const Code* code = nullptr;  ///< null if none waits
    std::span<const double> x;
    std::span<double> y;
    bool held = false;  ///< all comparisons, in the last call
  };
  /// Constants of a function in each lane, and the code that has them.
  struct Constants {
    std::vector<Lanes> numbers;
    std::array<const Code*, kLanes> of{};
  };
  static void SetLane(std::span<const double> numbers, int lane, std::vector<Lanes>& all) {
    for (std::size_t i = 0; i < numbers.size(); ++i) all[i][lane] = numbers[i];
  }

  std::array<bool, kLanes> taken_{};
  std::array<Call, kLanes> calls_;
  std::vector<Lanes> x_, y_, w_;
  std::map<decltype(CompiledBranch::function), Constants> constants_;
  std::map<std::pair<const void*, std::string>, std::shared_ptr<SharedBranches>> shared_;
};

}  // namespace

/// The lane of one run.
class Lane {
 public:
  /// Returns null without a batch or a free lane.
  static std::unique_ptr<Lane> Take(SideBySide* beside) {
    if (beside == nullptr) return nullptr;
    LaneCalls& calls = LaneCalls::Of(*beside);
    const int lane = calls.Take();
    return lane < 0 ? nullptr : std::unique_ptr<Lane>(new Lane(*beside, calls, lane));
  }
  ~Lane() { calls_.GiveBack(lane_); }
  Lane(const Lane&) = delete;
  Lane& operator=(const Lane&) = delete;

  /// Joins the runs of LaneCalls::Shared(), unless it has joined others.
  void Join(const void* mechanism, const std::string& first_key) {
    if (shared_ == nullptr) shared_ = calls_.Shared(mechanism, first_key);
  }
  /// Branches of the runs that it has joined; null before.
  SharedBranches* shared() { return shared_.get(); }

  /// Returns false if a comparison differs from its recorded outcome.
  bool Call(const Code& code, std::span<const double> x, std::span<double> y) {
    calls_.Want(lane_, code, x, y);
    beside_.Meet();
    return calls_.Held(lane_);
  }

 private:
  Lane(SideBySide& beside, LaneCalls& calls, int lane)
      : beside_(beside), calls_(calls), lane_(lane) {}

  SideBySide& beside_;
  LaneCalls& calls_;
  int lane_;
  std::shared_ptr<SharedBranches> shared_;
};

template <class Space>
GeneratedDerivative<Space>::~GeneratedDerivative() = default;

template <class Space>
GeneratedDerivative<Space>::GeneratedDerivative(const RecordingSubject& subject,
                                                const System<Space, double>& system,
                                                Contraction contraction)
    : subject_(subject),
      contraction_(contraction),
      system_(system),
      lane_(Lane::Take(system.options().beside)) {
  subject_.keeps_numbers = true;
  subject_.with_work = system.size() > system.state_size();
  x_.assign(static_cast<std::size_t>(system.size()) + 1, 0.0);
  FindMode();
  Function& derivative = mode_->functions[Quantity::kDerivative];
  derivative.misses_left = kFirstMisses;
  x_[0] = mode_->start.t;
  system.ToState(mode_->start.q, mode_->start.u, std::span(x_).subspan(1));
  const harness::ForeignWork work(seconds_);
  AddBranch(Quantity::kDerivative, derivative);
}

template <class Space>
void GeneratedDerivative<Space>::FindMode() {
  choices_.clear();
  for (const Released& released : system_.kinematics().released()) {
    choices_.push_back(released.joint);
    choices_.insert(choices_.end(), released.directions.begin(), released.directions.end());
    choices_.push_back(-1);
    choices_.insert(choices_.end(), released.moving.begin(), released.moving.end());
    choices_.push_back(-1);
  }
  system_.solver().AppendMode(choices_);
  const BaumgarteGains& gains = system_.level().gains();
  scratch_.assign({gains.alpha, gains.beta});
  scratch_.insert(scratch_.end(), choices_.begin(), choices_.end());
  const std::vector<double>& turns = system_.kinematics().whole_turns();
  scratch_.insert(scratch_.end(), turns.begin(), turns.end());
  if (mode_ != nullptr && key_ == scratch_) return;
  const harness::ForeignWork work(seconds_);  // graphs are large
  key_ = scratch_;
  if (modes_.size() >= kMaxModes && !modes_.contains(key_)) modes_.clear();
  mode_ = &modes_[key_];
  if (branches() == 0) {
    mode_->start = {system_.kinematics().time(), system_.q(), system_.u()};
    system_.solver().AppendMode(mode_->start.mode);
    mode_->start.whole_turns = turns;
  }
}

template <class Space>
void GeneratedDerivative<Space>::AddBranch(Quantity quantity, Function& function) {
  const auto holds = [&](const std::shared_ptr<const Code>& code) {
    return code->recorded.graph.Holds(code->recorded.graph.Values(x_));
  };
  const auto add = [&](std::shared_ptr<const Code> code) {
    function.branches.insert(function.branches.begin(), Branch{std::move(code)});
  };
  if (lane_ != nullptr && lane_->shared() != nullptr) {
    const SharedBranches::Codes& shared = lane_->shared()->of_mode[{quantity, key_}];
    const auto known = std::ranges::find_if(shared, holds);
    if (known != shared.end()) return add(*known);
  }
  // gains that the level has chosen meanwhile
  if (subject_.options.enforcement == Enforcement::kBaumgarte) {
    subject_.options.gains = system_.level().gains();
  }
  // Directions released for the accuracy of the input depend on the run so far.
  for (const Released& out : system_.kinematics().released()) {
    MechanismDescription& described = subject_.description;
    if (!described.rounded) continue;
    described.joints[out.joint].released = out.directions;
    described.joints[out.joint].moving = out.moving;
  }
  subject_.quantity = quantity;
  RecordedFunction recorded =
      RecordFunction(subject_, mode_->start, x_[0], {x_.begin() + 1, x_.end()});
  for (int i = 0; i < system_.num_state_speeds(); ++i) {
    if (system_.state_speed(i) != recorded.carried_speeds[static_cast<std::size_t>(i)]) {
      throw NotCovered("the state carries other speeds in the recorded text than in double");
    }
  }
  if (lane_ == nullptr) return add(Compile(std::move(recorded), false));
  if (lane_->shared() == nullptr) in_lanes_ = LiveNodes(recorded) >= subject_.least_in_lanes;
  lane_->Join(subject_.mechanism, recorded.key);
  auto& [all, of_mode] = *lane_->shared();
  auto code = std::ranges::find(all, recorded.key, [](const auto& known) -> const std::string& {
    return known->recorded.key;
  });
  if (code == all.end()) code = all.insert(code, Compile(std::move(recorded), in_lanes_));
  SharedBranches::Codes& shared = of_mode[{quantity, key_}];
  if (std::ranges::find(shared, *code) == shared.end()) shared.push_back(*code);
  add(*code);
}

template <class Space>
std::shared_ptr<const Code> GeneratedDerivative<Space>::Compile(RecordedFunction recorded,
                                                                bool in_lanes) {
  const bool own_sines = contraction_ == Contraction::kFused;
  const auto print = [&] {
    RequireShort(recorded);
    return in_lanes ? PrintLanes(recorded, kLanes, own_sines) : PrintLibrary(recorded, own_sines);
  };
  const CompiledBranch compiled =
      CompileBranch(recorded.structure + (in_lanes ? " in lanes" : ""), print, contraction_);
  std::vector<double> constants = ConstantsOf(recorded);
  return std::make_shared<Code>(Code{std::move(recorded), compiled, std::move(constants)});
}

template <class Space>
bool GeneratedDerivative<Space>::Call(const Code& code, std::span<double> results) {
  const auto room = static_cast<std::size_t>(code.compiled.room);
  if (room_.size() < room) room_.resize(room);
  return code.compiled.function(x_.data(), code.constants.data(), results.data(), room_.data()) !=
         0;
}

template <class Space>
void GeneratedDerivative<Space>::SetInputs(double t, std::span<const double> y) {
  x_[0] = t;
  std::ranges::copy(y, x_.begin() + 1);
}

template <class Space>
bool GeneratedDerivative<Space>::Compute(Quantity quantity, std::span<double> results) {
  Function& function = mode_->functions[quantity];
  auto& [branches, misses_left, attempts] = function;
  for (std::size_t i = 0; i < branches.size(); ++i) {
    const Code& code = *branches[i].code;
    if (!(in_lanes_ ? lane_->Call(code, x_, results) : Call(code, results))) continue;
    if (quantity == Quantity::kDerivative) is_regularized_ = code.recorded.is_regularized;
    if (i > 0) std::swap(branches[0], branches[i]);
    return true;
  }
  if (quantity == Quantity::kDerivative) ++misses_;
  if (--misses_left > 0 || branches.size() >= kMaxBranches) return false;
  misses_left = kFirstMisses << std::min(++attempts, kMaxDoublings);
  const harness::ForeignWork work(seconds_);
  try {
    AddBranch(quantity, function);
  } catch (const NotCovered&) {
    return false;  // it counts as a miss
  }
  return false;
}

template <class Space>
bool GeneratedDerivative<Space>::Evaluate(double t, std::span<const double> y,
                                          std::span<double> ydot) {
  if (y.size() + 1 != x_.size() || ydot.size() < y.size()) return false;
  SetInputs(t, y);
  return Compute(Quantity::kDerivative, ydot.first(y.size()));
}

template <class Space>
bool GeneratedDerivative<Space>::Project(ProjectionStep step, double t, std::span<const double> q,
                                         std::span<const double> u, std::span<double> results) {
  if (q.size() + u.size() >= x_.size()) return false;
  SetInputs(t, q);
  std::ranges::copy(u, x_.begin() + 1 + std::ssize(q));
  constexpr Quantity kOfStep[] = {Quantity::kMismatch, Quantity::kPositionStep,
                                  Quantity::kSpeedStep};
  return Compute(kOfStep[static_cast<int>(step)], results);
}

template <class Space>
bool GeneratedDerivative<Space>::Jacobian(double t, std::span<const double> y,
                                          std::span<double> jacobian) {
  if (y.size() + 1 != x_.size()) return false;
  SetInputs(t, y);
  for (Branch& branch : mode_->functions[Quantity::kDerivative].branches) {
    const RecordedFunction& recorded = branch.code->recorded;
    const bool is_known = branch.jacobian != nullptr || branch.has_no_jacobian;
    if (!is_known && recorded.graph.Holds(recorded.graph.Values(x_))) {
      const harness::ForeignWork work(seconds_);
      const std::vector<int>& inputs = recorded.inputs;
      const auto columns = static_cast<std::ptrdiff_t>(jacobian.size() / y.size());
      RecordedFunction function = recorded;
      function.outputs = Differentiate(function.graph, recorded.outputs,
                                       {inputs.begin() + 1, inputs.begin() + 1 + columns},
                                       function.graph.Values(x_));
      function.structure = function.graph.Structure(function.outputs);
      try {
        branch.jacobian = Compile(std::move(function), false);
      } catch (const NotCovered&) {
        branch.has_no_jacobian = true;
      }
    }
    if (branch.jacobian != nullptr && Call(*branch.jacobian, jacobian)) return true;
  }
  ++misses_;
  return false;
}

template class GeneratedDerivative<Planar>;
template class GeneratedDerivative<Spatial>;

}  // namespace loopbench::generate
