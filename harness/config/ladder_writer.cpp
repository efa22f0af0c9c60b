#include "harness/config/ladder_writer.h"

#include "harness/json/json_text.h"

namespace loopbench::harness {

std::string LadderText(const LadderFile& ladder) {
  Json scenes = Json::array();
  for (const std::string& mechanism : ladder.mechanisms) {
    scenes.push_back({{"mechanism", mechanism}, {"horizon", ladder.horizon}});
  }
  const Json columns = Json::array({{{"formulation", {"odca", "lagrange", "reduction"}},
                                     {"enforcement", "position"},
                                     {"coordinates", "joint"}}});
  const Json file = {
      {"name", ladder.name},
      {"comment", ladder.comment},
      {"scenes", scenes},
      {"columns", columns},
      {"tolerances", {1e-6, 1e-9}},
      {"integrator", "dormand-prince"},
      {"compile", {{"planar", false}, {"welds", false}, {"immovable", false}, {"islands", false}}},
      {"timing", {{"repeats", 5}}}};
  return JsonText(file);
}

}  // namespace loopbench::harness
