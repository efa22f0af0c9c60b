// The index of the paper's equations in odca/README.md against the code: it names all 72, each
// once; what it names is there; and the numbers stand in the comments of what it names.
#include "harness/base/text.h"
#include "tests/standard.h"

namespace loopbench::odca::index_test {

namespace fs = std::filesystem;

const fs::path kRoot = LOOPBENCH_SOURCE_DIR;
constexpr int kEquations = 72;

/// A file of the repository and a function in it, "" for the file as a whole.
struct Place {
  std::string file, function;
};

struct Row {
  int equation = 0;
  std::string where;  ///< the cell: "not formed", or places
  std::string how;
  std::vector<Place> places;
};

std::vector<std::string> Lines(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// A cell names a file, then its functions, then perhaps another file.
std::vector<Place> PlacesIn(const std::string& cell) {
  const std::regex quoted("`([^`]+)`");
  std::vector<Place> places;
  std::string file;
  for (std::sregex_iterator at(cell.begin(), cell.end(), quoted), end; at != end; ++at) {
    const std::string name = (*at)[1];
    if (name.find('/') != std::string::npos) {
      file = name;
      places.push_back({file, ""});
    } else {
      if (places.back().function.empty()) places.pop_back();
      places.push_back({file, name});
    }
  }
  return places;
}

std::vector<Row> Index() {
  const std::string text = harness::ReadFile(kRoot / "odca/README.md");
  const std::size_t begin = text.find("## Index of the equations");
  const std::string section = text.substr(begin, text.find("\n## ", begin + 1) - begin);
  const std::regex row(R"(\| (\d+) \| ([^|]+) \| ([^|]+) \| ([^|]+) \|)");
  std::vector<Row> rows;
  for (const std::string& line : Lines(section)) {
    std::smatch cells;
    if (!std::regex_match(line, cells, row)) continue;
    rows.push_back({std::stoi(cells[1]), cells[3], cells[4], PlacesIn(cells[3])});
  }
  return rows;
}

/// Numbers that comments cite: "(16)", "(26-28, 71)", not the argument in "sqrt(2)".
std::set<int> Cited(const std::string& line) {
  std::set<int> numbers;
  const std::size_t comment = line.find("//");
  if (comment == std::string::npos) return numbers;
  const std::string text = line.substr(comment);
  const std::regex list(R"((?:^|\s)\((\d+(?:-\d+)?(?:, \d+(?:-\d+)?)*)\))");
  const std::regex range(R"((\d+)(?:-(\d+))?)");
  for (std::sregex_iterator at(text.begin(), text.end(), list), end; at != end; ++at) {
    const std::string inside = (*at)[1];
    for (std::sregex_iterator part(inside.begin(), inside.end(), range); part != end; ++part) {
      const int first = std::stoi((*part)[1]);
      const int last = (*part)[2].matched ? std::stoi((*part)[2]) : first;
      for (int number = first; number <= last; ++number) numbers.insert(number);
    }
  }
  return numbers;
}

/// Returns the equations cited in a function and the comment above it, or in the whole file. The
/// text begins at the blank line before the name. Empty if the file has no such function.
std::set<int> CitedIn(const Place& place, bool& found) {
  const std::vector<std::string> lines = Lines(harness::ReadFile(kRoot / place.file));
  const std::regex name("\\b" + place.function + "\\(");
  std::set<int> numbers;
  found = place.function.empty();
  if (found) {
    for (const std::string& line : lines) numbers.merge(Cited(line));
    return numbers;
  }
  for (std::size_t at = 0; at < lines.size(); ++at) {
    const std::string code = lines[at].substr(0, lines[at].find("//"));
    if (code.ends_with(";") || !std::regex_search(code, name)) continue;  // a call
    found = true;
    std::size_t begin = at;
    while (begin > 0 && !lines[begin - 1].empty()) --begin;
    const bool opens = lines[at].ends_with("{") || lines[at].ends_with(",");
    const std::string end(lines[at].find_first_not_of(' '), ' ');
    for (std::size_t line = begin; line < lines.size(); ++line) {
      numbers.merge(Cited(lines[line]));
      if (line >= at && (opens ? lines[line].starts_with(end + "}") : lines[line].empty())) break;
    }
  }
  return numbers;
}

TEST(PaperIndexTest, EveryEquationStandsInTheIndexOnce) {
  std::map<int, int> times;
  for (const Row& row : Index()) ++times[row.equation];
  EXPECT_EQ(times.size(), std::size_t{kEquations});
  for (int equation = 1; equation <= kEquations; ++equation) {
    EXPECT_EQ(times[equation], 1) << "(" << equation << ")";
  }
}

TEST(PaperIndexTest, ARowNamesFunctionsOrSaysWhyNothingIsFormed) {
  for (const Row& row : Index()) {
    EXPECT_EQ(row.places.empty(), row.where == "not formed") << row.equation << ": " << row.where;
    EXPECT_GE(row.how.size(), 5u) << row.equation;
  }
}

TEST(PaperIndexTest, FunctionsExistAndCiteTheirEquations) {
  for (const Row& row : Index()) {
    for (const Place& place : row.places) {
      ASSERT_TRUE(fs::exists(kRoot / place.file)) << row.equation << ": " << place.file;
      bool found = false;
      const std::set<int> cited = CitedIn(place, found);
      EXPECT_TRUE(found) << place.file << " has no function " << place.function;
      EXPECT_TRUE(cited.contains(row.equation))
          << "(" << row.equation << ") is not cited by " << place.function << " in " << place.file;
    }
  }
}

/// A header counts as its source file.
TEST(PaperIndexTest, CommentsCiteWhatTheIndexMapsToTheirFile) {
  std::map<std::string, std::set<int>> mapped;
  for (const Row& row : Index()) {
    for (const Place& place : row.places) {
      mapped[fs::path(place.file).replace_extension().generic_string()].insert(row.equation);
    }
  }
  std::size_t citations = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kRoot / "odca")) {
    const fs::path path = entry.path().lexically_relative(kRoot);
    if (path.extension() != ".h" && path.extension() != ".cpp") continue;
    const std::string stem = fs::path(path).replace_extension().generic_string();
    for (const std::string& line : Lines(harness::ReadFile(entry.path()))) {
      for (const int number : Cited(line)) {
        ++citations;
        EXPECT_TRUE(mapped[stem].contains(number)) << path << " cites (" << number << "): " << line;
      }
    }
  }
  EXPECT_GE(citations, 40u);
}

}  // namespace loopbench::odca::index_test
