// Parts of the ARKODE interface: vectors, calls of its versions, Newton iterations.
#pragma once

#include <arkode/arkode_arkstep.h>
#include <arkode/arkode_erkstep.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_version.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "harness/config/options.h"
#include "mechanism/algebra/factors.h"

// Explicit pairs run in ERKStep, implicit ones in ARKStep, which have the same calls under two
// names. From 7.1 on they are one call, and this is the whole difference for most of them.
#if SUNDIALS_VERSION_MAJOR >= 7
#include <sundials/sundials_adaptcontroller.h>
#define LOOPBENCH_ARK(implicit, call, ...) ARKode##call(__VA_ARGS__)
#define LOOPBENCH_ARK_IMPLICIT(call, ...) ARKode##call(__VA_ARGS__)
#else
#define LOOPBENCH_ARK(implicit, call, ...) \
  ((implicit) ? ARKStep##call(__VA_ARGS__) : ERKStep##call(__VA_ARGS__))
#define LOOPBENCH_ARK_IMPLICIT(call, ...) ARKStep##call(__VA_ARGS__)
#endif

// A call that can fail only by a programming error.
#define LOOPBENCH_SET(implicit, call, ...) \
  ::loopbench::harness::Require(LOOPBENCH_ARK(implicit, call, __VA_ARGS__), #call)
#define LOOPBENCH_SET_IMPLICIT(call, ...) \
  ::loopbench::harness::Require(LOOPBENCH_ARK_IMPLICIT(call, __VA_ARGS__), #call)

namespace loopbench::harness {

class GuardedOde;

// ARKODE's vectors: SUNDIALS' serial ones with some operations of our own.

inline std::span<double> Span(N_Vector v) {
  return {NV_DATA_S(v), static_cast<size_t>(NV_LENGTH_S(v))};
}

/// Gives `v`, and so every clone of it, our linear combination and our norm: the maximum of
/// |v_i| w_i or its root mean square. Both count the components before a tail of zero weights
/// (quadratures, ode.h) and no others.
void UseOurOperations(N_Vector v, bool max_norm);

// Differences between the supported versions of SUNDIALS, 6.4 and 7: names of calls, context,
// messages, step-size controller. Also the owners of SUNDIALS' objects.

/// A setting that ARKODE rejects is an error in the code, not an outcome of a run.
inline void Require(int code, const char* what) {
  if (code != 0) {
    throw std::logic_error(std::string("ARKODE rejected ") + what);
  }
}

struct FreeContext {
  void operator()(std::remove_pointer_t<SUNContext>* context) const { SUNContext_Free(&context); }
};
struct FreeVector {
  void operator()(std::remove_pointer_t<N_Vector>* vector) const { N_VDestroy(vector); }
};
struct FreeMemory {
  bool implicit = false;
  void operator()([[maybe_unused]] void* memory) const { LOOPBENCH_ARK(implicit, Free, &memory); }
};
using Context = std::unique_ptr<std::remove_pointer_t<SUNContext>, FreeContext>;
using Vector = std::unique_ptr<std::remove_pointer_t<N_Vector>, FreeVector>;
using Memory = std::unique_ptr<void, FreeMemory>;

#if SUNDIALS_VERSION_MAJOR >= 7
struct FreeController {
  void operator()(SUNAdaptController c) const { SUNAdaptController_Destroy(c); }
};
using ControllerPtr = std::unique_ptr<std::remove_pointer_t<SUNAdaptController>, FreeController>;
#else
struct Nothing {};
using ControllerPtr = Nothing;  // ARKODE 6 keeps the controller inside its memory
#endif

/// A context whose error texts go to `*message`, given that CaptureMessages() is called too.
Context MakeContext(std::string* message);
void CaptureMessages(void* memory, bool implicit, std::string* message);

/// Sets the Runge-Kutta method of `memory`, of ERKStep for an explicit table, else of ARKStep.
void SetTable(void* memory, const ButcherTable& table);

/// Makes `memory` choose steps by `c`; the returned object must live as long as `memory`.
ControllerPtr SetControl(void* memory, bool implicit, SUNContext context, const Controller& c);

// Newton's iteration for the stages of an implicit Runge-Kutta method in ARKODE.

/// The dense matrix I - gamma J of a stage and its factors. Quadratures come last in y, and f does
/// not depend on them, so the matrix is block triangular. Only the leading block is factored; its
/// solution does not depend on the quadratures in any bit.
///
/// The matrix belongs to the first implicit stage of a step. If this is not enough, a step that may
/// shrink is shortened. At a fixed step the Jacobian is renewed at the iterate whenever a
/// correction is more than half of the one before.
class Newton {
 public:
  /// Makes ARKStep's `memory` solve its stages with Jacobians of `ode`, its user data. Must outlive
  /// `memory`.
  Newton(void* memory, N_Vector y, GuardedOde& ode, SUNContext context);
  Newton(const Newton&) = delete;
  Newton& operator=(const Newton&) = delete;

 private:
  struct FreeMatrix {
    void operator()(std::remove_pointer_t<SUNMatrix>* matrix) const { SUNMatDestroy(matrix); }
  };
  struct FreeSolver {
    void operator()(std::remove_pointer_t<SUNLinearSolver>* s) const { SUNLinSolFreeEmpty(s); }
  };

  // Operations of the linear solver, whose content is the Newton object.
  static int Factor(SUNLinearSolver solver, SUNMatrix matrix);
  static int Solve(SUNLinearSolver solver, SUNMatrix matrix, N_Vector x, N_Vector b, sunrealtype);

  /// At a fixed step: renews the factors if the last two corrections of this stage demand it.
  /// Returns ARKODE's code.
  int Renew(SUNMatrix matrix);

  void* memory_;
  GuardedOde& ode_;
  std::int64_t iterations_ = -1;         ///< before this stage
  std::array<double, 2> corrections_{};  ///< norms of the last two of this stage; 0: none
  Eigen::Index controlled_;
  Eigen::PartialPivLU<Eigen::MatrixXd> factors_;
  Eigen::VectorXd solution_;
  std::unique_ptr<std::remove_pointer_t<SUNMatrix>, FreeMatrix> matrix_;
  std::unique_ptr<std::remove_pointer_t<SUNLinearSolver>, FreeSolver> solver_;
};

/// Newton iterations of the run so far, and stages that did not converge: each of these shortened
/// the step, or ended the run.
std::int64_t NewtonIterations(void* memory);
std::int64_t NewtonFailures(void* memory);

}  // namespace loopbench::harness
