#include "harness/store/record_lines.h"

#include <fmt/format.h>

#include <fstream>
#include <stdexcept>
#include <utility>

#include "harness/record/excerpt.h"
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
  bool is_unsealed = false;
  try {
    record = FromJsonLine(line, &is_unsealed);
  } catch (const std::runtime_error& error) {
    const std::string message =
        fmt::format("{}:{}: {}: '{}'", file_.string(), number_, error.what(), Excerpt(line));
    if (is_ended_ || !IsTornRecord(line)) throw std::runtime_error(message);
    warning_ = message + " (torn last line, skipped)";
    return;
  }
  if (is_unsealed && ++unsealed_ == 1) first_unsealed_ = number_;
  take_(std::move(record), place);
}

std::string LineReader::Unsealed() const {
  if (unsealed_ == 0) return "";
  return fmt::format(
      "{}:{}: found a line without its checksum, expected one: it may have been changed ({} such "
      "lines)",
      file_.string(), first_unsealed_, unsealed_);
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
  for (const std::string& warning : {reader.warning(), reader.Unsealed()}) {
    if (warnings != nullptr && !warning.empty()) warnings->push_back(warning);
  }
}

}  // namespace loopbench::harness
