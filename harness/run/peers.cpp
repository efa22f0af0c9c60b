#include <map>

#include "harness/base/text.h"
#include "harness/run/run.h"
#include "mechanism/description/registration.h"

namespace loopbench::harness {
namespace {

std::map<std::string, PeerFactory>& Factories() {
  static std::map<std::string, PeerFactory> factories;
  return factories;
}

bool IsMissing(const std::string& formulation) {
  const FormulationRow* row = FindFormulation(formulation);
  return row != nullptr && row->is_peer() && !Factories().contains(formulation);
}

std::string WhyMissing(const std::string& formulation) {
  return fmt::format("formulation \"{}\" needs a build with -DLOOPBENCH_PEERS=ON", formulation);
}

}  // namespace

void RegisterPeer(const std::string& name, PeerFactory make) {
  const FormulationRow* row = FindFormulation(name);
  if (row == nullptr || !row->is_peer()) {
    RefuseRow("peer", name, "no peer's name", "that of a row of harness/config/formulations.cpp");
  }
  if (!Factories().emplace(name, std::move(make)).second) {
    RefuseRow("peer", name, "it again", "each peer once");
  }
}

std::unique_ptr<Peer> MakePeer(const std::string& formulation,
                               const MechanismDescription& description) {
  if (IsMissing(formulation)) throw ConfigError(WhyMissing(formulation));
  const auto factory = Factories().find(formulation);
  return factory == Factories().end() ? nullptr : factory->second(description);
}

std::unique_ptr<Peer> TryPeer(const std::string& formulation,
                              const MechanismDescription& description, IntegratorResult* result) {
  try {
    return MakePeer(formulation, description);
  } catch (const Inexpressible& why) {
    result->outcome = Outcome::kInexpressible;
    result->message = why.what();
    return nullptr;
  }
}

void RequirePeers(const std::vector<Experiment>& experiments) {
  for (const Experiment& experiment : experiments) {
    const auto require = [&](const std::string& place, const std::vector<Method>& methods) {
      for (const Method& method : methods) {
        if (!IsMissing(method.formulation)) continue;
        throw ConfigError(fmt::format("{}: {}: {}", experiment.path.string(), place,
                                      WhyMissing(method.formulation)));
      }
    };
    require("/methods", experiment.methods);
    if (experiment.timing.repeats == 0) continue;
    require("/timing/methods", experiment.timing.methods);
    for (const TimingFamily& family : experiment.timing.families) {
      require("/timing/families", family.methods);
    }
  }
}

}  // namespace loopbench::harness
