// ARKODE's vectors: SUNDIALS' serial ones with some operations of our own.
#pragma once

#include <nvector/nvector_serial.h>

#include <cstddef>
#include <span>

namespace loopbench::harness {

inline std::span<double> Span(N_Vector v) {
  return {NV_DATA_S(v), static_cast<size_t>(NV_LENGTH_S(v))};
}

/// Gives `v`, and so every clone of it, our linear combination and our norm: the maximum of
/// |v_i| w_i or its root mean square. Both count the components before a tail of zero weights
/// (quadratures, ode.h) and no others.
void UseOurOperations(N_Vector v, bool max_norm);

}  // namespace loopbench::harness
