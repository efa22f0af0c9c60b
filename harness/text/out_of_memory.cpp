#include "harness/text/out_of_memory.h"

#include <unistd.h>

#include <exception>
#include <new>

namespace loopbench::harness {
namespace {

int exit_code = 2;
std::string_view last_words;
std::terminate_handler before = nullptr;

void Terminate() {
  if (std::current_exception() != nullptr) {
    try {
      throw;
    } catch (const std::bad_alloc&) {
      [[maybe_unused]] const auto written =
          ::write(STDERR_FILENO, last_words.data(), last_words.size());
      ::_exit(exit_code);
    } catch (...) {  // as before
    }
  }
  before();
}

}  // namespace

void ExitWithoutMemory(int code, std::string_view message) {
  exit_code = code;
  last_words = message;
  const std::terminate_handler known = std::set_terminate(&Terminate);
  if (known != &Terminate) before = known;
}

}  // namespace loopbench::harness
