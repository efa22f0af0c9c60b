#include "harness/reference/merge_references.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "harness/record/record_json.h"
#include "harness/reference/reference.h"
#include "harness/text/files.h"
#include "harness/text/output_file.h"

namespace loopbench::harness {
namespace {

namespace fs = std::filesystem;

struct Known {
  fs::path file;
  std::string text;
  Record record;
};

Known ReadOne(const fs::path& file) {
  Known one{file, ReadFile(file), {}};
  std::string line = one.text;
  while (line.ends_with('\n')) line.pop_back();
  try {
    one.record = FromJsonLine(line);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
  }
  const std::string id = one.record.Text("reference");
  if (id.empty() || id != file.stem().string()) {
    throw std::runtime_error(fmt::format("{}: found reference \"{}\", expected \"{}\"",
                                         file.string(), id, file.stem().string()));
  }
  return one;
}

/// As a line, without what two makings of one reference may differ in.
std::string Lasting(const Record& record) {
  Record lasting;
  for (const auto& [key, value] : record.items()) {
    if (key != "cpu_s") lasting.Set(key, value);
  }
  return ToJsonLine(lasting);
}

/// The largest certified error of points, as far as that is certified [m].
double CertifiedTo(const Record& record) {
  const std::vector<double>&t = record.Numbers("series.t"),
        &bounds = record.Numbers("series.bound.position");
  double largest = 0.0;
  for (std::size_t k = 0; k < std::min(t.size(), bounds.size()); ++k) {
    if (t[k] <= record.Number("trust_horizon")) largest = std::max(largest, bounds[k]);
  }
  return largest;
}

bool IsFiner(const Record& one, const Record& other) {
  const double until = one.Number("trust_horizon"), others = other.Number("trust_horizon");
  return until != others ? until > others : CertifiedTo(one) < CertifiedTo(other);
}

std::string Shown(const Known& one) {
  return fmt::format("{} (until {} s, to {:.1e} m)", one.file.string(),
                     one.record.Text("trust_horizon"), CertifiedTo(one.record));
}

}  // namespace

MergedReferences MergeReferences(const std::vector<fs::path>& store_files) {
  std::map<std::string, Known> all;
  MergedReferences merged;
  for (const fs::path& store : store_files) {
    const fs::path folder = ReferencePath(store, "").parent_path();
    if (!fs::is_directory(folder)) continue;
    std::set<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.path().extension() == ".json") files.insert(entry.path());
    }
    for (const fs::path& file : files) {
      Known fresh = ReadOne(file);
      const auto [at, is_new] = all.try_emplace(file.filename().string(), fresh);
      if (is_new || Lasting(at->second.record) == Lasting(fresh.record)) continue;
      if (IsFiner(fresh.record, at->second.record)) std::swap(at->second, fresh);
      merged.notes.push_back(fmt::format("two certificates of one reference: {} is kept, {} is not",
                                         Shown(at->second), Shown(fresh)));
    }
  }
  for (auto& [name, known] : all) merged.texts.emplace(name, std::move(known.text));
  return merged;
}

void WriteReferences(const MergedReferences& references, const fs::path& store_file) {
  const fs::path folder = ReferencePath(store_file, "").parent_path();
  for (const auto& [name, text] : references.texts) {
    OutputFile file(folder / name, Onto::kAnyFile);
    file.Write(text);
    file.Finish();
  }
}

}  // namespace loopbench::harness
