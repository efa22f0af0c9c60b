// Several threads on one right-hand side: a case of its own, with the same results.
#include <gtest/gtest.h>

#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace threads_test {

TEST_F(CommandLineTest, ThreadsChangeNothingButTimes) {
  // long enough for threads to have work of their own
  Write("long.json", R"({"name": "long",
    "problems": [{"mechanism": {"family": "ladder", "windows": 2100}, "horizon": 0.02}],
    "methods": [{"formulation": "odca", "enforcement": "velocity", "threads": [1, 2]}],
    "tolerances": 1e-6, "timing": {"repeats": 1}})");
  ExpectEnding(Call("run long.json --out out"), 0, {"ran 4 cases"});
  std::string hash;
  int with_threads = 0;
  for (const Record& record : ReadRecords(folder_ / "out")) {
    ASSERT_EQ(record.Text("outcome"), "finished") << record.Text("message");
    with_threads += record.Number("threads") == 2.0;
    if (record.Text("kind") != "accuracy") continue;
    if (hash.empty()) hash = record.Text("state_hash");
    EXPECT_EQ(record.Text("state_hash"), hash);
  }
  EXPECT_EQ(with_threads, 2);
  ExpectEnding(Call("list long.json --filter threads=2"), 0, {"threads", "1 case"});
  ExpectEnding(Call("list long.json --filter threads=3"), 2, {"no case matches"});
  ExpectEnding(Call("list long.json --filter thread=2"), 2, {"no such key", "threads"});
  ExpectEnding(Call("run long.json --no-timing --threads 3 --out three"), 0, {"ran 1 case"});
  const std::vector<Record> three = ReadRecords(folder_ / "three");
  ASSERT_EQ(three.size(), 1u) << "columns that differed in threads alone are one";
  EXPECT_EQ(three[0].Text("state_hash"), hash);
  EXPECT_EQ(three[0].Number("threads"), 3.0);
  ExpectEnding(Call("run long.json --no-timing --threads 3 --filter threads=3 --out three"), 0,
               {"ran 0 cases, 1 reused"});
  ExpectEnding(Call("run long.json --threads 0 --out none"), 2, {"--threads"});
}

}  // namespace threads_test
}  // namespace loopbench::harness
