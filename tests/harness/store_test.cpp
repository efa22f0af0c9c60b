// The store keeps every value exactly, survives a crash, and names what it cannot read.
#include "harness/base/store.h"

#include <sys/resource.h>
#include <unistd.h>

#include "tests/harness/records.h"

namespace loopbench::harness::store_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

class StoreTest : public testing::Test {
 protected:
  const TemporaryFolder temporary_{"loopbench-store"};
  const std::filesystem::path folder_ = temporary_.path() / "store";
};

Record Sample() {
  return RecordOf("kind", "timing", "mechanism", "four-bar \"quoted\"\n\xc3\xa9", "rtol", 1e-6,
                  "third", 1.0 / 3.0, "whole", 2.0, "tiny",
                  std::numeric_limits<double>::denorm_min(), "minus_zero", -0.0, "steps",
                  std::int64_t{9007199254740993}, "growth_resolved", true, "branch_error_max",
                  std::monostate{}, "series.t", std::vector<double>{0.0, 0.1, 1e-300},
                  "series.empty", std::vector<double>{});
}

TEST_F(StoreTest, EveryValueComesBackWithItsTypeOrderAndBits) {
  ResultStore(folder_).Append(Sample());
  const std::vector<Record> records = ReadRecords(folder_);
  ASSERT_EQ(records.size(), 1u);
  EXPECT_EQ(records[0], Sample());
  EXPECT_TRUE(std::signbit(records[0].Number("minus_zero")));
}

TEST(RecordJson, NonFiniteNumbersBecomeNull) {
  Record record = RecordOf("drift", kNan, "energy", -kInf, "series.drift",
                           std::vector<double>{1.0, kNan, kInf});
  const std::string line = ToJsonLine(record);
  EXPECT_TRUE(line.starts_with(
      R"({"format":2,"drift":null,"energy":null,"series.drift":[1.0,null,null],"checksum":")"))
      << line;
  const Record back = FromJsonLine(line);
  EXPECT_TRUE(std::holds_alternative<std::monostate>(*back.Find("drift")));
  EXPECT_EQ(back.Numbers("series.drift")[0], 1.0);
  EXPECT_TRUE(std::isnan(back.Numbers("series.drift")[1]));
  EXPECT_TRUE(std::isnan(back.Numbers("series.drift")[2]));
}

TEST(RecordJson, CaseIdDependsOnValuesAndNotOnTheOrderOfKeys) {
  Record a;
  a.Set("mechanism", std::string("four-bar"));
  a.Set("rtol", 1e-6);
  Record b;
  b.Set("rtol", 1e-6);
  b.Set("mechanism", std::string("four-bar"));
  EXPECT_EQ(CaseId(a), CaseId(b));
  b.Set("rtol", 1e-8);
  EXPECT_NE(CaseId(a), CaseId(b));
  // FNV-1a of "{}", so that identifiers stay the same from one version to the next.
  EXPECT_EQ(CaseId(Record{}), "08f44b07b5901a25");
}

TEST_F(StoreTest, ATornLastLineIsSkippedWithAWarningAndRemovedBeforeTheNextAppend) {
  const auto file = folder_ / "torn.jsonl";
  Record whole;
  whole.Set("kind", std::string("a"));
  const std::string line = ToJsonLine(whole) + "\n";
  WriteFileAtomically(file, line + "{\"format\":2,\"kind\":\"a\",\"b\":[1.0,");
  std::vector<std::string> warnings;
  EXPECT_EQ(ReadRecords(file, &warnings).size(), 1u);
  ASSERT_EQ(warnings.size(), 1u);
  ExpectWords(warnings[0], {"torn.jsonl:2:"});

  Record next;
  next.Set("a", std::int64_t{3});
  ResultStore(file).Append(next);
  EXPECT_EQ(ReadFile(file), line + ToJsonLine(next) + "\n");
}

TEST_F(StoreTest, ACompleteLastLineWithoutLineEndIsKept) {
  const auto file = folder_ / "complete.jsonl";
  Record whole;
  whole.Set("kind", std::string("a"));
  WriteFileAtomically(file, ToJsonLine(whole));
  EXPECT_EQ(ReadRecords(file).size(), 1u);
  ResultStore(file).Append(Record{});
  EXPECT_EQ(ReadFile(file), ToJsonLine(whole) + "\n" + ToJsonLine(Record{}) + "\n");
}

TEST_F(StoreTest, LinesOfSeveralThreadsDoNotMix) {
  constexpr int kThreads = 4;
  constexpr int kLines = 50;
  Record record = Sample();
  record.Set("series.long", std::vector<double>(500, 1.0 / 7.0));
  ResultStore store(folder_);
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([&] {
        for (int line = 0; line < kLines; ++line) store.Append(record);
      });
    }
  }
  const std::vector<Record> records = ReadRecords(store.file());
  ASSERT_EQ(records.size(), std::size_t{kThreads * kLines});
  for (const Record& read : records) EXPECT_EQ(read, record);
}

TEST_F(StoreTest, AFileIsReplacedInOnePieceAndNoTemporaryStays) {
  const auto file = folder_ / "deep" / "table.csv";
  WriteFileAtomically(file, "old");
  WriteFileAtomically(file, "new");
  EXPECT_EQ(ReadFile(file), "new");
  int files = 0;
  for ([[maybe_unused]] const auto& entry :
       std::filesystem::directory_iterator(file.parent_path())) {
    ++files;
  }
  EXPECT_EQ(files, 1);
  EXPECT_THROW(WriteFileAtomically("/proc/none/file", "x"), std::runtime_error);
}

/// 0 if a copy that does not fit into memory throws and leaves its original as it was.
int CopiesWithoutMemory() {
  Record record;
  record.Set("series.t", std::vector<double>(std::size_t{8} << 20, 1.0));  // 64 MiB
  record.Set("text", std::string(std::size_t{64} << 20, 'x'));
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const rlim_t most = pages * static_cast<std::size_t>(getpagesize()) + (std::size_t{16} << 20);
  const rlimit limit{most, most};
  if (setrlimit(RLIMIT_AS, &limit) != 0) return 1;
  for (const auto& [key, value] : record.items()) {
    try {
      const Value copy = value;
      return 2;
    } catch (const std::bad_alloc&) {
    }
    Value assigned = 1.0;
    try {
      assigned = value;
      return 3;
    } catch (const std::bad_alloc&) {
    }
    if (assigned != Value(1.0)) return 4;
  }
  return std::get<std::string>(*record.Find("text")).size() == std::size_t{64} << 20 ? 0 : 5;
}

TEST(ValueDeathTest, ACopyThatDoesNotFitIntoMemoryThrows) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "the sanitizer reserves the whole address space";
#endif
  EXPECT_EXIT(_exit(CopiesWithoutMemory()), testing::ExitedWithCode(0), "");
}

}  // namespace loopbench::harness::store_test
