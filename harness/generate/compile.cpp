#include "harness/generate/compile.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <sstream>
#include <vector>

#include "harness/base/text.h"
#include "harness/generate/graph.h"
#include "harness/generate/record.h"

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

std::string RunCompiler(const std::vector<std::string>& arguments, const fs::path& folder,
                        int seconds) {
  // "timeout" ends it politely, a second later in any case
  std::vector<std::string> words = {"timeout", "--kill-after=1", std::to_string(seconds)};
  const std::vector<std::string> compiler = Compiler();
  if (!folder.empty()) words.insert(words.end(), {"env", "TMPDIR=" + folder.string()});
  words.insert(words.end(), compiler.begin(), compiler.end());
  words.insert(words.end(), arguments.begin(), arguments.end());
  const ProgramResult result = harness::RunProgram(words);
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

namespace {

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
  const TemporaryFolder folder("loopbench-generated");
  const fs::path library = folder.path() / "function.so";
  Compile(text, flags, folder.path(), library);
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

}  // namespace loopbench::generate
