// Checks in a process of their own: what they register, no other test sees.
#pragma once

#include "harness/cli/program.h"
#include "tests/standard.h"

namespace loopbench::harness {

/// Runs `check` in such a process: a fresh one, in which nobody has asked yet for what is there.
template <class Check>
void InChild(Check check) {
  const auto run = [&] {
    try {
      check();
    } catch (const std::exception& thrown) {
      ADD_FAILURE() << thrown.what();
    }
    // what failed there is printed nowhere else
    const testing::TestResult& found =
        *testing::UnitTest::GetInstance()->current_test_info()->result();
    for (int i = 0; i < found.total_part_count(); ++i) {
      std::cerr << found.GetTestPartResult(i).summary() << '\n';
    }
    std::cerr << "checked\n";
    std::_Exit(testing::Test::HasFailure() ? 1 : 0);
  };
  const std::string style = GTEST_FLAG_GET(death_test_style);
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(run(), testing::ExitedWithCode(0), "checked");
  GTEST_FLAG_SET(death_test_style, style);
}

/// Returns the output of loopbench with these arguments.
inline std::string Printed(std::vector<std::string> words) {
  words.insert(words.begin(), "loopbench");
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  testing::internal::CaptureStdout();
  const int code = Main(static_cast<int>(arguments.size()), arguments.data());
  const std::string printed = testing::internal::GetCapturedStdout();
  EXPECT_EQ(code, 0) << printed;
  return printed;
}

/// Why `call` throws std::invalid_argument; "none" where it does not.
template <class Call>
std::string RefusalOf(Call call) {
  try {
    call();
  } catch (const std::invalid_argument& refusal) {
    return refusal.what();
  }
  return "none";
}

inline void ExpectPart(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "no <" << part << "> in\n" << text;
}

}  // namespace loopbench::harness
