#include <atomic>
#include <boost/context/fiber.hpp>
#include <boost/context/protected_fixedsize_stack.hpp>
#include <exception>
#include <new>
#include <thread>

#include "harness/base/text.h"
#include "harness/run/run.h"
#include "mechanism/algebra/lanes.h"

namespace loopbench::harness {
namespace {

namespace context = boost::context;

#if defined(__SANITIZE_ADDRESS__)
constexpr int kMost = 1;
#else
constexpr int kMost = kLanes;
#endif

/// Stacks start at different offsets within a page, to use all sets of the nearest cache.
constexpr std::size_t kApart = 4096 / kLanes, kStackBytes = std::size_t{8} << 20;

/// Stack that successive runs use.
class Place {
 public:
  explicit Place(int number) : away_(static_cast<std::size_t>(number) * kApart) {}
  ~Place() {
    if (memory_.sp != nullptr) allocator_.deallocate(memory_);
  }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;

  bool IsTaken() const { return static_cast<bool>(fiber_); }
  /// Only a used stack takes memory. Returns false without a stack.
  bool HasStack() noexcept {
    if (memory_.sp != nullptr) return true;
    try {
      memory_ = allocator_.allocate();
    } catch (const std::bad_alloc&) {
      return false;
    }
    return true;
  }
  /// `work(back)` begins, until it goes back.
  template <class Work>
  void Begin(Work work) {
    const context::preallocated stack(static_cast<char*>(memory_.sp) - away_, memory_.size - away_,
                                      memory_);
    fiber_ = context::fiber(std::allocator_arg, stack, Kept{}, std::move(work));
    GoOn();
  }
  void GoOn() { fiber_ = std::move(fiber_).resume(); }

 private:
  struct Kept {
    void deallocate(context::stack_context&) noexcept {}
  };
  context::protected_fixedsize_stack allocator_{kStackBytes};
  std::size_t away_;
  context::stack_context memory_;
  context::fiber fiber_;
};

/// Runs of one thread, in as many places as lanes. A place takes the next run when its run ends.
class Places final : public SideBySide {
 public:
  /// `start(run)` is called in a place for each run that `next` gives, -1 being none.
  void Run(const std::function<int()>& next, const std::function<void(int)>& start) {
    const double others_s = foreign_time.others_s;
    for (int i = 0; i < kMost; ++i) places_.push_back(std::make_unique<Place>(i));
    if (kMost == 1 || !places_.front()->HasStack()) {  // one after another, on this stack
      for (int run = next(); run >= 0; run = next()) start(run);
      return;
    }
    bool all_begun = false;
    for (;;) {
      for (const std::unique_ptr<Place>& place : places_) {
        if (place->IsTaken()) place->GoOn();
        while (!place->IsTaken() && !all_begun && place->HasStack()) {
          const int run = next();
          all_begun = run < 0;
          if (all_begun) break;
          place->Begin([&start, run, this](context::fiber&& back) {
            back_ = std::move(back);
            start(run);
            return std::move(back_);
          });
        }
        if (!place->IsTaken()) switched_s_ = Now();
      }
      const auto waiting =
          std::ranges::count_if(places_, [](const auto& place) { return place->IsTaken(); });
      if (waiting == 0) break;
      const double begin_s = switched_s_;
      DoAll();
      switched_s_ = Now();
      share_s_ = (switched_s_ - begin_s) / static_cast<double>(waiting);
    }
    foreign_time.others_s = others_s;
  }

  void Meet() override {
    if (!back_) return DoAll();
    const double left_s = Now(), others_s = foreign_time.others_s;
    switched_s_ = left_s;
    back_ = std::move(back_).resume();
    foreign_time.others_s = others_s + (switched_s_ - left_s) - share_s_;
  }

 private:
  /// Wall time without recording and compiling.
  static double Now() { return WallSeconds() - foreign_time.wall_s; }

  void DoAll() {
    for (const std::unique_ptr<SharedWork>& work : works) work->Do();
  }

  std::vector<std::unique_ptr<Place>> places_;
  context::fiber back_;      ///< to Run(), while a run is at work on a stack of its own
  double switched_s_ = 0.0;  ///< when the last run stopped and the present one continued
  double share_s_ = 0.0;     ///< of a run in the last work for all
};

}  // namespace

void RunSideBySide(int count, int threads, const std::function<void(int, SideBySide&)>& run) {
  // more threads would leave lanes empty
  const int useful = std::clamp((count + kMost - 1) / kMost, 1, std::max(1, threads));
  // of the runs, then of threads
  std::vector<std::exception_ptr> thrown(static_cast<std::size_t>(count + useful));
  const auto guarded = [&](int place, const auto& work) {
    try {
      work();
    } catch (...) {
      thrown[static_cast<std::size_t>(place)] = std::current_exception();
    }
  };
  std::atomic<int> begun = 0;
  const auto next = [&] {
    const int one = begun++;
    return one < count ? one : -1;
  };
  const auto work = [&](int thread) {
    guarded(count + thread, [&] {
      Places places;
      places.Run(next, [&](int one) { guarded(one, [&] { run(one, places); }); });
    });
  };
  {
    std::vector<std::jthread> others;
    try {
      for (int thread = 1; thread < useful; ++thread) others.emplace_back(work, thread);
    } catch (const std::system_error&) {  // no more of them
    }
    work(0);
  }
  const auto first = std::ranges::find_if(thrown, [](const auto& one) { return one != nullptr; });
  if (first != thrown.end()) std::rethrow_exception(*first);
}

}  // namespace loopbench::harness
