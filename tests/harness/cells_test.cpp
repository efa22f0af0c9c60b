// Room on a terminal, held against what Unicode's East Asian Width and terminals say.
#include "harness/base/text.h"
#include "tests/standard.h"

namespace loopbench::harness::cells_test {

TEST(Cells, WideCharactersTakeTwoAndMarksNone) {
  EXPECT_EQ(CellsOf(""), 0u);
  EXPECT_EQ(CellsOf("four-bar"), 8u);
  EXPECT_EQ(CellsOf("\xc3\xa9"), 1u);                  // e acute, one character
  EXPECT_EQ(CellsOf("e\xcc\x81\xcc\x81"), 1u);         // e and two marks
  EXPECT_EQ(CellsOf("\xe6\xbc\xa2\xe5\xad\x97"), 4u);  // two Chinese characters
  EXPECT_EQ(CellsOf("\xef\xbc\xa1"), 2u);              // a full-width A
  EXPECT_EQ(CellsOf("\xea\xb0\x80"), 2u);              // a Hangul syllable
  EXPECT_EQ(CellsOf("\xff\xfe"), 2u);                  // bytes that are no characters
}

TEST(Cells, LinesBreakBehindCommasThenAtSpacesThenAnywhere) {
  using Lines = std::vector<std::string>;
  EXPECT_EQ(BrokenInto("", 5), Lines{""});
  EXPECT_EQ(BrokenInto("a (1 2), b (3 4)", 12), (Lines{"a (1 2),", "b (3 4)"}));
  EXPECT_EQ(BrokenInto("one two three", 8), (Lines{"one two", "three"}));
  EXPECT_EQ(BrokenInto("abcdefgh", 3), (Lines{"abc", "def", "gh"}));
  EXPECT_EQ(BrokenInto("\xe6\xbc\xa2\xe5\xad\x97", 3), (Lines{"\xe6\xbc\xa2", "\xe5\xad\x97"}));
  // a mark stays with its letter
  EXPECT_EQ(BrokenInto("e\xcc\x81x", 1), (Lines{"e\xcc\x81", "x"}));
  EXPECT_EQ(BrokenInto("exactly", 7), Lines{"exactly"});
}

}  // namespace loopbench::harness::cells_test
