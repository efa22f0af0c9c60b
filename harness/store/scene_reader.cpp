#include "harness/store/scene_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "harness/record/excerpt.h"
#include "harness/record/record_json.h"
#include "harness/store/finished_runs.h"
#include "harness/store/record_lines.h"
#include "harness/store/result_store.h"
#include "harness/text/files.h"

namespace loopbench::harness {
namespace {

constexpr std::size_t kAtOnce = 4096;  ///< records, and the rest of their last scene

}  // namespace

std::string KeysOfLine(std::string_view line) {
  std::string keys;
  bool is_key = true;  // the next text is one
  int depth = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (c == ',' && depth == 1) is_key = true;
    if (c != '"') continue;
    const std::size_t begin = i;
    for (++i; i < line.size() && line[i] != '"'; ++i) i += line[i] == '\\';
    if (is_key && depth == 1) keys += line.substr(begin, i - begin);
    is_key = false;
  }
  return keys;
}

SceneReader::SceneReader(std::filesystem::path path, const Selection& where)
    : file_(StoreFile(path)) {
  std::unordered_map<std::size_t, std::uint32_t> scenes;
  std::unordered_set<std::string> kinds;
  const LineReader::Wanted may_match = LinesThatMayMatch(where);
  const auto look = [&](std::string_view line, const LinePlace& place) {
    last_at_ = place.offset;
    const bool is_fresh = kinds.insert(KeysOfLine(line)).second;
    if (!may_match(line, place)) return is_fresh;
    std::string_view scene = TextUnder("\"scene_id\":\"", line);
    if (scene.empty()) scene = TextUnder("\"case_id\":\"", line);
    const auto fresh = static_cast<std::uint32_t>(scenes.size());
    const auto at = scenes.try_emplace(std::hash<std::string_view>()(scene), fresh).first;
    lines_.push_back({place.offset, static_cast<std::uint32_t>(place.length), at->second});
    bytes_ += place.length;
    return is_fresh;  // others are read when their scene's turn comes
  };
  ForEachRecord(
      file_, [this](Record one, const LinePlace&) { samples_.push_back(std::move(one)); }, nullptr,
      look);
  std::ranges::stable_sort(lines_, {}, &Line::scene);
}

void SceneReader::ForEach(const std::function<void(std::vector<Record>)>& take,
                          std::vector<std::string>* warnings) const {
  std::ifstream in(file_, std::ios::binary);
  std::vector<Record> records;
  std::string text;
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    const Line& line = lines_[i];
    text.resize(line.length);
    if (!in.seekg(static_cast<std::streamoff>(line.offset)) ||
        !in.read(text.data(), static_cast<std::streamsize>(text.size()))) {
      FailOn("read", file_);
    }
    try {
      records.push_back(FromJsonLine(text));
    } catch (const std::runtime_error& error) {
      const std::string message = fmt::format("{}: at byte {}: {}: '{}'", file_.string(),
                                              line.offset, error.what(), Excerpt(text));
      if (line.offset != last_at_ || !IsTornRecord(text)) {
        throw std::runtime_error(message);
      }
      warnings->push_back(message + " (torn last line, skipped)");
    }
    const bool is_last = i + 1 == lines_.size();
    if (!is_last && (records.size() < kAtOnce || lines_[i + 1].scene == line.scene)) continue;
    take(std::exchange(records, {}));
  }
}

}  // namespace loopbench::harness
