#include "harness/trajectory/store_files.h"

#include "harness/text/files.h"
#include "harness/trajectory/trajectory.h"

namespace loopbench::harness {

std::filesystem::path TrajectoryOf(const Record& record, const std::filesystem::path& store_file) {
  const std::filesystem::path name = record.Text("trajectory");
  if (name.empty() || name.extension() != ".csv" || name.filename() != name) return {};
  return TrajectoryPath(store_file, name.stem().string());
}

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
      if (!std::filesystem::exists(from)) continue;
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
