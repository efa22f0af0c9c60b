#include <algorithm>
#include <array>
#include <functional>
#include <utility>
#include <vector>

#include "odca/path_sweep.h"

namespace loopbench::odca::pins {

namespace {

/// Pending evaluation of a run.
struct Wanted {
  SpeedsUsed speeds = SpeedsUsed::kGiven;
  std::span<const double> q, u;
  std::span<double> qdot, udot;
};

void Gather(std::span<const double> one, int lane, std::vector<Lanes>& all) {
  for (std::size_t i = 0; i < one.size(); ++i) all[i][lane] = one[i];
}
void Scatter(const std::vector<Lanes>& all, int lane, std::span<double> one) {
  for (std::size_t i = 0; i < one.size(); ++i) one[i] = all[i][lane];
}

}  // namespace

/// All lanes of mechanisms of one shape. Unused lanes keep stale data; their results are discarded.
class PathLane::All final : public SharedWork {
 public:
  explicit All(const PathSweep& one)
      : sweep_(PathSweepOf<Lanes>::InLanes(one)), q_(one.num_u()), u_(q_), qdot_(q_), udot_(q_) {}
  bool HasLanes() const { return sweep_ != nullptr; }

  /// Returns -1 if no lane is free or the mechanism differs.
  int Take(const PathSweep& own) {
    const auto free = std::ranges::find(taken_, false);
    const int lane = static_cast<int>(free - taken_.begin());
    if (free == taken_.end() || !sweep_->SetMechanism(lane, own)) return -1;
    *free = true;
    return lane;
  }
  void GiveBack(int lane) { taken_[lane] = false; }

  void Want(int lane, const Wanted& wanted) {
    wanted_[lane] = wanted;
    waits_[lane] = true;
  }
  bool WasGood(int lane) const { return good_[lane]; }

  void Do() noexcept override {
    for (const SpeedsUsed speeds : {SpeedsUsed::kGiven, SpeedsUsed::kCompleted}) {
      std::array<bool, kLanes> now{};
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!waits_[lane] || wanted_[lane].speeds != speeds) continue;
        now[lane] = true;
        Gather(wanted_[lane].q, lane, q_);
        Gather(wanted_[lane].u, lane, u_);
      }
      if (std::ranges::none_of(now, std::identity())) continue;
      const LaneBits good = sweep_->Evaluate(speeds, nullptr, q_, u_, qdot_, udot_);
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!now[lane]) continue;
        waits_[lane] = false;
        good_[lane] = good[lane] != 0;
        Scatter(qdot_, lane, wanted_[lane].qdot);
        Scatter(udot_, lane, wanted_[lane].udot);
      }
    }
  }

 private:
  std::unique_ptr<PathSweepOf<Lanes>> sweep_;
  std::array<bool, kLanes> taken_{}, waits_{}, good_{};
  std::array<Wanted, kLanes> wanted_;
  std::vector<Lanes> q_, u_, qdot_, udot_;
};

std::unique_ptr<PathLane> PathLane::Take(SideBySide& beside, const PathSweep& own) {
  const auto take = [&](All& all) -> std::unique_ptr<PathLane> {
    const int lane = all.Take(own);
    return lane < 0 ? nullptr : std::unique_ptr<PathLane>(new PathLane(beside, all, lane));
  };
  for (const std::unique_ptr<SharedWork>& work : beside.works) {
    auto* all = dynamic_cast<All*>(work.get());
    if (all == nullptr) continue;
    if (auto lane = take(*all)) return lane;
  }
  auto all = std::make_unique<All>(own);
  if (!all->HasLanes()) return nullptr;
  auto lane = take(*all);
  beside.works.push_back(std::move(all));
  return lane;
}

PathLane::~PathLane() { all_.GiveBack(lane_); }

bool PathLane::Evaluate(SpeedsUsed speeds, std::span<const double> q, std::span<const double> u,
                        std::span<double> qdot, std::span<double> udot) {
  all_.Want(lane_, {speeds, q, u, qdot, udot});
  beside_.Meet();
  return all_.WasGood(lane_);
}

}  // namespace loopbench::odca::pins
