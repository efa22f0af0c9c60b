// Memory requests of dense matrices.
#pragma once

#include <new>
#include <string>

namespace loopbench {

/// Thrown if memory of matrices with a known cause is not available.
class TooDense : public std::bad_alloc {
 public:
  explicit TooDense(const std::string& message) : message_(message) {}
  const char* what() const noexcept override { return message_.c_str(); }

 private:
  std::string message_;
};

/// Maximum size of dense matrices that solvers keep ready for uncertain sparse factors: 160 MB.
inline constexpr double kKeptReady = 2e7;

/// Allocates memory for so many numbers at once and frees it untouched. A process without enough
/// memory thus fails at once, not hours later. Throws TooDense with "`what` requires N GB".
void RequireDense(const std::string& what, double numbers);

}  // namespace loopbench
