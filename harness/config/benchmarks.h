// What loopbench_bench and loopbench_count measure: mechanisms, families, columns, and the hashes
// of the states they are measured at. Plain data; benchmark_reader.h fills it.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "harness/config/experiment.h"
#include "mechanism/description/description.h"

namespace loopbench::harness {

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

}  // namespace loopbench::harness
