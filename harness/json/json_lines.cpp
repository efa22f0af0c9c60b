// LinesOf: a second pass through the text, made only when there is something to complain about.
#include <set>

#include "harness/json/json_walker.h"

namespace loopbench::harness {
namespace {

/// Looks for the lines of some values.
class LineFinder final : public Walker {
 public:
  explicit LineFinder(const std::vector<std::string>& wanted)
      : wanted_(wanted.begin(), wanted.end()) {}

  const std::map<std::string, std::size_t>& lines() const { return lines_; }

  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override {
    return false;
  }

 protected:
  bool Put(Json) override {
    const std::string pointer = Pointer();
    if (wanted_.contains(pointer)) lines_.emplace(pointer, line());
    return lines_.size() < wanted_.size();
  }

 private:
  std::set<std::string> wanted_;
  std::map<std::string, std::size_t> lines_;
};

}  // namespace

std::map<std::string, std::size_t> LinesOf(std::string_view text,
                                           const std::vector<std::string>& pointers) {
  LineFinder finder(pointers);
  finder.Walk(text);
  return finder.lines();
}

}  // namespace loopbench::harness
