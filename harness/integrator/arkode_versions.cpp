#include "harness/integrator/arkode_versions.h"

#include <array>

#if SUNDIALS_VERSION_MAJOR >= 7
#include <sunadaptcontroller/sunadaptcontroller_soderlind.h>
#endif

namespace loopbench::harness {

#if SUNDIALS_VERSION_MAJOR >= 7

namespace {
void KeepMessage(int, const char*, const char*, const char* text, SUNErrCode, void* message,
                 SUNContext) {
  *static_cast<std::string*>(message) = text;
}
}  // namespace

Context MakeContext(std::string* message) {
  SUNContext context = nullptr;
  Require(SUNContext_Create(SUN_COMM_NULL, &context), "the context");
  SUNContext_ClearErrHandlers(context);
  SUNContext_PushErrHandler(context, KeepMessage, message);
  return Context(context);
}

void CaptureMessages(void*, bool, std::string*) {}

ControllerPtr SetControl(void* memory, bool, SUNContext context, const Controller& c) {
  // h_new = h e_n^(-k1/q) e_(n-1)^(-k2/q); the ready-made PI controller of 7.1 rejects every step.
  ControllerPtr made(SUNAdaptController_Soderlind(context));
  Require(SUNAdaptController_SetParams_Soderlind(made.get(), c.proportional ? 0.8 : 1,
                                                 c.proportional ? -0.31 : 0, 0, 0, 0),
          "the controller's parameters");
  Require(SUNAdaptController_SetErrorBias(made.get(), c.bias), "the error bias");
  LOOPBENCH_SET(, SetAdaptController, memory, made.get());
  // Relative to one more than the lower of the two orders, which is what -1 undoes.
  LOOPBENCH_SET(, SetAdaptivityAdjustment, memory, c.uses_method_order ? 0 : -1);
  return made;
}

#else

namespace {
void KeepMessage(int code, const char*, const char*, char* text, void* message) {
  if (code < 0) {  // warnings are positive
    *static_cast<std::string*>(message) = text;
  }
}
}  // namespace

Context MakeContext(std::string*) {
  SUNContext context = nullptr;
  Require(SUNContext_Create(nullptr, &context), "the context");
  return Context(context);
}

void CaptureMessages(void* memory, bool implicit, std::string* message) {
  LOOPBENCH_SET(implicit, SetErrHandlerFn, memory, KeepMessage, message);
}

ControllerPtr SetControl(void* memory, bool implicit, SUNContext, const Controller& c) {
  std::array<sunrealtype, 3> parameters{c.proportional ? 0.8 : 1, c.proportional ? 0.31 : 0, 0};
  LOOPBENCH_SET(implicit, SetAdaptivityMethod, memory, c.proportional ? ARK_ADAPT_PI : ARK_ADAPT_I,
                0, c.uses_method_order, parameters.data());
  LOOPBENCH_SET(implicit, SetErrorBias, memory, c.bias);
  return {};
}

#endif

}  // namespace loopbench::harness
