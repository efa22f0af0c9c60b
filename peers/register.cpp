#include "peers/register.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "harness/base/text.h"
#include "harness/exchange/model.h"
#include "harness/run/run.h"
#include "peers/program.h"

namespace loopbench::peers {
namespace {

/// Shortens messages of libraries, which are long and have several lines.
std::string OneLine(const std::string& text) {
  std::string line = text.substr(0, 300);
  std::ranges::replace(line, '\n', ' ');
  return line;
}

class ProgramPeer final : public harness::Peer {
 public:
  ProgramPeer(std::string name, std::unique_ptr<Program> program, const exchange::Model& model)
      : name_(std::move(name)),
        program_(std::move(program)),
        num_q_(model.num_q),
        num_u_(model.num_u) {}

  int size() const override { return num_q_ + num_u_; }

  Outcome Derivative(double, std::span<const double> y, std::span<double> ydot) override {
    try {
      program_->Derivative(y.data(), y.data() + num_q_, ydot.data(), ydot.data() + num_q_);
    } catch (const std::exception&) {
      return Outcome::kIntegratorError;
    }
    const bool finite = std::ranges::all_of(ydot, [](double x) { return std::isfinite(x); });
    return finite ? Outcome::kFinished : Outcome::kNonFinite;
  }

  harness::IntegratorResult Integrate(double t_end, std::vector<double>& y,
                                      const harness::IntegratorOptions& options,
                                      const harness::StepObserver& observe) override {
    harness::CpuLimit limit(options.time_limit_s);
    harness::IntegratorResult result;
    try {
      program_->Start(y.data(), y.data() + num_q_, options.rtol, t_end);
      Run(t_end, y, options, observe, limit, result);
    } catch (const StepTooSmall& error) {
      result.outcome = Outcome::kStepTooSmall;
      result.message = name_ + ": " + OneLine(error.what());
    } catch (const std::exception& error) {
      result.outcome = Outcome::kIntegratorError;
      result.message = name_ + ": " + OneLine(error.what());
    }
    const Counts counts = program_->counts();
    result.steps = counts.steps;
    result.rejected = counts.rejected;
    result.rhs_evaluations = counts.derivatives;
    result.restarts = counts.projections;
    result.wall_s = limit.wall_s();
    result.cpu_s = limit.cpu_s();
    return result;
  }

 private:
  void Run(double t_end, std::vector<double>& y, const harness::IntegratorOptions& options,
           const harness::StepObserver& observe, harness::CpuLimit& limit,
           harness::IntegratorResult& result) {
    bool stopped = false;
    const auto accept = [&] {
      result.t_reached = program_->time();
      program_->State(y.data(), y.data() + num_q_);
      if (observe) stopped = observe(result.t_reached, y) == harness::StepAction::kStop;
    };
    accept();
    for (std::int64_t steps = 0; !stopped && program_->time() < t_end; ++steps) {
      if (steps >= options.step_limit) result.outcome = Outcome::kStepLimit;
      if (limit.Reached()) result.outcome = Outcome::kTimeLimit;
      if (result.outcome != Outcome::kFinished) return;
      const double before = program_->time();
      program_->Step();
      if (!(program_->time() > before)) {
        result.outcome = Outcome::kStepTooSmall;
        return;
      }
      accept();
    }
  }

  std::string name_;
  std::unique_ptr<Program> program_;
  int num_q_, num_u_;
};

/// Throws harness::Inexpressible with the peer's name and its unsupported parts. `make` throws
/// exchange::Unsupported, or errors of the peer's library for a model that it rejects.
std::unique_ptr<harness::Peer> MakePeer(const std::string& name,
                                        std::unique_ptr<Program> (*make)(const exchange::Model&),
                                        const MechanismDescription& description) {
  try {
    const exchange::Model model = exchange::MakeModel(description);
    return std::make_unique<ProgramPeer>(name, make(model), model);
  } catch (const exchange::Unsupported& missing) {
    throw harness::Inexpressible(fmt::format("{} does not have: {}", name, missing.what()));
  } catch (const std::exception& error) {
    throw harness::Inexpressible(
        fmt::format("{} rejects the model: {}", name, OneLine(error.what())));
  }
}

}  // namespace

void RegisterPeers() {
  for (const auto& [name, make] :
       {std::pair{"peer/simbody", &MakeSimbodyProgram}, {"peer/mujoco", &MakeMujocoProgram}}) {
    harness::RegisterPeer(name, [name, make](const MechanismDescription& description) {
      return MakePeer(name, make, description);
    });
  }
}

}  // namespace loopbench::peers
