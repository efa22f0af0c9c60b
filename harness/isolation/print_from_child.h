// A command's work in a child process: what it prints comes out here, whatever becomes of it.
#pragma once

#include <functional>
#include <string>

#include "harness/isolation/processes.h"

namespace loopbench::harness {

/// Runs `work` in a child process under `limits`. What it prints on standard output is printed here
/// when it has ended, complete lines also of work that was cut off. Returns its exit code; of work
/// that was cut off 2, after a line on standard error with `name` and the reason. What it throws is
/// thrown here, as std::runtime_error with its message.
int PrintFromChild(const std::string& name, const ProcessLimits& limits,
                   const std::function<int()>& work);

/// The same with what it prints in `text`.
int TextFromChild(const std::string& name, const ProcessLimits& limits,
                  const std::function<int()>& work, std::string* text);

}  // namespace loopbench::harness
