// What differs between the versions of SUNDIALS that are supported, 6.4 and 7: names of calls,
// context, messages, step-size controller. Also the owners of SUNDIALS' objects.
#pragma once

#include <arkode/arkode_arkstep.h>
#include <arkode/arkode_erkstep.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_version.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "harness/config/options.h"

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

// The same for calls that can only fail by a mistake of ours.
#define LOOPBENCH_SET(implicit, call, ...) \
  ::loopbench::harness::Require(LOOPBENCH_ARK(implicit, call, __VA_ARGS__), #call)
#define LOOPBENCH_SET_IMPLICIT(call, ...) \
  ::loopbench::harness::Require(LOOPBENCH_ARK_IMPLICIT(call, __VA_ARGS__), #call)

namespace loopbench::harness {

/// A setting that ARKODE refuses is a mistake in the code, not an ending of a run.
inline void Require(int code, const char* what) {
  if (code != 0) {
    throw std::logic_error(std::string("ARKODE refused ") + what);
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

/// Makes `memory` choose steps by `c`; what is returned must live as long as `memory`.
ControllerPtr SetControl(void* memory, bool implicit, SUNContext context, const Controller& c);

}  // namespace loopbench::harness
