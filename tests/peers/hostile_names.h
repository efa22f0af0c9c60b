// Names that would act in XML, in C++, in a format of printf or on a terminal if they were more
// than names.
#pragma once

#include <string>
#include <vector>

namespace loopbench::harness::peers_test {

inline std::vector<std::string> HostileNames() {
  return {"\"); std::system(\"touch harmed\"); (\"",
          "*/ #error harmed /*",
          "two\nlines // \\",
          "\n#error harmed",
          "\?\?/\n#error harmed",
          "\\\" \\n \\",
          "%s%n%d",
          "<a href='x'>&amp;\"--></a>",
          "world",
          "tab\tand \x01 and \x7f",
          "\u00fc \u202e reversed",
          ")\" ; ]]>"};
}

}  // namespace loopbench::harness::peers_test
