// Families of mechanisms by size, and the benchmarks of right-hand sides that a file asks for.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "harness/config/experiment.h"
#include "mechanism/description/description.h"

namespace loopbench::harness {

// Families of mechanisms of any size (mechanism/description/library.h), as benchmarks and the
// timings of experiments take them.

struct SizedFamily {
  std::string name;
  int smallest, largest;
  std::string of_what;  ///< what a size counts: "bars of a closed chain"
  /// With a start that moves, so that no term of the equations vanishes.
  MechanismDescription (*make)(int size);
};

const std::vector<SizedFamily>& SizedFamilies();
std::vector<std::string> NamesOfSizedFamilies();
/// All of them, with what their sizes count, in a sentence.
std::string TextOfSizedFamilies();

/// The family of that name, which must be one.
const SizedFamily& SizedFamilyOf(const std::string& name);

// What loopbench_bench and loopbench_count measure: mechanisms, families, columns, and the hashes
// of the states they are measured at. Plain data; benchmarks.h fills it.

enum class BenchmarkKind {
  kRhs,   ///< one right-hand side
  kStep,  ///< one integrator step of fixed length, from the same state each time
};

template <>
inline constexpr std::array<std::string_view, 2> kNames<BenchmarkKind> = {"rhs", "step"};

/// One mechanism that is measured, made when it is needed: members of families may be large.
struct BenchmarkMember {
  std::string name;    ///< "four-bar", or "chain/10" for the member of size 10 of a family
  std::string family;  ///< a SizedFamily, or "" for a mechanism of its own
  int size = 0;        ///< of the family's member
  MechanismDescription description;  ///< of a mechanism of its own

  MechanismDescription Make() const;
};

/// Members, kinds and columns; every combination is a benchmark.
struct BenchmarkGroup {
  std::vector<BenchmarkMember> members;
  std::vector<BenchmarkKind> kinds;
  std::vector<Column> columns;
};

/// Hashes of states by "<member>/<coordinates>", for example "chain/10/joint".
using StateHashes = std::map<std::string, std::string>;

struct BenchmarkSet {
  std::string name, comment;
  std::filesystem::path path;
  std::filesystem::path states_path;          ///< file of saved hashes; empty: none
  StateHashes states;                         ///< what it says
  std::string integrator = "dormand-prince";  ///< of steps
  double step = 1e-4;                         ///< length of a step [s]
  std::vector<BenchmarkGroup> groups;
};

/// "rhs/chain/10/odca/acceleration/joint/rank-revealing".
std::string BenchmarkName(BenchmarkKind kind, const BenchmarkMember& member, const Column& column);

// Reads what is benchmarked (configs/benchmarks/default.json):
//   {"name", "comment", "states", "integrator", "step",
//    "groups": [{"mechanisms": [path, ...]  or  "family": "chain|ladder|grid", "sizes": [...],
//                "in_space": false, "preprocess": false,
//                "measure": ["rhs", "step"], "methods": [...]}]}
// Paths are relative to the file; columns are those of experiments. "states" names a file of
// hashes, which loopbench_bench --save-states writes:
//   {"<member>/<coordinates>": "<16 hexadecimal digits>"}

/// Reads the file, the mechanisms and the states it names. Throws ConfigError with all mistakes,
/// each with file, JSON Pointer, value found, what was expected and the nearest spelling.
BenchmarkSet ReadBenchmarks(const std::filesystem::path& path);

/// The same from text; `path` names it in messages and is what relative paths start from.
BenchmarkSet ParseBenchmarks(std::string_view text, const std::filesystem::path& path);

/// The text of a file of hashes.
std::string StatesToJson(const StateHashes& states);

}  // namespace loopbench::harness
