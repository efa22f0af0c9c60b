// Memory that dense matrices are going to ask for.
#pragma once

#include <new>
#include <string>

namespace loopbench {

/// Thrown where a process may not have the memory of matrices whose cause is known.
class TooDense : public std::bad_alloc {
 public:
  explicit TooDense(const std::string& message) : message_(message) {}
  const char* what() const noexcept override { return message_.c_str(); }

 private:
  std::string message_;
};

/// Numbers up to which solvers keep dense matrices ready for positions that their sparse factors
/// leave in doubt: 160 MB.
inline constexpr double kKeptReady = 2e7;

/// Asks for the memory of so many numbers in one piece and gives it back untouched. A process that
/// may not have it learns so now, by name, and not hours later in the middle of its work. Throws
/// TooDense with "`what` asks for N GB".
void RequireDense(const std::string& what, double numbers);

}  // namespace loopbench
