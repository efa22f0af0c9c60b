// Where the values of a document come from: its own file, files taken into it, and settings.
//
// A sweep and --set change a document after it was parsed, and a pointer that goes through the path
// of a mechanism takes that file in. Messages must still name the file and line a person can edit.
// Internal to harness/config.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace loopbench::harness {

class Origins {
 public:
  /// The document `file` with this text, which must outlive the object; "" when it is not at hand,
  /// and messages then go without lines.
  explicit Origins(std::string file, std::string_view text = "") {
    parts_.push_back({"", std::move(file), text, "", ""});
  }

  /// The value at `pointer` is now the document `file`.
  void TakeIn(std::string pointer, std::string file, std::string_view text) {
    parts_.push_back({std::move(pointer), std::move(file), text, "", ""});
  }

  /// The value at `pointer` was set; `note` says by what, and `source` is the pointer of that in
  /// the first file, "" when it stands in no file.
  void Note(std::string pointer, std::string note, std::string source) {
    parts_.push_back({std::move(pointer), "", "", std::move(note), std::move(source)});
  }

  struct Place {
    std::string file;
    std::string pointer;       ///< within `file`, as a message shows it
    std::string line_pointer;  ///< whose line the message shows
    std::string_view text;     ///< of `file`
    std::string note;          ///< "" for what stands in a file
  };

  /// The innermost part that holds the value, the latest of those as deep.
  Place Find(const std::string& pointer) const {
    const Part* found = &parts_.front();
    for (const Part& part : parts_) {
      const bool inside =
          pointer.starts_with(part.pointer) &&
          (pointer.size() == part.pointer.size() || pointer[part.pointer.size()] == '/');
      if (inside && part.pointer.size() >= found->pointer.size()) found = &part;
    }
    if (!found->note.empty()) {
      const Part& root = parts_.front();
      return {root.file, pointer, found->source, found->source.empty() ? "" : root.text,
              found->note};
    }
    const std::string within = pointer.substr(found->pointer.size());
    return {found->file, within, within, found->text, ""};
  }

 private:
  struct Part {
    std::string pointer, file;
    std::string_view text;
    std::string note, source;
  };
  std::vector<Part> parts_;
};

}  // namespace loopbench::harness
