// Numbers in sentences.
#pragma once

#include <cstdio>
#include <string>

namespace loopbench {

/// Returns the number with so many significant digits, as "%.*g" prints it.
inline std::string NumberText(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

}  // namespace loopbench
