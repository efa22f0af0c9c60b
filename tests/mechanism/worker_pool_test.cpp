// Threads that share pieces of work.
#include "mechanism/algebra/worker_pool.h"

#include "tests/standard.h"

namespace loopbench::worker_pool_test {

TEST(WorkerPool, DoesEachPieceOnce) {
  for (const int threads : {1, 2, 3, 8}) {
    WorkerPool pool(threads);
    EXPECT_EQ(pool.threads(), threads);
    for (int pieces = 0; pieces < 20; ++pieces) {
      std::vector<int> done(20, 0);
      pool.ForEach(pieces, [&](int i) { ++done[i]; });
      for (int i = 0; i < 20; ++i) EXPECT_EQ(done[i], i < pieces ? 1 : 0);
    }
  }
}

TEST(WorkerPool, SharesThemInOrder) {
  WorkerPool pool(3);
  std::vector<std::thread::id> by(10);
  pool.ForEach(10, [&](int i) { by[i] = std::this_thread::get_id(); });
  EXPECT_EQ(by[0], std::this_thread::get_id());
  EXPECT_EQ((std::set(by.begin(), by.end()).size()), 3u);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(by[i], by[i < 3 ? 0 : i < 6 ? 3 : 6]) << i;
}

/// Each round adds what the one before has left, in another thread's places: a round that began too
/// early, or ended before its work, shows in the sum.
TEST(WorkerPool, RoundsFollowEachOther) {
  WorkerPool pool(4);
  std::vector<long> from(64, 1), to(64, 0);
  for (int round = 0; round < 2000; ++round) {
    pool.ForEach(64, [&](int i) { to[i] = from[63 - i] + 1; });
    std::swap(from, to);
  }
  EXPECT_EQ(std::accumulate(from.begin(), from.end(), 0L), 64 * 2001L);
}

TEST(WorkerPool, WorkersThatSleepWakeUp) {
  WorkerPool pool(2);
  for (int round = 0; round < 3; ++round) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    std::vector<int> done(2, 0);
    pool.ForEach(2, [&](int i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(i * 5));  // the caller sleeps too
      done[i] = 1;
    });
    EXPECT_EQ(done, (std::vector<int>{1, 1}));
  }
}

}  // namespace loopbench::worker_pool_test
