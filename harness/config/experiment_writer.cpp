#include "harness/config/experiment_writer.h"

#include "harness/json/json_document.h"

namespace loopbench::harness {

std::string ExperimentText(const SingleRun& run) {
  Json column = {{"formulation", run.column.formulation},
                 {"enforcement", ToString(run.column.enforcement)},
                 {"coordinates", ToString(run.column.coordinates)}};
  Json experiment = {
      {"name", run.name},
      {"comment", run.comment},
      {"scenes",
       Json::array({{{"mechanism", run.mechanism.generic_string()}, {"horizon", run.horizon}}})},
      {"columns", Json::array({column})},
      {"integrator", run.integrator},
      {"timing", {{"cases", true}}},
      {"reference",
       {{"scalar", run.reference.scalar},
        {"points", run.reference.points},
        {"cpu_s", run.reference.cpu_s}}}};
  if (run.step > 0.0) {
    experiment["fixed_steps"] = Json::array({run.step});
  } else {
    experiment["tolerances"] = Json::array({run.rtol});
  }
  return experiment.dump(2) + "\n";
}

}  // namespace loopbench::harness
