// Texts and files: words, escapes, hashes, terminals, external programs, times of a process.
// Sources that include this header rely on its standard headers.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <functional>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

namespace loopbench::harness {

// Times of a run. Limits are CPU time: waiting for a processor uses none.

/// CPU time that the calling thread has used since it began [s].
inline double ThreadCpuSeconds() {
  std::timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

inline double WallSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Time of the present thread that belongs to no run, or to other runs [s].
struct ForeignTime {
  double wall_s = 0.0, cpu_s = 0.0;  ///< in which code was recorded and compiled
  double others_s = 0.0;             ///< wall time of other runs, set when a run continues
};
inline thread_local ForeignTime foreign_time;

/// Adds the time of its life to `foreign_time` and its wall time to a sum [s].
class ForeignWork {
 public:
  explicit ForeignWork(double& sum_s) : sum_s_(sum_s) {}
  ~ForeignWork() {
    const double wall_s = WallSeconds() - wall_begin_;
    sum_s_ += wall_s;
    foreign_time.wall_s += wall_s;
    foreign_time.cpu_s += ThreadCpuSeconds() - cpu_begin_;
  }
  ForeignWork(const ForeignWork&) = delete;
  ForeignWork& operator=(const ForeignWork&) = delete;

 private:
  double& sum_s_;
  double wall_begin_ = WallSeconds(), cpu_begin_ = ThreadCpuSeconds();
};

/// CPU time limit of the run that creates and queries it. The CPU clock, ten times as expensive as
/// the wall clock, is read only after as much wall time as was left at the last reading. Runs that
/// take turns on one thread share the CPU time in proportion to their wall times.
class CpuLimit {
 public:
  explicit CpuLimit(double limit_s) : limit_s_(limit_s), look_s_(limit_s) {}

  bool Reached() {
    const double wall = wall_s();
    if (wall < look_s_) return false;
    const double left = limit_s_ - cpu_s();
    look_s_ = wall + left;
    return left <= 0.0;
  }

  double wall_s() const { return AllRuns() - Others(); }
  double cpu_s() const {
    const double all = AllRuns(), cpu = ThreadCpuSeconds() - foreign_time.cpu_s - cpu_start_;
    return all > 0.0 ? cpu * (1.0 - Others() / all) : cpu;
  }

 private:
  double AllRuns() const { return WallSeconds() - foreign_time.wall_s - wall_start_; }
  double Others() const { return foreign_time.others_s - others_start_; }

  double limit_s_;
  double look_s_;  ///< wall time before which the limit cannot have been reached
  double wall_start_ = WallSeconds() - foreign_time.wall_s;
  double cpu_start_ = ThreadCpuSeconds() - foreign_time.cpu_s;
  double others_start_ = foreign_time.others_s;
};

// Names and other user texts may come from any source. Every writer passes them through the
// function of its medium, so that they are shown and never act as instructions. Only JSON needs
// none: its writer (harness/base/record.h) keeps every character.

/// Returns the text with every active character shown, such as "\n", "\x1b" or "\u202e". Active
/// are control characters (also U+0080 to U+009F), marks of writing direction, line separators and
/// bytes that are not UTF-8. One line, deterministic. Used for terminals, and as the first step of
/// all functions below.
std::string EscapeTerminal(std::string_view text);

/// Escapes text of several lines for a terminal: line ends stay.
std::string EscapeTerminalLines(std::string_view text);

/// Escapes text within a line or cell of GitHub's Markdown: no markup, HTML, written link or
/// formula begins in it. Other characters stay unchanged, as in drift_position_max or "a <= b".
std::string EscapeMarkdown(std::string_view text);

/// Escapes a paragraph whose first characters must not make it a heading, list or quotation.
std::string EscapeMarkdownParagraph(std::string_view text);

/// Escapes LaTeX text in a cell or a comment. Characters that pdflatex lacks without packages are
/// written as "(U+6F22)"; it has the accented letters of Latin-1.
std::string EscapeLatex(std::string_view text);

/// Escapes LaTeX text set in lines: words may break after punctuation and after eight letters.
std::string BreakableLatex(std::string_view text);

/// Escapes text of SVG and HTML, in an element or an attribute.
std::string EscapeXml(std::string_view text);

/// Writes a CSV field, quoted if RFC 4180 (or a reader with "#" comments) needs it. A text that a
/// spreadsheet would read as a formula (it begins with =, +, - or @ and is no number) gets an
/// apostrophe in front, which spreadsheets hide. JSON contains such texts unchanged.
std::string EscapeCsv(std::string_view text);

/// Quotes a string for gnuplot: all characters appear as given.
std::string QuoteGnuplot(std::string_view text);

/// Quotes the label of a tick, which gnuplot would read as a format.
std::string QuoteGnuplotTick(std::string_view text);

/// Returns a file name without extension for `name`: letters, digits, '.', '_', '+' and '-', at
/// most 200 of them, not beginning with '.' or '-'. A name of another form becomes a slug with a
/// hash of the whole name, so that two names never share a file.
std::string FileName(std::string_view name);

/// Returns the cells of a UTF-8 text on a terminal, by the C library's table: two for a Chinese
/// character, none for a combining accent. Unknown characters and invalid bytes count as one. The
/// text has no control characters (EscapeTerminal).
std::size_t CellsOf(std::string_view text);

/// Returns the longest beginning of at most `width` cells, and combining marks of its last letter.
std::string_view Beginning(std::string_view text, std::size_t width);

/// Breaks `text` into lines of at most `width` > 1 cells: after a comma if there is one, else at a
/// space. A longer word is broken too.
std::vector<std::string> BrokenInto(std::string_view text, std::size_t width);

// Whole files, read and written at once, and their errors.

/// Bad input that the user can correct. what() is the complete message: for each mistake the file,
/// the JSON Pointer, the value found and the value expected. The command line turns it into exit
/// code 2. Numerical failures are not such errors; they are outcomes of a run.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A failed operation of the system: a full disk, a limit, a missing file. Runs make
/// no record then, because a method did not cause it (processes.h).
class SystemFault : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Permission to write a file that the command has read, or a file of a store: for records of runs,
/// never for a result.
enum class Onto { kNoInput, kAnyFile };

/// Writes `text` to `path` by the rules below: a reader of a regular file finds the old
/// contents or the new ones, never a part. Makes missing parent folders. Throws std::runtime_error
/// with the path and the system's reason.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view text,
                         Onto onto = Onto::kNoInput);

/// Writes `text` to `path` if no file exists there; else returns false and changes nothing. If
/// several processes try at once, one succeeds. If a process is killed, the file is complete or
/// absent. Throws as WriteFileAtomically does.
bool WriteNewFile(const std::filesystem::path& path, std::string_view text);

/// Makes the folder of `path` and its parents. Throws std::runtime_error with folder and reason.
void MakeFolderOf(const std::filesystem::path& path);

/// Throws SystemFault: "cannot VERB 'PATH': " and the reason in errno.
[[noreturn]] void FailOn(std::string_view verb, const std::filesystem::path& path);

/// Writes all of `text` to an open file; `path` names it in the error. Calls write(2) once, and
/// again only if the system accepted a part or was interrupted.
void WriteAll(int descriptor, std::string_view text, const std::filesystem::path& path);

/// Waits until the names in the folder of `path` are on disk, if the file system supports this.
void SyncFolderOf(const std::filesystem::path& path);

/// Calls use() for the parts of a file of any size, in order. Throws as FailOn() does.
void ForEachBlock(const std::filesystem::path& file,
                  const std::function<void(std::string_view)>& use);

/// Returns the paths of all entries of a folder in order; none if it cannot be listed.
std::vector<std::filesystem::path> EntriesOf(const std::filesystem::path& folder);

/// Returns the bytes of the regular file `path` (a device might never end) and notes it as
/// input. Throws std::runtime_error with the path and the reason.
std::string ReadFile(const std::filesystem::path& path);

// Temporary files and folders of a command: none remains, however the command ends.

/// The signal with which a parent ends a child process, whose temporary files are then removed.
inline constexpr int kRemoveAndEnd = SIGUSR1;

/// Temporary file or folder. It is removed with its owner, and before SIGHUP, SIGINT, SIGTERM or
/// kRemoveAndEnd ends this process. A signal that is ignored or has a handler (processes.h) stays
/// unchanged.
class Unfinished {
 public:
  explicit Unfinished(const std::filesystem::path& path);
  ~Unfinished();
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;

  std::filesystem::path path() const { return path_; }

 private:
  std::string path_;
};

/// New folder in the system's folder for temporary files. It holds a lock: the next folder of the
/// same name removes the folders of killed processes.
class TemporaryFolder {
 public:
  /// @param name  first part of the folder's name. Throws std::runtime_error if the folder cannot
  ///        be made.
  explicit TemporaryFolder(const std::string& name);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path path() const { return unfinished_->path(); }

 private:
  std::optional<Unfinished> unfinished_;
  int lock_ = -1;
};

// Rules for the destination of output.
//
//   PATH is                         output goes
//   a new name, a regular file      to a temporary file next to it, renamed at the end
//   a symbolic link                 to its target, in the same way; the link stays
//   a character device, a pipe      into it
//   standard output or error        into it, after all previous output
//   a file the command has read     nowhere: rejected
//   a trajectory, mechanism or      nowhere: rejected
//   reference of any store
//   a folder, a block device, ...   nowhere: rejected

/// Scope in which the files passed to NoteInput() are inputs, and output onto them is rejected.
/// Only one object may exist; without one there are no inputs.
class CommandInputs {
 public:
  CommandInputs();
  ~CommandInputs();
  CommandInputs(const CommandInputs&) = delete;
  CommandInputs& operator=(const CommandInputs&) = delete;
};
/// Registers an input file; every function that reads files calls it. Thread-safe.
void NoteInput(const std::filesystem::path& path);

/// Throws as OutputFile does, and writes nothing: a check before long work.
void RequireOutput(const std::filesystem::path& path);

/// Follows symbolic links to their end, which may be missing.
std::filesystem::path BehindLinks(std::filesystem::path file);

/// Removes temporary files of OutputFile in `folder` whose process was killed. Such a process
/// no longer exists, and no process of another machine holds the lock of the file.
void RemoveAbandoned(const std::filesystem::path& folder);

/// Output in progress. A reader of a regular file finds the old contents or the new ones.
class OutputFile {
 public:
  /// Makes missing folders. Throws std::runtime_error, here and below, with the path and the
  /// reason.
  /// @param ending  ending of the temporary file; "": a unique one
  explicit OutputFile(const std::filesystem::path& path, Onto onto = Onto::kNoInput,
                      std::string_view ending = "");
  /// Leaves a regular file unchanged if Finish() was not called.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void Write(std::string_view text);
  /// Puts the file on disk. Call it once, at the end.
  void Finish();
  /// Finishes like Finish(), but returns false and keeps an existing file of this name.
  bool FinishIfNew();

 private:
  void Close();

  std::filesystem::path path_, target_;  ///< target_: path after links; "" for a device or pipe
  std::optional<Unfinished> part_;
  int descriptor_ = -1;
};

// Versions of files (docs/release.md), raised if programs could misread older or newer files.

/// Configuration files; those without a version read as 1.
inline constexpr int kFileFormat = 1;
/// Lines of stores and histories. 2: keys and values have other names (`loopbench migrate`).
inline constexpr int kRecordFormat = 2;

/// Expected format in messages.
inline constexpr const char* kExpectedFormat = "{}, the format that this version reads";

/// FNV-1a (64 bit) of bytes in parts: names of states, cases and versions, not for security.
class FnvHash {
 public:
  void Add(std::string_view bytes) {
    for (const char byte : bytes) {
      hash_ = (hash_ ^ static_cast<unsigned char>(byte)) * 0x100000001b3u;
    }
  }
  /// Returns 16 hexadecimal digits.
  std::string Text() const { return fmt::format("{:016x}", hash_); }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

inline std::string Fnv1a(std::string_view bytes) {
  FnvHash hash;
  hash.Add(bytes);
  return hash.Text();
}

// External programs, files in memory, and the end of a process without memory.

/// File without a name, for the output of a child process made by fork; it is readable however the
/// child ends. Programs started by exec do not inherit it.
class MemoryFile {
 public:
  /// @param what  purpose of the file, for messages
  explicit MemoryFile(const char* what);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  int descriptor() const { return descriptor_; }

  /// Returns all written text, independent of the file position.
  std::string Text() const;

 private:
  int descriptor_;
};

struct ProgramResult {
  int status = 0;  ///< exit status; 128 + the signal number after a signal, as in shells
  int error = 0;   ///< errno if the program could not be started, else 0
  std::string output, messages;  ///< complete standard output and standard error

  /// Returns the reason of a failure, "" for exit status 0. `name` is the program's usual name.
  std::string Failure(const std::string& name) const;
};

/// Runs `words`, the program (searched in PATH) and its arguments, without a shell, with `input` on
/// its standard input, and waits for it. The program receives SIGTERM if this process ends before.
/// Throws std::runtime_error only if no memory file can be made.
ProgramResult RunProgram(std::vector<std::string> words, const std::string& input = "");

/// Ends the program for which RunProgram() waits, if there is one. Async-signal-safe.
void EndProgram();

/// Makes a process that lacks memory where no exception may leave (destructors, threads) exit with
/// `code` after `message` on standard error, instead of SIGABRT. Other uncaught errors end it as
/// before. `message` must stay valid.
void ExitWithoutMemory(int code, std::string_view message);

// Standard output and error, and their terminals (docs/decisions/024). All output goes through
// here: text that cannot be written gives an error with its reason, and never a signal or a line in
// an unrelated file.

struct Screen {
  std::size_t width = 0;  ///< [cells]; 0: unlimited, for files and pipes
  bool colour = false;
  bool is_terminal = false;
};

/// Returns the screen of standard output as PrepareStreams() found it; child processes that print
/// into memory have it, too. If a terminal reports no width, it is the environment variable
/// COLUMNS, else 80. Colour is on if the terminal supports it, unless disabled as in
/// https://no-color.org.
Screen OutputScreen();

/// Returns the screen of standard error, which shows progress if it is a terminal (width > 0).
Screen ErrorScreen();

/// Makes the width of standard output unlimited: --wide.
void ShowWide();

/// Opens closed descriptors among 0, 1 and 2; call it first in main(). Otherwise the next file, for
/// example a store, would get their numbers and all printed text. Closed streams still cannot be
/// written. From now on, writing to a pipe without reader or beyond the file size limit fails
/// instead of ending the process.
void PrepareStreams();

/// Writes every byte unchanged to standard output: tables, which are escaped and may have colours,
/// and machine formats. FinishOutput() reports a failed write.
void PrintText(std::string_view text);

/// From now on, Print() writes to standard error: a file of the command is standard output.
void KeepOutputForFile();

/// Writes a text for people to standard output, or to standard error after KeepOutputForFile().
void PrintMessage(std::string_view text);

/// Writes to standard error; does nothing if that cannot be written.
void PrintErrorText(std::string_view text);

/// Text of several lines among the values of Print(): its line ends stay.
struct Lines {
  std::string_view text;
};

namespace internal {

/// Returns a value for printing: texts are escaped, other values unchanged.
template <typename Value>
auto Printed(const Value& value) {
  if constexpr (std::is_same_v<Value, Lines>) {
    return EscapeTerminalLines(value.text);
  } else if constexpr (std::is_convertible_v<const Value&, std::string_view>) {
    return EscapeTerminal(value);
  } else {
    return value;
  }
}

template <typename Value>
using PrintedAs = decltype(Printed(std::declval<const std::remove_cvref_t<Value>&>()));

/// Formats values. Texts within a range pass only the second escape, which keeps line ends.
template <typename... Values>
std::string Formatted(fmt::format_string<PrintedAs<Values>...> format, const Values&... values) {
  return EscapeTerminalLines(fmt::format(format, Printed(values)...));
}

}  // namespace internal

/// Prints for people: texts among the values never act on the terminal (EscapeTerminal).
template <typename... Values>
void Print(fmt::format_string<internal::PrintedAs<Values>...> format, const Values&... values) {
  PrintMessage(internal::Formatted<Values...>(format, values...));
}

template <typename... Values>
void PrintError(fmt::format_string<internal::PrintedAs<Values>...> format,
                const Values&... values) {
  PrintErrorText(internal::Formatted<Values...>(format, values...));
}

/// Returns the exit code of a program that ends with `code`: 2 instead of 0 if any text could not
/// be written to standard output. Prints the reason, unless the reader of a pipe has closed it, as
/// `| head` does by design.
int FinishOutput(int code);

// Lists, and words in messages: counts, the nearest spelling of a mistyped word.

/// Returns a T of f(element) for each element; `f` may be a member.
template <class T, class Range, class Function>
std::vector<T> Mapped(const Range& range, Function f) {
  std::vector<T> list;
  for (const auto& element : range) list.emplace_back(std::invoke(f, element));
  return list;
}

/// Returns the texts f(element) of all elements with the separator between them.
template <class Range, class Function = std::identity>
std::string Joined(const Range& range, std::string_view separator, Function f = {}) {
  std::string text;
  bool is_first = true;
  for (const auto& element : range) {
    if (!is_first) text += separator;
    text += std::invoke(f, element);
    is_first = false;
  }
  return text;
}

/// Returns true if an element, or its member `projection`, equals the value.
template <class Range, class T, class Projection = std::identity>
bool Contains(const Range& range, const T& value, Projection projection = {}) {
  return std::ranges::find(range, value, projection) != std::end(range);
}

/// Appends a value that the list does not contain yet.
template <class T>
void AddOnce(std::vector<T>& list, const std::type_identity_t<T>& value) {
  if (!Contains(list, value)) list.push_back(value);
}

/// Returns the number that all of `text` is, as std::from_chars reads it.
template <class Number, class... Base>
std::optional<Number> WholeNumber(std::string_view text, Base... base) {
  Number number{};
  const char* const text_end = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), text_end, number, base...);
  return error == std::errc() && end == text_end ? std::optional(number) : std::nullopt;
}

/// Returns the two numbers of "a/b", as far as they are numbers.
template <class Number>
std::pair<std::optional<Number>, std::optional<Number>> Quotient(std::string_view text) {
  const std::size_t bar = text.find('/');
  if (bar == text.npos) return {};
  return {WholeNumber<Number>(text.substr(0, bar)), WholeNumber<Number>(text.substr(bar + 1))};
}

/// Returns the length of the first character of a UTF-8 text [bytes], or 0 if it is invalid.
std::size_t CharacterLength(std::string_view text);

/// True if a byte of UTF-8 continues the character before it.
inline bool ContinuesCharacter(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0u) == 0x80u;
}

std::size_t CountCharacters(std::string_view text);

/// Returns the first `most` bytes, without a partial character, and "..." if more follows.
std::string Abbreviated(const std::string& text, std::size_t most = 60);

/// Returns "a, b and c", or a list with another last word.
std::string ListInWords(const std::vector<std::string>& words, std::string_view last = "and");

/// Returns "A", "B", ..., "Z", "A1", ...: a short name of the index-th of many things.
std::string LetterOf(std::size_t index);

/// Returns "1 run", "2 runs", "2 bodies".
std::string WithCount(std::size_t count, const std::string& word);

/// Returns the number of single-letter insertions, deletions, replacements and swaps of neighbours
/// that turn one word into the other (restricted Damerau-Levenshtein distance).
int EditDistance(std::string_view a, std::string_view b);

/// Returns the word of `known` nearest to `given`, ignoring case, or "" if none is near enough. A
/// word is near if one is the start of the other. Otherwise the changes may not exceed a third of
/// the letters of `given` (at least one), and must be fewer than the letters of the word. The first
/// of equally near words wins.
std::string NearestSpelling(std::string_view given, const std::vector<std::string>& known);

}  // namespace loopbench::harness
