#include "harness/store/record_lines.h"

#include <fmt/format.h>

#include <fstream>
#include <stdexcept>
#include <utility>

#include "harness/record/excerpt.h"
#include "harness/record/record_checksum.h"
#include "harness/record/record_json.h"
#include "harness/store/result_store.h"
#include "harness/text/files.h"
#include "harness/text/output_file.h"

namespace loopbench::harness {

LineReader::LineReader(std::filesystem::path file, Take take, Wanted wanted, int lines_before)
    : file_(std::move(file)),
      take_(std::move(take)),
      wanted_(std::move(wanted)),
      number_(lines_before) {}

void LineReader::Feed(std::string_view text) {
  for (std::size_t end; (end = text.find('\n')) != std::string_view::npos;
       text.remove_prefix(end + 1)) {
    std::string_view line = text.substr(0, end);
    if (!rest_.empty()) line = rest_.append(line);
    TakeLine(line);
    offset_ += line.size() + 1;
    rest_.clear();
  }
  rest_ += text;
}

void LineReader::End() {
  is_ended_ = rest_.empty();
  if (is_ended_) return;
  TakeLine(rest_);
  if (warning_.empty()) offset_ += rest_.size();
}

void LineReader::TakeLine(std::string_view line) {
  ++number_;
  const LinePlace place{offset_, line.size()};
  if (line.empty() || line == "\r" || (wanted_ && !wanted_(line, place))) return;
  Record record;
  bool is_sealed = false;
  try {
    record = FromJsonLine(line, &is_sealed);
  } catch (const std::runtime_error& error) {
    const std::string message =
        fmt::format("{}:{}: {}: '{}'", file_.string(), number_, error.what(), Excerpt(line));
    if (is_ended_ || !IsTornRecord(line)) throw std::runtime_error(message);
    warning_ = message + " (torn last line, skipped)";
    return;
  }
  has_sealed_ = has_sealed_ || is_sealed;
  if (!is_sealed && first_bare_ == 0) first_bare_ = number_;
  if (has_sealed_ && first_bare_ > 0) {
    throw std::runtime_error(fmt::format("{}:{}: {} (other lines have one)", file_.string(),
                                         first_bare_, kWithoutChecksum));
  }
  take_(std::move(record), place);
}

void ForEachRecord(const std::filesystem::path& path, const LineReader::Take& take,
                   std::vector<std::string>* warnings, const LineReader::Wanted& wanted) {
  const std::filesystem::path file = StoreFile(path);
  LineReader reader(file, take, wanted);
  if (!IsLarge(file)) {
    reader.Feed(ReadFile(file));
  } else {
    NoteInput(file);
    std::ifstream in(file, std::ios::binary);
    std::string block(std::size_t{4} << 20, '\0');
    while (in.read(block.data(), static_cast<std::streamsize>(block.size())) || in.gcount() > 0) {
      reader.Feed(std::string_view(block).substr(0, static_cast<std::size_t>(in.gcount())));
    }
    if (!in.eof()) FailOn("read", file);
  }
  reader.End();
  if (warnings != nullptr && !reader.warning().empty()) warnings->push_back(reader.warning());
}

}  // namespace loopbench::harness
