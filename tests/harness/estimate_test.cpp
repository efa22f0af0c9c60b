// What pilots over a part of the horizon say of the whole.
#include "harness/suite/estimate.h"

#include <gtest/gtest.h>

namespace loopbench::harness {
namespace estimate_test {

TEST(Estimate, ARateGoesOnWithItsSlopeToWhereRunsEnd) {
  const Rate rate = {.running_s = 1.0, .reached = 0.1, .slope_s = 5.0};
  EXPECT_DOUBLE_EQ(rate.Running(0.05), 0.5);
  EXPECT_DOUBLE_EQ(rate.Running(0.1), 1.0);
  EXPECT_DOUBLE_EQ(rate.Running(1.0), 1.0 + 0.9 * 5.0);
  Rate failed = rate;
  failed.ends_at = 0.1;
  EXPECT_DOUBLE_EQ(failed.Running(1.0), 1.0);
  Rate limited = rate;
  limited.most_s = 2.0;
  EXPECT_DOUBLE_EQ(limited.Running(1.0), 2.0);
}

}  // namespace estimate_test
}  // namespace loopbench::harness
