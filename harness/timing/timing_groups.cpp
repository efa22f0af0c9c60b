// What is timed together: the columns of a scene, or of a member of a family.
#include <fmt/format.h>

#include "harness/config/sized_family.h"
#include "harness/run/case_identity.h"
#include "harness/run/compiled_scene.h"
#include "harness/timing/time_cases.h"

namespace loopbench::harness {

namespace {

/// One system per timing: parts are not timed apart.
MechanismDescription OneSystem(const Experiment& experiment, std::size_t scene) {
  CompileOptions options = experiment.compile;
  options.islands = false;
  const MechanismFile& file = experiment.scenes[scene].mechanism;
  return CompileScene(file.description, file.observe, options).compiled.parts.front().description;
}

void SetTimingId(const std::string& content, Record* keys) {
  keys->Set("kind", std::string("timing"));
  SetCaseId(keys, content);
}

}  // namespace

std::vector<TimingGroup> TimingGroups(const Experiment& experiment, const Selection& filter) {
  std::vector<TimingGroup> groups;
  // cases come scene by scene and, in a scene, horizon by horizon
  for (const Case& one : ExpandTiming(experiment)) {
    if (!Matches(one.keys, filter)) continue;
    const bool is_next = groups.empty() || groups.back().cases.back().scene != one.scene ||
                         groups.back().cases.back().horizon != one.horizon;
    if (is_next) {
      groups.push_back({one.mechanism,
                        [&experiment, scene = one.scene] { return OneSystem(experiment, scene); },
                        {},
                        true});
    }
    groups.back().cases.push_back(one);
    SetTimingId(SceneTimingContent(experiment, one), &groups.back().cases.back().keys);
  }
  if (experiment.timing.repeats == 0) return groups;
  for (const TimingFamily& family : experiment.timing.families) {
    for (const int size : family.sizes) {
      TimingGroup group{fmt::format("{}-{}", family.family, size),
                        [make = SizedFamilyOf(family.family).make, size] { return make(size); },
                        {},
                        false};
      for (const Column& column : family.columns) {
        Case one;
        one.mechanism = group.name;
        one.column = column;
        one.keys = CaseKeys(experiment, one);
        // a right-hand side has no tolerance and no horizon
        for (const char* key : {"integrator", "rtol", "atol", "horizon"}) {
          one.keys.Set(key, Value());
        }
        if (!Matches(one.keys, filter)) continue;
        SetTimingId(FamilyTimingContent(experiment), &one.keys);
        group.cases.push_back(one);
      }
      if (!group.cases.empty()) groups.push_back(std::move(group));
    }
  }
  return groups;
}

std::size_t CountTimings(const Experiment& experiment, const Selection& filter) {
  std::size_t count = 0;
  for (const TimingGroup& group : TimingGroups(experiment, filter)) count += group.cases.size();
  return count;
}

}  // namespace loopbench::harness
