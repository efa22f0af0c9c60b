#include "harness/run/processes.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <fstream>
#include <memory>
#include <new>
#include <set>

#include "harness/base/text.h"
#include "mechanism/algebra/dense_memory.h"

namespace loopbench::harness {
namespace {

/// Returns the state R, S, D, T, .. from /proc/PID/stat; '?' if absent.
char StateOf(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/stat", pid));
  std::string line;
  std::getline(file, line);
  // "pid (name) state ..": the name may contain any character, even parentheses
  const std::size_t name_end = line.rfind(") ");
  return name_end == std::string::npos || name_end + 2 >= line.size() ? '?' : line[name_end + 2];
}

/// True if the process has children: it waits for a program, whose time has limits of its own.
bool RunsProgram(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{0}/task/{0}/children", pid));
  pid_t child = 0;
  return static_cast<bool>(file >> child);
}

constexpr int kSignals[] = {SIGHUP, SIGINT, SIGTERM};

volatile std::sig_atomic_t asked = 0;

extern "C" void Remember(int signal) { asked = signal; }

constexpr int kThrewExit = 91, kMemoryExit = 92,
              kFaultExit = 93;  ///< free for any use by this program

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

[[noreturn]] void Fail(std::string_view what) {
  throw std::runtime_error(fmt::format("cannot {}: {}", what, std::strerror(errno)));
}

/// Returns the address space in use [bytes].
rlim_t AddressSpace() {
  std::ifstream statm("/proc/self/statm");
  rlim_t pages = 0;
  statm >> pages;
  return pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE));
}

void SetLimits(const ProcessLimits& limits) {
  const rlimit no_core = {0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  if (limits.memory_mb <= 0.0 || !LimitsMemory()) return;
  const double allowed = limits.memory_mb * 1024.0 * 1024.0;
  constexpr double kNoLimit = 1e18;  // beyond any machine, and below the integer overflow
  if (allowed >= kNoLimit) return;
  const rlim_t bytes = AddressSpace() + static_cast<rlim_t>(allowed);
  const rlimit memory = {bytes, bytes};
  ::setrlimit(RLIMIT_AS, &memory);
}

void WriteAll(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) ::_exit(EXIT_FAILURE);
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

/// Runs the child. Never returns: destructors and exit handlers belong to the parent.
[[noreturn]] void Work(int answer, pid_t parent, const ProcessLimits& limits,
                       const std::function<std::string()>& work) {
  // the parent decides, since a terminal sends Ctrl-C to both
  for (const int signal : kSignals) std::signal(signal, SIG_IGN);
  // an ignored or blocked signal survives exec
  sigset_t end;
  ::sigemptyset(&end);
  ::sigaddset(&end, kRemoveAndEnd);
  ::sigprocmask(SIG_UNBLOCK, &end, nullptr);
  std::signal(kRemoveAndEnd, SIG_DFL);
  ::prctl(PR_SET_PDEATHSIG, kRemoveAndEnd);
  if (::getppid() != parent) ::_exit(EXIT_FAILURE);  // the parent died before the line above
  SetLimits(limits);
  ExitWithoutMemory(kMemoryExit, "");
  try {
    WriteAll(answer, work());
  } catch (const TooDense& error) {
    WriteAll(answer, error.what());
    ::_exit(kMemoryExit);
  } catch (const std::bad_alloc&) {
    ::_exit(kMemoryExit);
  } catch (const SystemFault& error) {
    WriteAll(answer, error.what());
    ::_exit(kFaultExit);
  } catch (const std::exception& error) {
    WriteAll(answer, error.what());
    ::_exit(kThrewExit);
  }
  ::_exit(EXIT_SUCCESS);
}

constexpr double kLook_s = 0.25;  ///< between two checks of a child
constexpr double kEnd_s = 3.0;    ///< for a child to end its program and remove its files

struct Child {
  std::size_t piece = 0;
  pid_t pid = -1;
  int answer = -1;
  ProcessLimits limits;
  double begin = WallSeconds(), looked = begin, killed_at = 0.0;  ///< [s]
  double cpu_before = 0.0;                                        ///< at the last check [s]
  double idle_s = 0.0;  ///< continuous time asleep since it last computed
  std::string text = {};
  std::string killed = {};  ///< reason, as text

  /// Returns the CPU time used so far by all threads [s].
  double cpu_s() const {
    clockid_t clock{};
    std::timespec time{};
    if (::clock_getcpuclockid(pid, &clock) != 0 || ::clock_gettime(clock, &time) != 0) return 0.0;
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  /// Returns the time before which no limit can be exceeded and no check is needed [s].
  double Wait() const {
    if (!killed.empty() || limits.cpu_s <= 0.0) return kLook_s;
    return std::clamp(limits.cpu_s - cpu_s(), 0.01, kLook_s);
  }

  /// Measures its sleep. `unread`: its answer is waiting to be read, which does not count as sleep.
  /// States other than S (ready, stopped, waiting for a disk) are caused by the machine. The parent
  /// may be stopped too: a check adds at most the nominal time between two.
  void Look(bool unread) {
    const double since = WallSeconds() - looked;
    if (since < kLook_s) return;
    constexpr double kComputes = 0.01;  // minimum CPU share of computing; naps use less
    const double used = cpu_s();
    if (used - cpu_before > kComputes * since || unread) {
      idle_s = 0.0;
    } else if (StateOf(pid) == 'S' && !RunsProgram(pid)) {
      idle_s += std::min(since, kLook_s);
    }
    looked = WallSeconds();
    cpu_before = used;
  }

  void KillIfOver() {
    if (!killed.empty()) {
      if (WallSeconds() - killed_at > kEnd_s) ::kill(pid, SIGKILL);
      return;
    }
    if (limits.cpu_s > 0.0 && cpu_s() >= limits.cpu_s) {
      killed = fmt::format("killed after {:.4g} s of CPU time", limits.cpu_s);
    } else if (idle_s >= limits.idle_s) {
      killed = fmt::format("killed after {:.4g} s asleep, computing nothing", limits.idle_s);
    } else {
      return;
    }
    killed_at = WallSeconds();
    ::kill(pid, kRemoveAndEnd);  // its pipe closes, which the next Wait() detects
  }
};

/// Running children; the destructor ends them.
class Children {
 public:
  ~Children() {
    for (const Child& child : running_) ::kill(child.pid, kRemoveAndEnd);
    const double begin = WallSeconds();
    for (const Child& child : running_) {
      while (::waitpid(child.pid, nullptr, WNOHANG) == 0) {
        if (WallSeconds() - begin > kEnd_s) ::kill(child.pid, SIGKILL);
        ::usleep(1000);
      }
      ::close(child.answer);
    }
  }

  std::size_t size() const { return running_.size(); }

  void Start(std::size_t piece, const ProcessLimits& limits,
             const std::function<std::string()>& work) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) Fail("open a pipe");
    std::fflush(nullptr);  // otherwise the child would copy pending output
    const pid_t parent = ::getpid();
    const pid_t pid = ::fork();
    if (pid == 0) {
      ::close(ends[0]);
      for (const Child& other : running_) ::close(other.answer);
      Work(ends[1], parent, limits, work);
    }
    ::close(ends[1]);
    if (pid < 0) {
      ::close(ends[0]);
      Fail("start a process");
    }
    running_.push_back({piece, pid, ends[0], limits});
  }

  /// Waits for an event and returns the children that ended.
  std::vector<Child> Wait() {
    std::vector<pollfd> waiting;
    double wait_s = kLook_s;
    for (const Child& child : running_) {
      waiting.push_back({child.answer, POLLIN, 0});
      wait_s = std::min(wait_s, child.Wait());
    }
    const int timeout_ms = static_cast<int>(wait_s * 1e3) + 1;
    if (::poll(waiting.data(), waiting.size(), timeout_ms) < 0 && errno != EINTR) {
      Fail("wait for processes");
    }
    std::vector<Child> ended;
    for (std::size_t i = running_.size(); i-- > 0;) {
      Child& child = running_[i];
      const bool unread = (waiting[i].revents & (POLLIN | POLLHUP)) != 0;
      child.Look(unread);
      child.KillIfOver();
      if (!unread || Read(child)) continue;
      ended.push_back(std::move(child));
      running_.erase(running_.begin() + static_cast<std::ptrdiff_t>(i));
    }
    return ended;
  }

 private:
  /// Reads available bytes from the pipe; returns false at its end.
  static bool Read(Child& child) {
    char buffer[1 << 16];
    const ssize_t count = ::read(child.answer, buffer, sizeof buffer);
    if (count < 0) return errno == EINTR || errno == EAGAIN;
    child.text.append(buffer, static_cast<std::size_t>(count));
    return count > 0;
  }

  std::vector<Child> running_;
};

ProcessResult ResultOf(Child child) {
  int status = 0;
  rusage usage{};
  while (::wait4(child.pid, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  ::close(child.answer);
  ProcessResult result;
  result.wall_s = WallSeconds() - child.begin;
  result.cpu_s = Seconds(usage.ru_utime) + Seconds(usage.ru_stime);
  if (WIFEXITED(status) && WEXITSTATUS(status) == EXIT_SUCCESS) {
    result.text = std::move(child.text);
  } else if (WIFEXITED(status) && WEXITSTATUS(status) == kFaultExit) {
    throw SystemFault(child.text);
  } else if (WIFEXITED(status) && WEXITSTATUS(status) == kThrewExit) {
    result.ending = ProcessEnding::kThrew;
    result.text = std::move(child.text);
  } else if (WIFEXITED(status) && WEXITSTATUS(status) == kMemoryExit) {
    result.ending = ProcessEnding::kOverMemory;
    result.text =
        fmt::format("{} more than {} MiB", child.text.empty() ? "requested" : child.text + ",",
                    child.limits.memory_mb);
  } else if (!child.killed.empty()) {
    result.ending = ProcessEnding::kOverTime;
    result.text = child.killed;
  } else {
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    constexpr int kFromOutside[] = {SIGKILL, SIGTERM, SIGINT, SIGHUP, SIGQUIT};
    const bool was_killed = std::ranges::find(kFromOutside, signal) != std::end(kFromOutside);
    result.ending = was_killed ? ProcessEnding::kKilled : ProcessEnding::kCrashed;
    result.text = signal == 0 ? fmt::format("left with exit code {}", WEXITSTATUS(status))
                              : fmt::format("ended by signal {} ({})", signal, ::strsignal(signal));
  }
  return result;
}

/// As RunInProcesses() for each piece that `next` returns. `next` returns nothing while there is
/// nothing to start, and is called again after each ending.
void Supervise(const std::function<std::optional<std::size_t>()>& next, int jobs,
               const std::function<std::string(std::size_t)>& work,
               const std::function<ProcessLimits(std::size_t)>& limits,
               const std::function<void(std::size_t, const ProcessResult&)>& done,
               const ProcessNews& news) {
  Children children;
  std::vector<std::size_t> killed;  // to be started again
  std::set<std::size_t> started_again;
  for (;;) {
    while (children.size() < static_cast<std::size_t>(jobs)) {
      std::optional<std::size_t> piece;
      if (killed.empty()) {
        piece = next();
      } else {
        piece = killed.back();
        killed.pop_back();
      }
      if (!piece) break;
      children.Start(*piece, limits(*piece), [&work, piece] { return work(*piece); });
      if (news.started) news.started(*piece);
    }
    if (children.size() == 0) return;
    for (Child& child : children.Wait()) {
      const std::size_t piece = child.piece;
      const ProcessResult result = ResultOf(std::move(child));
      if (result.ending == ProcessEnding::kKilled && started_again.insert(piece).second) {
        killed.push_back(piece);
      } else {
        done(piece, result);
      }
    }
    Interruption::Check();
    if (news.waited) news.waited();
  }
}

/// @param deliver  receives the printed text, before any exception
int FromChild(const std::string& name, const ProcessLimits& limits,
              const std::function<int()>& work,
              const std::function<void(const std::string&)>& deliver) {
  const MemoryFile output("stdout");
  ProcessResult result;
  try {
    result = RunInProcess(limits, [&] {
      // line by line, so that a killed child loses no complete line
      ::dup2(output.descriptor(), STDOUT_FILENO);
      ::setlinebuf(stdout);
      return std::to_string(FinishOutput(work()));
    });
  } catch (const SystemFault&) {
    deliver(output.Text());
    throw;
  }
  deliver(output.Text());
  if (result.ending == ProcessEnding::kThrew) throw std::runtime_error(result.text);
  if (result.ending == ProcessEnding::kAnswered) return std::stoi(result.text);
  PrintError("{}: cut off ({}): {}\n", name, OutcomeOf(result.ending), result.text);
  return 2;
}

constexpr double kBusy_s = 0.1;     ///< duration of a process; its start takes about 5 ms
constexpr std::size_t kMost = 500;  ///< maximum tasks of a process: all repeat after a crash
constexpr std::size_t kGrowth = 4;  ///< from one process to the next, while times are estimates

/// Returns "LENGTH\n" and the text, for each answer.
std::string Packed(const std::vector<std::string>& answers) {
  std::string text;
  for (const std::string& answer : answers) text += fmt::format("{}\n{}", answer.size(), answer);
  return text;
}

/// Returns an empty list unless each task has an answer.
std::vector<TaskResult> ReadAnswers(const std::vector<std::size_t>& tasks,
                                    const ProcessResult& process) {
  const std::string_view text = process.text;
  std::vector<TaskResult> results;
  const auto count = static_cast<double>(tasks.size());
  std::size_t at = 0;
  for (const std::size_t task : tasks) {
    std::size_t length = 0;
    const auto [end, error] = std::from_chars(text.data() + at, text.data() + text.size(), length);
    if (error != std::errc() || end == text.data() + text.size()) return {};
    at = static_cast<std::size_t>(end - text.data()) + 1;
    if (length > text.size() - at) return {};
    results.push_back({task,
                       {ProcessEnding::kAnswered, std::string(text.substr(at, length)),
                        process.wall_s / count, process.cpu_s / count}});
    at += length;
  }
  return at == text.size() ? results : std::vector<TaskResult>();
}

/// Returns the lower of two limits, of which 0 is none.
double Lower(double a, double b) { return a > 0.0 && b > 0.0 ? std::min(a, b) : a + b; }

}  // namespace

Interruption::Interruption() {
  asked = 0;
  for (std::size_t i = 0; i < before_.size(); ++i) {
    ::sigaction(kSignals[i], nullptr, &before_[i]);
    if (before_[i].sa_handler == SIG_IGN) continue;
    struct sigaction remember = {};
    remember.sa_handler = &Remember;
    // SA_RESTART: writes in progress complete; waiting for processes is still interrupted
    remember.sa_flags = static_cast<int>(SA_RESTART | SA_RESETHAND);
    ::sigaction(kSignals[i], &remember, nullptr);
  }
}

Interruption::~Interruption() {
  for (std::size_t i = 0; i < before_.size(); ++i) ::sigaction(kSignals[i], &before_[i], nullptr);
  asked = 0;
}

void Interruption::Check() {
  if (asked != 0) throw Interrupted(asked);
}

std::optional<std::string> PlantedFault(const Record& keys) {
  const char* planted = std::getenv("LOOPBENCH_FAULT");
  if (planted == nullptr) return std::nullopt;
  const std::string_view text = planted;
  const std::size_t colon = text.find(':');
  const std::string_view fault = text.substr(0, colon);
  if (colon == std::string_view::npos || !Matches(keys, {ParseCondition(text.substr(colon + 1))})) {
    return std::nullopt;
  }
  if (fault == "crash") std::raise(SIGSEGV);
  if (fault == "throw") throw std::logic_error("planted");
  if (fault == "garbage") return "{\"kind\": \"accu\x01\xff";
  if (fault == "memory") {
    std::vector<std::unique_ptr<char[]>> hoard;
    for (;;) hoard.emplace_back(new char[1 << 26]);  // requested but not touched: fast
  }
  while (fault == "hang") ::pause();
  return std::nullopt;
}

std::string_view OutcomeOf(ProcessEnding ending) {
  return ending == ProcessEnding::kOverTime     ? "process-time-limit"
         : ending == ProcessEnding::kOverMemory ? "memory-limit"
                                                : "crashed";
}

bool LimitsMemory() {
#ifdef __SANITIZE_ADDRESS__
  return false;
#else
  return true;
#endif
}

void RunInProcesses(std::size_t count, int jobs,
                    const std::function<std::string(std::size_t)>& work,
                    const std::function<ProcessLimits(std::size_t)>& limits,
                    const std::function<void(std::size_t, const ProcessResult&)>& done,
                    const ProcessNews& news) {
  const auto next = [i = std::size_t{0}, count]() mutable {
    return i < count ? std::optional(i++) : std::nullopt;
  };
  Supervise(next, jobs, work, limits, done, news);
}

ProcessResult RunInProcess(const ProcessLimits& limits, const std::function<std::string()>& work) {
  ProcessResult result;
  RunInProcesses(
      1, 1, [&](std::size_t) { return work(); }, [&](std::size_t) { return limits; },
      [&](std::size_t, const ProcessResult& ended) { result = ended; });
  return result;
}

int PrintFromChild(const std::string& name, const ProcessLimits& limits,
                   const std::function<int()>& work) {
  return FromChild(name, limits, work, &PrintText);
}

int TextFromChild(const std::string& name, const ProcessLimits& limits,
                  const std::function<int()>& work, std::string* text) {
  return FromChild(name, limits, work, [text](const std::string& printed) { *text = printed; });
}

std::size_t RunInSharedProcesses(
    std::size_t count, int jobs,
    const std::function<std::vector<std::string>(const std::vector<std::size_t>&)>& work,
    const std::function<ProcessLimits(std::size_t)>& limits,
    const std::function<void(const std::vector<TaskResult>&)>& done, const Sharing& sharing,
    const ProcessNews& news) {
  std::deque<std::vector<std::size_t>> processes;  // by number; finished ones are empty
  std::deque<std::size_t> alone;                   // tasks of failed processes
  std::size_t dealt = 0, size = 1;                 // tasks given to processes; of the next process
  std::size_t begun = 0;                           // tasks start in order, except for repetitions
  const auto together = [&](std::size_t task) {
    return sharing.is_allowed ? sharing.together(task) : 1;
  };
  const auto next = [&]() -> std::optional<std::size_t> {
    std::vector<std::size_t> tasks;
    if (!alone.empty()) {
      tasks = {alone.front()};
      alone.pop_front();
    } else if (dealt < count) {
      // smaller batches at the end, so that the last processes end together
      const std::size_t left = count - dealt;
      const std::size_t fair =
          std::max<std::size_t>(1, left / (2 * static_cast<std::size_t>(jobs)));
      tasks.resize(std::min(std::max(std::min(size, fair), together(dealt)), left));
      for (std::size_t& task : tasks) task = dealt++;
    } else {
      return std::nullopt;
    }
    processes.push_back(std::move(tasks));
    return processes.size() - 1;
  };
  const auto limits_of = [&](std::size_t process) {
    const std::vector<std::size_t>& tasks = processes[process];
    ProcessLimits least = limits(tasks.front());
    for (std::size_t i = 1; i < tasks.size(); ++i) {
      const ProcessLimits own = limits(tasks[i]);
      least = {Lower(least.cpu_s, own.cpu_s), Lower(least.memory_mb, own.memory_mb),
               std::min(least.idle_s, own.idle_s)};
    }
    const auto times = static_cast<double>(std::min(together(tasks.front()), tasks.size()));
    least.cpu_s *= times;
    least.memory_mb *= times;
    return least;
  };
  const auto ended = [&](std::size_t process, const ProcessResult& result) {
    const std::vector<std::size_t> tasks = std::exchange(processes[process], {});
    std::vector<TaskResult> results;
    if (result.ending == ProcessEnding::kAnswered) results = ReadAnswers(tasks, result);
    if (results.empty() && tasks.size() > 1) {
      alone.insert(alone.end(), tasks.begin(), tasks.end());
      size = 1;
      return;
    }
    // the reader of the records reports an answer that cannot be read
    if (results.empty()) results = {{tasks.front(), result}};
    if (result.ending == ProcessEnding::kAnswered && sharing.is_allowed) {
      const double each_s = std::max(result.cpu_s / static_cast<double>(tasks.size()), 1e-6);
      const auto fitting = static_cast<std::size_t>(kBusy_s / each_s);
      size = std::clamp<std::size_t>(fitting, 1, std::min(kMost, kGrowth * size));
    }
    done(results);
  };
  const auto started = [&](std::size_t process) {
    for (const std::size_t task : processes[process]) {
      if (task < begun) continue;
      begun = task + 1;
      if (news.started) news.started(task);
    }
  };
  Supervise(next, jobs, [&](std::size_t process) { return Packed(work(processes[process])); },
            limits_of, ended, {started, news.waited});
  return processes.size();
}

}  // namespace loopbench::harness
