// The end of a process whose memory runs out where no exception may leave: in a destructor (JSON
// documents allocate there), in a noexcept function of a library, in a thread.
#pragma once

#include <string_view>

namespace loopbench::harness {

/// From now on such a process exits with `code` after `message` on standard error, instead of
/// SIGABRT. Other errors that nothing catches end it as before. `message` must last.
void ExitWithoutMemory(int code, std::string_view message);

}  // namespace loopbench::harness
