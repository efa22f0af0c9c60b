#include "harness/generate/generated.h"

#include <dlfcn.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <sstream>

#include "harness/base/text.h"
#include "harness/generate/graph.h"
#include "mechanism/algebra/lanes.h"
#include "mechanism/formulation/side_by_side.h"

namespace loopbench::generate {

namespace {

namespace fs = std::filesystem;

using harness::FailOn, harness::Fnv1a;

std::vector<std::string> Compiler() {
  const char* named = std::getenv("CC");
  std::istringstream words(named != nullptr && *named != '\0' ? named : "cc");
  return {std::istream_iterator<std::string>(words), {}};
}

/// Throws if other users could have written the file or folder.
void RequireOwn(const fs::path& path, mode_t kind) {
  struct stat found = {};
  if (::lstat(path.c_str(), &found) != 0) FailOn("look at", path);
  if ((found.st_mode & S_IFMT) == kind && found.st_uid == ::geteuid() &&
      (found.st_mode & (S_IWGRP | S_IWOTH)) == 0) {
    return;
  }
  throw NotCovered(fmt::format(
      "{}: found owner {} and mode {:o}, expected a {} of user {} that others cannot write",
      path.string(), found.st_uid, found.st_mode & 07777, kind == S_IFDIR ? "folder" : "file",
      ::geteuid()));
}

/// Returns the folder of libraries, created if missing; nothing on failure.
std::optional<fs::path> CacheFolder() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  if (cache != nullptr && *cache == '/') {
    folder = cache;
  } else if (home != nullptr && *home == '/') {
    folder = fs::path(home) / ".cache";
  } else {
    return std::nullopt;
  }
  std::error_code error;
  fs::create_directories(folder, error);
  folder /= "loopbench";
  if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) return std::nullopt;
  RequireOwn(folder, S_IFDIR);
  if (::access(folder.c_str(), W_OK | X_OK) != 0) return std::nullopt;
  return folder;
}

CompiledBranch Load(const fs::path& library) {
  void* handle = ::dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) throw NotCovered(fmt::format("generated code: {}", ::dlerror()));
  void* function = ::dlsym(handle, "loopbench_function");
  void* use_sines = ::dlsym(handle, "loopbench_use_sines");
  void* use_lane_sines = ::dlsym(handle, "loopbench_use_lane_sines");
  const void* room = ::dlsym(handle, "loopbench_room");
  if (function == nullptr || (use_sines == nullptr && use_lane_sines == nullptr) ||
      room == nullptr) {
    throw NotCovered(library.string() + ": found no loopbench_function, expected generated code");
  }
  if (use_sines != nullptr) {
    reinterpret_cast<void (*)(decltype(&PoseSines))>(use_sines)(&PoseSines);
  } else {
    reinterpret_cast<void (*)(decltype(&PoseLaneSines))>(use_lane_sines)(&PoseLaneSines);
  }
  CompiledBranch branch;
  branch.function = reinterpret_cast<decltype(branch.function)>(function);
  branch.room = *static_cast<const int*>(room);
  return branch;
}

std::vector<std::string> Flags(Contraction contraction) {
  std::vector<std::string> flags(std::begin(kCompilerFlags), std::end(kCompilerFlags));
  const bool is_fused = contraction == Contraction::kFused;
  flags.push_back(is_fused ? "-ffp-contract=fast" : "-ffp-contract=off");
  return flags;
}

/// Compiles `text` to `library`.
void Compile(const std::string& text, std::vector<std::string> arguments, const fs::path& folder,
             const fs::path& library) {
  const fs::path source = folder / "function.c";
  harness::WriteFileAtomically(source, text);
  for (const std::string& word :
       {source.string(), std::string("-o"), library.string(), std::string("-lm")}) {
    arguments.push_back(word);
  }
  RunCompiler(arguments, folder);
}

/// A kept library ends with the checksum of the bytes before it, which the loader does not read.
void RequireWhole(const fs::path& library) {
  const std::string bytes = harness::ReadFile(library);
  const std::size_t size = bytes.size() - std::min(bytes.size(), Fnv1a("").size());
  if (Fnv1a(bytes.substr(0, size)) == bytes.substr(size)) return;
  throw NotCovered(library.string() + ": found a wrong checksum, expected the file as it was " +
                   "written; remove it");
}

CompiledBranch CompileOrFind(const std::string& text, const std::vector<std::string>& flags,
                             const std::string& name, const std::optional<fs::path>& cache) {
  if (cache) {
    const fs::path kept = *cache / (name + ".so");
    if (fs::exists(fs::symlink_status(kept))) {
      RequireOwn(kept, S_IFREG);
      RequireWhole(kept);
      return Load(kept);
    }
  }
  const harness::TemporaryFolder folder("loopbench-generated");
  const fs::path library = folder.path() / "function.so";
  Compile(text, flags, folder.path(), library);
  if (cache) {
    // renamed when complete, so a concurrent process never reads an incomplete file
    const fs::path own = *cache / fmt::format("{}.{}", name, ::getpid());
    const harness::Unfinished unfinished(own);
    const std::string bytes = harness::ReadFile(library);
    std::error_code error;
    if (std::ofstream(own, std::ios::binary) << bytes << Fnv1a(bytes) << std::flush) {
      fs::permissions(own, fs::perms::owner_all, error);
      if (!error) fs::rename(own, *cache / (name + ".so"), error);
    }
  }
  return Load(library);
}

}  // namespace

std::string RunCompiler(const std::vector<std::string>& arguments, const fs::path& folder,
                        int seconds) {
  // "timeout" ends it politely, a second later in any case
  std::vector<std::string> words = {"timeout", "--kill-after=1", std::to_string(seconds)};
  const std::vector<std::string> compiler = Compiler();
  if (!folder.empty()) words.insert(words.end(), {"env", "TMPDIR=" + folder.string()});
  words.insert(words.end(), compiler.begin(), compiler.end());
  words.insert(words.end(), arguments.begin(), arguments.end());
  const harness::ProgramResult result = harness::RunProgram(words);
  const std::string name = compiler.empty() ? "CC" : compiler.front();
  if (result.error == 0 && result.status == 127) {
    throw NotCovered(fmt::format("no C compiler: '{}' not found (CC names another)", name));
  }
  if (result.error == 0 && (result.status == 124 || result.status == 128 + SIGKILL)) {
    throw NotCovered(fmt::format("{} took more than {} s", name, seconds));
  }
  const std::string failure = result.Failure(name);
  if (!failure.empty()) throw NotCovered("C compiler: " + failure);
  return result.output;
}

CompiledBranch CompileBranch(const std::string& key, const std::function<std::string()>& print,
                             Contraction contraction) {
  static std::mutex mutex;
  static std::map<std::string, CompiledBranch> loaded;
  const std::lock_guard lock(mutex);
  static std::map<std::string, std::string> versions;  // by the compiler's words
  const std::string words = fmt::format("{}", fmt::join(Compiler(), " "));
  if (!versions.contains(words)) versions[words] = RunCompiler({"--version"});
  const std::vector<std::string> flags = Flags(contraction);
  const std::string how =
      fmt::format("{}\n{}\n{}\n", words, versions[words], fmt::join(flags, " "));
  const std::optional<fs::path> cache = CacheFolder();
  const std::string place = fmt::format("{}{}\n{}", how, cache ? cache->string() : "", key);
  const auto known = loaded.find(place);
  if (known != loaded.end()) return known->second;
  const std::string text = print(), all = how + text;
  return loaded[place] = CompileOrFind(text, flags, Fnv1a(all) + Fnv1a(Fnv1a(all) + all), cache);
}

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
struct LaneCalls final : SharedWork {
  void Do() noexcept override {
    for (const Call& first : calls) {
      if (first.code == nullptr) continue;
      const auto function = first.code->compiled.function;
      const auto is_together = [function](const Call& call) {
        return call.code != nullptr && call.code->compiled.function == function;
      };
      for (int lane = 0; lane < kLanes; ++lane) {
        if (is_together(calls[lane])) SetLane(calls[lane].x, lane, x);
      }
      const int held =
          function(reinterpret_cast<const double*>(x.data()),
                   reinterpret_cast<const double*>(constants[function].numbers.data()),
                   reinterpret_cast<double*>(y.data()), reinterpret_cast<double*>(w.data()));
      for (int lane = 0; lane < kLanes; ++lane) {
        Call& call = calls[lane];
        if (!is_together(call)) continue;
        call.code = nullptr;
        call.held = (held >> lane & 1) != 0;
        for (std::size_t i = 0; i < call.y.size(); ++i) call.y[i] = y[i][lane];
      }
    }
  }

  static void SetLane(std::span<const double> numbers, int lane, std::vector<Lanes>& all) {
    for (std::size_t i = 0; i < numbers.size(); ++i) all[i][lane] = numbers[i];
  }

  struct Call {
    bool is_taken = false;       ///< the lane has a run
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

  std::array<Call, kLanes> calls;
  std::vector<Lanes> x, y, w;
  std::map<decltype(CompiledBranch::function), Constants> constants;
  /// Branches of runs by their mechanism and the key of their first recordings.
  std::map<std::pair<const void*, std::string>, std::shared_ptr<SharedBranches>> shared;
};

LaneCalls& CallsOf(SideBySide& beside) {
  for (const std::unique_ptr<SharedWork>& work : beside.works) {
    if (auto* calls = dynamic_cast<LaneCalls*>(work.get())) return *calls;
  }
  return static_cast<LaneCalls&>(*beside.works.emplace_back(std::make_unique<LaneCalls>()));
}

}  // namespace

/// The lane of one run.
class Lane {
 public:
  /// Returns null without a batch or a free lane.
  static std::unique_ptr<Lane> Take(SideBySide* beside) {
    if (beside == nullptr) return nullptr;
    LaneCalls& calls = CallsOf(*beside);
    const auto free = std::ranges::find(calls.calls, false, &LaneCalls::Call::is_taken);
    if (free == calls.calls.end()) return nullptr;
    free->is_taken = true;
    return std::unique_ptr<Lane>(
        new Lane(*beside, calls, static_cast<int>(free - calls.calls.begin())));
  }
  ~Lane() {
    calls_.calls[lane_].is_taken = false;
    for (auto& [function, constants] : calls_.constants) constants.of[lane_] = nullptr;
  }
  Lane(const Lane&) = delete;
  Lane& operator=(const Lane&) = delete;

  /// Joins the runs with this mechanism whose first recordings have this key, if it is alone.
  void Join(const void* mechanism, const std::string& first_key) {
    if (shared_ != nullptr) return;
    if (mechanism != nullptr) shared_ = calls_.shared[{mechanism, first_key}];
    if (shared_ == nullptr) shared_ = std::make_shared<SharedBranches>();
    if (mechanism != nullptr) calls_.shared[{mechanism, first_key}] = shared_;
  }
  /// Branches of the runs that it has joined; null before.
  SharedBranches* shared() { return shared_.get(); }

  /// Returns false if a comparison differs from its recorded outcome.
  bool Call(const Code& code, std::span<const double> x, std::span<double> y) {
    const auto grow = [](std::vector<Lanes>& numbers, std::size_t size) {
      if (numbers.size() < size) numbers.resize(size);
    };
    grow(calls_.x, x.size());
    grow(calls_.y, y.size());
    grow(calls_.w, static_cast<std::size_t>(code.compiled.room));
    LaneCalls::Constants& constants = calls_.constants[code.compiled.function];
    grow(constants.numbers, code.constants.size());
    if (constants.of[lane_] != &code) {
      constants.of[lane_] = &code;
      LaneCalls::SetLane(code.constants, lane_, constants.numbers);
    }
    calls_.calls[lane_] = {true, &code, x, y};
    beside_.Meet();
    return calls_.calls[lane_].held;
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
