// Sizes that are known before they are met: a loop over a constant number of rows is unrolled.
#pragma once

#include <type_traits>

#define LOOPBENCH_UNROLL _Pragma("GCC unroll 9")

namespace loopbench {

template <int first, int... others, class Call>
[[gnu::always_inline]] inline auto WithConstant(int n, const Call& call) {
  if (n == first) return call(std::integral_constant<int, first>());
  if constexpr (sizeof...(others) > 0) {
    return WithConstant<others...>(n, call);
  } else {
    return call(n);
  }
}

/// Calls `call` with n, as a constant if it is one of `known` and the numbers S are doubles.
template <class S, int... known, class Call>
[[gnu::always_inline]] inline auto WithSize(int n, const Call& call) {
  if constexpr (std::is_same_v<S, double>) {
    return WithConstant<known...>(n, call);
  } else {
    return call(n);
  }
}

/// Does the same for a size that is already constant.
template <class S, int... known, int n, class Call>
[[gnu::always_inline]] inline auto WithSize(std::integral_constant<int, n> size, const Call& call) {
  return call(size);
}

/// Returns the argument of `call` if it was a constant, else 0.
template <class Size>
inline constexpr int kKnownSize = 0;
template <int n>
inline constexpr int kKnownSize<std::integral_constant<int, n>> = n;

/// Calls `call` with 0 .. size-1, unrolled if the size is a constant.
template <class Size, class Call>
[[gnu::always_inline]] inline void Repeat(Size size, const Call& call) {
  const int n = size;
  if constexpr (kKnownSize<Size> != 0) {
    LOOPBENCH_UNROLL
    for (int i = 0; i < n; ++i) call(i);
  } else {
    for (int i = 0; i < n; ++i) call(i);
  }
}

}  // namespace loopbench
