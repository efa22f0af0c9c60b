#include "harness/isolation/processes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <new>
#include <stdexcept>
#include <vector>

#include "harness/isolation/child_watch.h"
#include "harness/isolation/interruption.h"
#include "harness/text/files.h"
#include "harness/text/out_of_memory.h"
#include "mechanism/model/dense_memory.h"

namespace loopbench::harness {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kThrewExit = 91, kMemoryExit = 92,
              kFaultExit = 93;  ///< free for any use by this program

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

[[noreturn]] void Fail(std::string_view what) {
  throw std::runtime_error(fmt::format("cannot {}: {}", what, std::strerror(errno)));
}

/// Address space in use [bytes].
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
  constexpr double kNoLimit = 1e18;  // beyond any machine, and soon beyond the integer
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

/// The child's life. It never returns: destructors and exit handlers belong to the parent.
[[noreturn]] void Work(int answer, pid_t parent, const ProcessLimits& limits,
                       const std::function<std::string()>& work) {
  Interruption::LeaveToParent();
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(EXIT_FAILURE);  // it died before the line above
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

struct Child {
  std::size_t piece = 0;
  pid_t pid = -1;
  int answer = -1;
  ProcessLimits limits;
  Clock::time_point begin;
  ChildWatch watch;
  std::string text;
  std::string killed;  ///< why, in words

  /// No sooner than in this time can it be over its limits or be worth a look [s].
  double Wait() const {
    if (!killed.empty() || limits.cpu_s <= 0.0) return kLook_s;
    return std::clamp(limits.cpu_s - watch.cpu_s(), 0.01, kLook_s);
  }

  void KillIfOver() {
    if (!killed.empty()) return;
    if (limits.cpu_s > 0.0 && watch.cpu_s() >= limits.cpu_s) {
      killed = fmt::format("killed after {:.4g} s of CPU time", limits.cpu_s);
    } else if (watch.idle_s() >= limits.idle_s) {
      killed = fmt::format("killed after {:.4g} s asleep, computing nothing", limits.idle_s);
    } else {
      return;
    }
    ::kill(pid, SIGKILL);  // its pipe closes, which the next wait sees
  }
};

/// The children under way; kills them when it goes.
class Children {
 public:
  ~Children() {
    for (const Child& child : running_) {
      ::kill(child.pid, SIGKILL);
      ::waitpid(child.pid, nullptr, 0);
      ::close(child.answer);
    }
  }

  std::size_t size() const { return running_.size(); }

  void Start(std::size_t piece, const ProcessLimits& limits,
             const std::function<std::string()>& work) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) Fail("open a pipe");
    std::fflush(nullptr);  // or the child would hold a copy of what waits to be printed
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
    running_.push_back({piece, pid, ends[0], limits, Clock::now(), ChildWatch(pid), {}, {}});
  }

  /// Waits until something happens and returns the children that ended.
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
      child.watch.Look(unread);
      child.KillIfOver();
      if (!unread || Read(child)) continue;
      ended.push_back(std::move(child));
      running_.erase(running_.begin() + static_cast<std::ptrdiff_t>(i));
    }
    return ended;
  }

 private:
  /// Takes what the pipe has; false at its end.
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
  result.wall_s = SecondsSince(child.begin);
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
        fmt::format("{} more than {} MiB", child.text.empty() ? "asked for" : child.text + ",",
                    child.limits.memory_mb);
  } else if (!child.killed.empty()) {
    result.ending = ProcessEnding::kOverTime;
    result.text = child.killed;
  } else {
    result.ending = ProcessEnding::kCrashed;
    result.text = WIFSIGNALED(status) ? fmt::format("ended by signal {} ({})", WTERMSIG(status),
                                                    ::strsignal(WTERMSIG(status)))
                                      : fmt::format("left with exit code {}", WEXITSTATUS(status));
  }
  return result;
}

}  // namespace

std::string_view OutcomeOf(ProcessEnding ending) {
  switch (ending) {
    case ProcessEnding::kOverTime:
      return "process-time-limit";
    case ProcessEnding::kOverMemory:
      return "memory-limit";
    default:
      return "crashed";
  }
}

bool LimitsMemory() {
#ifdef __SANITIZE_ADDRESS__
  return false;
#else
  return true;
#endif
}

void RunInProcesses(const std::function<std::optional<std::size_t>()>& next, int jobs,
                    const std::function<std::string(std::size_t)>& work,
                    const std::function<ProcessLimits(std::size_t)>& limits,
                    const std::function<void(std::size_t, const ProcessResult&)>& done,
                    const ProcessNews& news) {
  Children children;
  for (;;) {
    while (children.size() < static_cast<std::size_t>(jobs)) {
      const std::optional<std::size_t> piece = next();
      if (!piece) break;
      children.Start(*piece, limits(*piece), [&work, piece] { return work(*piece); });
      if (news.started) news.started(*piece);
    }
    if (children.size() == 0) return;
    for (Child& child : children.Wait()) {
      const std::size_t piece = child.piece;
      done(piece, ResultOf(std::move(child)));
    }
    Interruption::Check();
    if (news.waited) news.waited();
  }
}

void RunInProcesses(std::size_t count, int jobs,
                    const std::function<std::string(std::size_t)>& work,
                    const std::function<ProcessLimits(std::size_t)>& limits,
                    const std::function<void(std::size_t, const ProcessResult&)>& done,
                    const ProcessNews& news) {
  const auto next = [i = std::size_t{0}, count]() mutable {
    return i < count ? std::optional(i++) : std::nullopt;
  };
  RunInProcesses(next, jobs, work, limits, done, news);
}

}  // namespace loopbench::harness
