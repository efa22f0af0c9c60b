// A system whose solver's type is known, for tests that look inside.
#pragma once

#include <memory>

#include "mechanism/formulation/system.h"

namespace loopbench::testing {

template <template <class, class> class Solver, class Space, class S>
class SystemWith {
 public:
  template <class... More>
  explicit SystemWith(const Mechanism<Space, S>& mechanism, const FormulationOptions& options = {},
                      const More&... more)
      : system_(MakeSystem<Solver>(mechanism, options, more...)) {}

  System<Space, S>* operator->() { return system_.get(); }
  System<Space, S>& operator*() { return *system_; }
  const Solver<Space, S>& solver() const {
    return static_cast<const Solver<Space, S>&>(system_->solver());
  }

 private:
  std::unique_ptr<System<Space, S>> system_;
};

}  // namespace loopbench::testing
