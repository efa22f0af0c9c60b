#include "harness/generate/generated.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <sstream>
#include <vector>

#include "harness/generate/graph.h"
#include "harness/generate/print_c.h"
#include "harness/generate/record.h"
#include "harness/text/files.h"
#include "harness/text/hash.h"
#include "harness/text/run_program.h"

namespace loopbench::generate {

namespace {

namespace fs = std::filesystem;

using harness::FailOn, harness::Fnv1a, harness::ProgramResult, harness::TemporaryFolder,
    harness::Unfinished;

std::vector<std::string> Compiler() {
  const char* named = std::getenv("CC");
  std::istringstream words(named != nullptr && *named != '\0' ? named : "cc");
  return {std::istream_iterator<std::string>(words), {}};
}

}  // namespace

std::string RunCompiler(const std::vector<std::string>& arguments) {
  std::vector<std::string> words = {"timeout", std::to_string(kCompilerSeconds)};
  const std::vector<std::string> compiler = Compiler();
  words.insert(words.end(), compiler.begin(), compiler.end());
  words.insert(words.end(), arguments.begin(), arguments.end());
  const ProgramResult result = harness::RunProgram(words);
  const std::string name = compiler.empty() ? "CC" : compiler.front();
  if (result.error == 0 && result.status == 127) {
    throw NotCovered(fmt::format("no C compiler: '{}' not found (CC names another)", name));
  }
  if (result.error == 0 && result.status == 124) {
    throw NotCovered(fmt::format("{} took more than {} s", name, kCompilerSeconds));
  }
  const std::string failure = result.Failure(name);
  if (!failure.empty()) throw NotCovered("C compiler: " + failure);
  return result.output;
}

namespace {

/// Whether others could have written the file or folder.
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

/// The folder of libraries, made where it is missing; nothing where it cannot be made.
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
  const void* room = ::dlsym(handle, "loopbench_room");
  if (function == nullptr || use_sines == nullptr || room == nullptr) {
    throw NotCovered(library.string() + ": found no loopbench_function, expected generated code");
  }
  reinterpret_cast<void (*)(void (*)(double, double*, double*))>(use_sines)(&PoseSines);
  CompiledBranch branch;
  branch.function = reinterpret_cast<decltype(branch.function)>(function);
  branch.room = *static_cast<const int*>(room);
  return branch;
}

/// Compiles `text` to `library`.
void Compile(const std::string& text, const fs::path& folder, const fs::path& library) {
  const fs::path source = folder / "function.c";
  harness::WriteFileAtomically(source, text);
  std::vector<std::string> arguments(std::begin(kCompilerFlags), std::end(kCompilerFlags));
  for (const std::string& word :
       {source.string(), std::string("-o"), library.string(), std::string("-lm")}) {
    arguments.push_back(word);
  }
  RunCompiler(arguments);
}

/// A kept library ends with the checksum of the bytes before it, which the loader does not read.
void RequireWhole(const fs::path& library) {
  const std::string bytes = harness::ReadFile(library);
  const std::size_t size = bytes.size() - std::min(bytes.size(), Fnv1a("").size());
  if (Fnv1a(bytes.substr(0, size)) == bytes.substr(size)) return;
  throw NotCovered(library.string() + ": found a wrong checksum, expected the file as it was " +
                   "written; remove it");
}

CompiledBranch CompileOrFind(const std::string& text, const std::string& name,
                             const std::optional<fs::path>& cache) {
  if (cache) {
    const fs::path kept = *cache / (name + ".so");
    if (fs::exists(fs::symlink_status(kept))) {
      RequireOwn(kept, S_IFREG);
      RequireWhole(kept);
      return Load(kept);
    }
  }
  const TemporaryFolder folder("loopbench-generated");
  const fs::path library = folder.path() / "function.so";
  Compile(text, folder.path(), library);
  if (cache) {
    // renamed when complete, so a concurrent process never reads an incomplete file
    const fs::path own = *cache / fmt::format("{}.{}", name, ::getpid());
    const Unfinished unfinished(own);
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

CompiledBranch CompileBranch(const std::string& text) {
  static std::mutex mutex;
  static std::map<std::string, CompiledBranch> loaded;
  const std::lock_guard lock(mutex);
  static std::map<std::string, std::string> versions;  // by the compiler's words
  const std::string words = fmt::format("{}", fmt::join(Compiler(), " "));
  if (!versions.contains(words)) versions[words] = RunCompiler({"--version"});
  const std::string all =
      fmt::format("{}\n{}\n{}\n{}", words, versions[words], fmt::join(kCompilerFlags, " "), text);
  const std::string name = Fnv1a(all) + Fnv1a(Fnv1a(all) + all);
  const std::optional<fs::path> cache = CacheFolder();
  const std::string place = cache ? (*cache / name).string() : name;
  const auto known = loaded.find(place);
  if (known != loaded.end()) return known->second;
  return loaded[place] = CompileOrFind(text, name, cache);
}

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
