// Families of mechanisms by size, and benchmarks of right-hand sides from a file.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "harness/config/experiment.h"
#include "mechanism/description/description.h"

namespace loopbench::harness {

/// Family of mechanisms of any size (mechanism/description/library.h), for benchmarks and timings.
struct SizedFamily {
  std::string name;
  int smallest, largest;
  std::string of_what;  ///< objects counted by a size: "bars of a closed chain"
  /// Makes a member whose initial speeds are not zero, so that no term of the equations vanishes.
  MechanismDescription (*make)(int size);
};

const std::vector<SizedFamily>& SizedFamilies();
std::vector<std::string> NamesOfSizedFamilies();
/// Returns a sentence with all families and the meaning of their sizes.
std::string TextOfSizedFamilies();

/// Returns the family of that name, which must exist.
const SizedFamily& SizedFamilyOf(const std::string& name);

enum class BenchmarkKind {
  kRhs,   ///< one right-hand side
  kStep,  ///< one integrator step of fixed length, from the same state each time
};

template <>
inline constexpr std::array<std::string_view, 2> kNames<BenchmarkKind> = {"rhs", "step"};

/// Measured mechanism, built on demand because members of families may be large.
struct BenchmarkMember {
  std::string name;    ///< "four-bar", or "chain/10" for the member of size 10 of a family
  std::string family;  ///< a SizedFamily, or "" for a single mechanism
  int size = 0;        ///< size of the family's member
  MechanismDescription description;  ///< for a single mechanism

  MechanismDescription Make() const;
};

/// Members, kinds and methods; every combination is a benchmark.
struct BenchmarkGroup {
  std::vector<BenchmarkMember> members;
  std::vector<BenchmarkKind> kinds;
  std::vector<Method> methods;
};

/// Hashes of states by "<member>/<coordinates>", such as "chain/10/joint".
using StateHashes = std::map<std::string, std::string>;

struct BenchmarkSet {
  std::string name, comment;
  std::filesystem::path path;
  std::filesystem::path states_path;          ///< file of saved hashes; empty: none
  StateHashes states;                         ///< content of that file
  std::string integrator = "dormand-prince";  ///< of the measured steps
  double step = 1e-4;                         ///< length of a step [s]
  std::vector<BenchmarkGroup> groups;
};

/// "rhs/chain/10/odca/acceleration/joint/rank-revealing".
std::string BenchmarkName(BenchmarkKind kind, const BenchmarkMember& member, const Method& method);

/// Reads the file (configs/schema/benchmarks.schema.json) with its mechanisms and states. "states"
/// names a file of hashes, written by loopbench_bench --save-states. Throws ConfigError with all
/// errors, each with file, JSON Pointer, found value, expected value and nearest spelling.
BenchmarkSet ReadBenchmarks(const std::filesystem::path& path);

/// Reads benchmarks from text; `path` is used in messages and as base of relative paths.
BenchmarkSet ParseBenchmarks(std::string_view text, const std::filesystem::path& path);

/// Returns the text of a file of hashes.
std::string StatesToJson(const StateHashes& states);

}  // namespace loopbench::harness
