#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <mutex>
#include <new>
#include <set>

#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

/// Paths to remove, readable by a signal handler. If all places are taken, only the owner removes a
/// path.
struct Registered {
  std::atomic<const char*> path = nullptr;
  std::atomic<pid_t> owner = 0;
};
std::array<Registered, 64> registered;

/// Async-signal-safe: another program removes the files.
extern "C" void RemoveAndEnd(int signal) {
  EndProgram();  // it could write more
  std::array<const char*, registered.size() + 4> words = {"rm", "-rf", "--"};
  std::size_t count = 3;
  for (const Registered& one : registered) {
    const char* path = one.path;
    if (path != nullptr && one.owner == ::getpid()) words[count++] = path;
  }
  const pid_t child = count > 3 ? ::_Fork() : -1;
  if (child == 0) {
    ::execv("/bin/rm", const_cast<char**>(words.data()));
    ::_exit(EXIT_FAILURE);
  }
  while (child > 0 && ::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

/// Returns a locked descriptor of the folder; -1 if another process has the lock or removed it.
int LockFolder(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  struct stat opened = {}, named = {};
  if (descriptor >= 0 && ::flock(descriptor, LOCK_EX | LOCK_NB) == 0 &&
      ::fstat(descriptor, &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
      opened.st_ino == named.st_ino && opened.st_uid == ::geteuid()) {
    return descriptor;
  }
  if (descriptor >= 0) ::close(descriptor);
  return -1;
}

/// Removes the folders of killed processes: no process holds their locks.
void RemoveAbandoned(const std::filesystem::path& folder, const std::string& begin) {
  std::error_code ignored;
  for (const auto& path : EntriesOf(folder)) {
    const std::string name = path.filename().string();
    const bool is_one = name.starts_with(begin) && name.size() == begin.size() + 6;
    const int lock = is_one ? LockFolder(path) : -1;
    if (lock < 0) continue;
    std::filesystem::remove_all(path, ignored);
    ::close(lock);
  }
}

namespace fs = std::filesystem;

using FileId = std::pair<dev_t, ino_t>;

FileId IdOf(const struct stat& status) { return {status.st_dev, status.st_ino}; }

/// Inputs by device and file number: paths and links to one file are one input.
struct Inputs {
  std::mutex mutex;
  bool are_noted = false;
  std::set<FileId> files;
};
Inputs inputs;

[[noreturn]] void Refuse(const fs::path& path, std::string_view found) {
  throw std::runtime_error(
      fmt::format("cannot write '{}': found {}, expected a file that can be replaced, a pipe or a "
                  "character device",
                  path.string(), found));
}

/// Returns true for a file that only runs write: a trajectory, mechanism or reference of a store,
/// in the folder of this kind and named by its identifier of 16 hexadecimal digits.
bool IsOfStore(const fs::path& file) {
  const std::string folder = file.parent_path().filename(), name = file.stem();
  return (folder == "trajectories" || folder == "mechanisms" || folder == "references") &&
         name.size() == 16 && name.find_first_not_of("0123456789abcdef") == std::string::npos;
}

/// Destination of output to a path.
struct Destination {
  fs::path target = {};  ///< path after links; "" if output goes into the existing file
  int stream = -1;       ///< standard stream of the path
  mode_t mode = 0;       ///< mode of an existing file
};

Destination DestinationOf(const fs::path& path, Onto onto) {
  struct stat there = {}, other = {};
  if (::stat(path.c_str(), &there) != 0) {
    if (errno != ENOENT) FailOn("write", path);
    return {.target = BehindLinks(path)};
  }
  if (S_ISDIR(there.st_mode)) Refuse(path, "a folder");
  if (!S_ISREG(there.st_mode) && !S_ISCHR(there.st_mode) && !S_ISFIFO(there.st_mode)) {
    Refuse(path, S_ISBLK(there.st_mode) ? "a block device" : "a socket");
  }
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) {
    if (::fstat(stream, &other) != 0 || IdOf(other) != IdOf(there)) continue;
    if (stream == STDOUT_FILENO && !S_ISCHR(there.st_mode)) KeepOutputForFile();
    return {.stream = stream};
  }
  if (!S_ISREG(there.st_mode)) return {};
  {
    const std::lock_guard lock(inputs.mutex);
    if (onto == Onto::kNoInput && inputs.files.contains(IdOf(there))) {
      Refuse(path, "an input of this command");
    }
  }
  if (::access(path.c_str(), W_OK) != 0) FailOn("write", path);
  const fs::path target = BehindLinks(path);
  std::error_code ignored;
  if (onto == Onto::kNoInput && IsOfStore(fs::canonical(target, ignored))) {
    Refuse(path, "a file of a store");
  }
  // a file that only /proc names, such as a removed file
  if (::stat(target.c_str(), &other) != 0 || IdOf(other) != IdOf(there)) return {};
  return {.target = target, .mode = there.st_mode & 07777};
}

/// Returns a name that no other thread or process uses.
fs::path PartBeside(fs::path target, std::string_view ending) {
  static std::atomic<int> counter{0};
  target += ending.empty() ? fmt::format(".{}-{}.tmp", ::getpid(), counter++) : std::string(ending);
  return target;
}

/// Returns true if PartBeside() made the name in an ended process here, or on another machine.
bool IsOfEndedProcess(const std::string& name) {
  const std::size_t begin = name.rfind('.', name.size() - std::min<std::size_t>(name.size(), 5));
  int pid = 0, number = 0, length = 0;
  if (begin == std::string::npos) return false;
  const char* ending = name.c_str() + begin;
  const int found = std::sscanf(ending, ".%d-%d.tmp%n", &pid, &number, &length);
  return found == 2 && begin + static_cast<std::size_t>(length) == name.size() && pid > 0 &&
         ::kill(pid, 0) != 0 && errno == ESRCH;
}

std::atomic<pid_t> under_way = 0;

int exit_code = 2;
std::string_view message_without_memory;
std::terminate_handler previous_handler = nullptr;

void Terminate() {
  if (std::current_exception() != nullptr) {
    try {
      throw;
    } catch (const std::bad_alloc&) {
      [[maybe_unused]] const auto written =
          ::write(STDERR_FILENO, message_without_memory.data(), message_without_memory.size());
      ::_exit(exit_code);
    } catch (...) {  // as before
    }
  }
  previous_handler();
}

}  // namespace

void FailOn(std::string_view verb, const std::filesystem::path& path) {
  throw SystemFault(fmt::format("cannot {} '{}': {}", verb, path.string(), std::strerror(errno)));
}

void MakeFolderOf(const std::filesystem::path& path) {
  if (!path.has_parent_path()) return;
  std::error_code error;
  std::filesystem::create_directories(path.parent_path(), error);
  if (!error) return;
  std::string reason = error.message();
  std::error_code ignored;
  for (auto folder = path.parent_path(); folder.has_filename(); folder = folder.parent_path()) {
    const auto kind = std::filesystem::symlink_status(folder, ignored).type();
    if (kind != std::filesystem::file_type::symlink || std::filesystem::exists(folder, ignored)) {
      continue;
    }
    reason = fmt::format("'{}' is a symbolic link to '{}', which is not there", folder.string(),
                         std::filesystem::read_symlink(folder, ignored).string());
  }
  throw std::runtime_error(
      fmt::format("cannot make folder '{}': {}", path.parent_path().string(), reason));
}

void WriteFileAtomically(const std::filesystem::path& path, std::string_view text, Onto onto) {
  OutputFile file(path, onto);
  file.Write(text);
  file.Finish();
}

bool WriteNewFile(const std::filesystem::path& path, std::string_view text) {
  if (std::filesystem::exists(std::filesystem::symlink_status(path))) return false;
  OutputFile file(path);
  file.Write(text);
  return file.FinishIfNew();
}

void SyncFolderOf(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

void WriteAll(int descriptor, std::string_view text, const std::filesystem::path& path) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) FailOn("write", path);
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

void ForEachBlock(const std::filesystem::path& file,
                  const std::function<void(std::string_view)>& use) {
  std::ifstream in(file, std::ios::binary);
  std::string block(std::size_t{1} << 20, '\0');
  while (in.read(block.data(), static_cast<std::streamsize>(block.size())) || in.gcount() > 0) {
    use(std::string_view(block).substr(0, static_cast<std::size_t>(in.gcount())));
  }
  if (!in.eof()) FailOn("read", file);
}

std::vector<std::filesystem::path> EntriesOf(const std::filesystem::path& folder) {
  std::error_code error;
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    paths.push_back(entry.path());
  }
  std::ranges::sort(paths);
  return paths;
}

std::string ReadFile(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw std::runtime_error(fmt::format(
        "cannot read '{}': found {}, expected a regular file", path.string(),
        std::filesystem::is_directory(status) ? "a folder" : "a device, a pipe or a socket"));
  }
  NoteInput(path);
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) FailOn("read", path);
  std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) FailOn("read", path);
  return text;
}

Unfinished::Unfinished(const std::filesystem::path& path)
    : path_(std::filesystem::absolute(path).string()) {
  for (Registered& one : registered) {
    const char* none = nullptr;
    if (!one.path.compare_exchange_strong(none, path_.c_str())) continue;
    one.owner = ::getpid();
    break;
  }
  struct sigaction end = {}, before = {};
  end.sa_handler = &RemoveAndEnd;
  end.sa_flags = SA_RESTART;
  const auto signals = {SIGHUP, SIGINT, SIGTERM, kRemoveAndEnd};
  for (const int signal : signals) ::sigaddset(&end.sa_mask, signal);
  for (const int signal : signals) {
    ::sigaction(signal, nullptr, &before);
    if (before.sa_handler == SIG_DFL) ::sigaction(signal, &end, nullptr);
  }
}

Unfinished::~Unfinished() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
  for (Registered& one : registered) {
    if (one.path == path_.c_str()) one.path = nullptr;
  }
}

TemporaryFolder::TemporaryFolder(const std::string& name) {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  if (error) {
    const char* named = std::getenv("TMPDIR");
    throw ConfigError(fmt::format("TMPDIR: found '{}', expected a folder for temporary files: {}",
                                  named == nullptr ? "/tmp" : named, error.message()));
  }
  const std::string begin = name + ".tmp-";
  RemoveAbandoned(folder, begin);
  // another process may treat an unlocked folder as abandoned; some file systems have no locks
  for (int i = 0; i < 10 && lock_ < 0; ++i) {
    std::string made = (folder / (begin + "XXXXXX")).string();
    if (::mkdtemp(made.data()) == nullptr) FailOn("make", made);
    unfinished_.emplace(made);
    lock_ = LockFolder(made);
  }
}

TemporaryFolder::~TemporaryFolder() { ::close(lock_); }

CommandInputs::CommandInputs() { inputs.are_noted = true; }

CommandInputs::~CommandInputs() {
  inputs.are_noted = false;
  inputs.files.clear();
}

void NoteInput(const fs::path& path) {
  struct stat status = {};
  const std::lock_guard lock(inputs.mutex);
  if (!inputs.are_noted || ::stat(path.c_str(), &status) != 0) return;
  inputs.files.insert(IdOf(status));
}

void RequireOutput(const fs::path& path) {
  const Destination destination = DestinationOf(path, Onto::kNoInput);
  if (destination.target.empty()) return;
  MakeFolderOf(path);
  const fs::path folder = destination.target.parent_path();
  if (::access(folder.empty() ? "." : folder.c_str(), W_OK) != 0) FailOn("write", path);
}

fs::path BehindLinks(fs::path file) {
  constexpr int kMaxLinks = 40;  // same limit as the system
  for (int i = 0; i < kMaxLinks && fs::is_symlink(fs::symlink_status(file)); ++i) {
    file = file.parent_path() / fs::read_symlink(file);
  }
  return file;
}

void RemoveAbandoned(const fs::path& folder) {
  std::error_code ignored;
  for (const fs::path& path : EntriesOf(folder)) {
    if (!IsOfEndedProcess(path.filename().string())) continue;
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) continue;
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) fs::remove(path, ignored);
    ::close(descriptor);
  }
}

OutputFile::OutputFile(const fs::path& path, Onto onto, std::string_view ending) : path_(path) {
  MakeFolderOf(path);
  Destination destination = DestinationOf(path, onto);
  target_ = std::move(destination.target);
  if (destination.stream >= 0) {
    std::fflush(nullptr);
    descriptor_ = ::fcntl(destination.stream, F_DUPFD_CLOEXEC, 0);
  } else if (target_.empty()) {
    descriptor_ = ::open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC);
  } else {
    constexpr int kMode = 0644;
    part_.emplace(PartBeside(target_, ending));
    descriptor_ = ::open(part_->path().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode);
    if (descriptor_ >= 0 && destination.mode != 0) ::fchmod(descriptor_, destination.mode);
    if (descriptor_ >= 0) ::flock(descriptor_, LOCK_EX | LOCK_NB);  // for RemoveAbandoned()
  }
  if (descriptor_ < 0) FailOn("write", path_);
}

OutputFile::~OutputFile() { Close(); }

void OutputFile::Close() {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
}

void OutputFile::Write(std::string_view text) { WriteAll(descriptor_, text, path_); }

void OutputFile::Finish() {
  if (part_) {
    if (::fsync(descriptor_) != 0) FailOn("write", path_);
    if (::rename(part_->path().c_str(), target_.c_str()) != 0) FailOn("write", path_);
    SyncFolderOf(target_);
  }
  Close();
}

bool OutputFile::FinishIfNew() {
  if (!part_) return false;
  if (::fsync(descriptor_) != 0) FailOn("write", path_);
  const std::string part = part_->path().string();
  int failure = ::link(part.c_str(), path_.c_str()) == 0 ? 0 : errno;
  if (failure == EPERM || failure == EOPNOTSUPP) {  // this file system has no hard links
    const bool done =
        ::renameat2(AT_FDCWD, part.c_str(), AT_FDCWD, path_.c_str(), RENAME_NOREPLACE) == 0;
    failure = done ? 0 : errno;
  }
  errno = failure;
  if (failure != 0 && failure != EEXIST) FailOn("write", path_);
  SyncFolderOf(path_);
  Close();
  return failure == 0;
}

MemoryFile::MemoryFile(const char* what) : descriptor_(::memfd_create(what, MFD_CLOEXEC)) {
  if (descriptor_ < 0) FailOn("make in memory", what);
}

MemoryFile::~MemoryFile() { ::close(descriptor_); }

std::string MemoryFile::Text() const {
  std::string text;
  std::array<char, 1 << 16> buffer{};
  for (off_t at = 0;;) {
    const ssize_t count = ::pread(descriptor_, buffer.data(), buffer.size(), at);
    if (count <= 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(count));
    at += count;
  }
}

std::string ProgramResult::Failure(const std::string& name) const {
  if (error == ENOENT) return fmt::format("'{}' not found", name);
  if (error != 0) return fmt::format("cannot start '{}': {}", name, std::strerror(error));
  if (status == 0) return "";
  if (status > 128) return fmt::format("{} was ended by signal {}", name, status - 128);
  return fmt::format("{} failed with exit code {}: {}", name, status, messages);
}

ProgramResult RunProgram(std::vector<std::string> words, const std::string& input) {
  const MemoryFile in("input"), out("output"), messages("messages");
  WriteAll(in.descriptor(), input, "input of " + words.front());
  ::lseek(in.descriptor(), 0, SEEK_SET);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const MemoryFile fault("errno of exec");
  ProgramResult result;
  const pid_t parent = ::getpid(), child = ::fork();
  if (child == 0) {
    std::signal(SIGTERM, SIG_DFL);  // processes of cases ignore it
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(EXIT_FAILURE);  // the parent died before the line above
    ::dup2(in.descriptor(), STDIN_FILENO);
    ::dup2(out.descriptor(), STDOUT_FILENO);
    ::dup2(messages.descriptor(), STDERR_FILENO);
    ::execvp(arguments[0], arguments.data());
    const int number = errno;
    ::_exit(::write(fault.descriptor(), &number, sizeof number) < 0 ? 126 : 127);
  }
  if (child < 0) result.error = errno;
  if (child < 0) return result;
  under_way = child;
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  under_way = 0;
  if (::pread(fault.descriptor(), &result.error, sizeof result.error, 0) > 0) return result;
  result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.output = out.Text();
  result.messages = messages.Text();
  return result;
}

void EndProgram() {
  const pid_t child = under_way;
  if (child <= 0) return;
  ::kill(child, SIGTERM);
  while (::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void ExitWithoutMemory(int code, std::string_view message) {
  exit_code = code;
  message_without_memory = message;
  const std::terminate_handler known = std::set_terminate(&Terminate);
  if (known != &Terminate) previous_handler = known;
}

}  // namespace loopbench::harness
