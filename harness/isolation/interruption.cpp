#include "harness/isolation/interruption.h"

namespace loopbench::harness {
namespace {

constexpr int kSignals[] = {SIGHUP, SIGINT, SIGTERM};

volatile std::sig_atomic_t asked = 0;

extern "C" void Remember(int signal) { asked = signal; }

}  // namespace

Interrupted::Interrupted(int signal) : std::runtime_error("interrupted"), signal_(signal) {}

Interruption::Interruption() {
  asked = 0;
  for (std::size_t i = 0; i < before_.size(); ++i) {
    ::sigaction(kSignals[i], nullptr, &before_[i]);
    if (before_[i].sa_handler == SIG_IGN) continue;
    struct sigaction remember = {};
    remember.sa_handler = &Remember;
    // what is being written is written to its end; waiting for processes is interrupted all the
    // same
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

void Interruption::LeaveToParent() {
  for (const int signal : kSignals) std::signal(signal, SIG_IGN);
}

}  // namespace loopbench::harness
