#include "harness/trajectory/store_files.h"

#include <fmt/format.h>

#include <fstream>
#include <string_view>

#include "harness/text/files.h"
#include "harness/text/hash.h"
#include "harness/trajectory/trajectory.h"

namespace loopbench::harness {

std::filesystem::path TrajectoryOf(const Record& record, const std::filesystem::path& store_file) {
  const std::filesystem::path name = record.Text("trajectory");
  if (name.empty() || name.extension() != ".csv" || name.filename() != name) return {};
  return TrajectoryPath(store_file, name.stem().string());
}

void VerifyTrajectory(const Record& record, const std::filesystem::path& file) {
  const std::string expected = record.Text("trajectory_hash");
  if (expected.empty()) return;
  FnvHash hash;
  std::ifstream in(file, std::ios::binary);
  std::string block(std::size_t{1} << 20, '\0');
  while (in.read(block.data(), static_cast<std::streamsize>(block.size())) || in.gcount() > 0) {
    hash.Add(std::string_view(block).substr(0, static_cast<std::size_t>(in.gcount())));
  }
  if (!in.eof()) FailOn("read", file);
  if (hash.Text() == expected) return;
  throw ChangedFile(
      fmt::format("{}: the file was changed after its run wrote it: found hash {}, expected {}; "
                  "run --rerun all makes it again",
                  file.string(), hash.Text(), expected));
}

namespace {

bool IsAsWritten(const Record& record, const std::filesystem::path& file) try {
  if (!std::filesystem::exists(file)) return false;
  VerifyTrajectory(record, file);
  return true;
} catch (const ChangedFile&) {
  return false;
}

}  // namespace

std::vector<std::string> CopyTrajectories(const std::vector<Record>& records,
                                          const std::vector<std::filesystem::path>& stores,
                                          const std::filesystem::path& target) {
  std::vector<std::string> missing;
  for (const Record& record : records) {
    const std::filesystem::path to = TrajectoryOf(record, target);
    if (to.empty()) continue;
    bool is_there = false;
    for (const std::filesystem::path& store : stores) {
      const std::filesystem::path from = TrajectoryOf(record, store);
      if (!IsAsWritten(record, from)) continue;
      is_there = true;
      std::filesystem::path part = to;
      part += ".part";
      MakeFolderOf(part);
      std::filesystem::copy_file(from, part, std::filesystem::copy_options::overwrite_existing);
      std::filesystem::rename(part, to);
      break;
    }
    if (!is_there) missing.push_back(to.filename().string());
  }
  return missing;
}

}  // namespace loopbench::harness
