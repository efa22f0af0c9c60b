#include "harness/report/gnuplot.h"

#include <fmt/format.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include "harness/store/files.h"

namespace loopbench::harness {
namespace {

struct ProgramResult {
  int status = 0;
  std::string output;
};

ProgramResult RunProgram(const std::string& command) {
  ProgramResult result;
  std::FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return {-1, "no process could be started"};
  std::array<char, 4096> buffer{};
  for (std::size_t n = 0; (n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
    result.output.append(buffer.data(), n);
  }
  const int status = ::pclose(pipe);
  result.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return result;
}

// A folder of its own in the system's temporary folder, removed at the end of the scope.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "loopbench-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make " + name);
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

std::string TerminalOf(const GnuplotPage& page, bool pdf) {
  if (!pdf) {
    return fmt::format("svg noenhanced size {},{} font 'sans-serif,{}' background '#ffffff'",
                       page.width, page.height, page.font);
  }
  return fmt::format("pdfcairo noenhanced size {:.1f}in,{:.1f}in font 'sans-serif,{}'",
                     page.width / 100.0, page.height / 100.0, page.font);
}

}  // namespace

std::string GnuplotQuote(std::string_view text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'') quoted += '\'';
    quoted += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return quoted + '\'';
}

std::optional<std::string> DrawWithGnuplot(const std::filesystem::path& path,
                                           const GnuplotPage& page, const std::string& script,
                                           const std::string& gnuplot) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "figure.gp";
  const std::filesystem::path drawing = folder.path() / "figure";
  WriteFileAtomically(file, fmt::format("set terminal {}\nset output {}\n{}",
                                        TerminalOf(page, path.extension() == ".pdf"),
                                        GnuplotQuote(drawing.string()), script));
  const ProgramResult run = RunProgram(fmt::format("{} '{}' 2>&1", gnuplot, file.string()));
  constexpr int kNotFound = 127;
  if (run.status == kNotFound) {
    return fmt::format("{}: '{}' not found; install gnuplot-nox", path.string(), gnuplot);
  }
  if (run.status != 0 || !std::filesystem::exists(drawing)) {
    return fmt::format("{}: gnuplot failed: {}", path.string(), run.output);
  }
  WriteFileAtomically(path, ReadFile(drawing));
  return std::nullopt;
}

}  // namespace loopbench::harness
