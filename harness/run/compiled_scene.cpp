#include "harness/run/compiled_scene.h"

#include <algorithm>

namespace loopbench::harness {

namespace {

const BodyImage& ImageOf(const MechanismDescription& description, const Compiled& compiled,
                         const std::string& name) {
  const auto body = std::ranges::find(description.bodies, name, &BodyDescription::name);
  return compiled.bodies[static_cast<std::size_t>(body - description.bodies.begin())];
}

}  // namespace

CompiledScene CompileScene(const MechanismDescription& description, const SceneObservation& observe,
                           CompileOptions options) {
  const bool angles = !observe.branch_invariants.empty() || observe.closed_form.has_value();
  if (angles) options.islands = false;
  if (angles && description.space == SpaceKind::kSpatial) {  // no body may change its axes
    const bool redundancy = options.redundancy;
    options = CompileOptions::None();
    options.redundancy = redundancy;
  }
  CompiledScene scene{Compile(description, options), observe};
  if (scene.compiled.done == CompileOptions::None()) return scene;
  const std::vector<BodyDescription>& bodies = scene.compiled.parts.front().description.bodies;
  for (AngleCombination& combination : scene.observe.branch_invariants) {
    // what is fixed adds a constant, and only changes count
    std::erase_if(combination, [&](const auto& term) {
      return ImageOf(description, scene.compiled, term.first).part < 0;
    });
    for (auto& [name, factor] : combination) {
      name = bodies[ImageOf(description, scene.compiled, name).body].name;
    }
  }
  if (auto& form = scene.observe.closed_form) {
    const BodyImage& image = ImageOf(description, scene.compiled, form->body);
    if (image.part < 0) {
      form.reset();
    } else {
      form->body = bodies[image.body].name;
      form->down_angle -= image.turn;
    }
  }
  return scene;
}

std::string ToString(const CompileOptions& options) {
  std::string text;
  const auto add = [&](bool on, const char* name) {
    if (on) text += (text.empty() ? "" : ", ") + std::string(name);
  };
  add(options.planar, "planar");
  add(options.welds, "welds");
  add(options.immovable, "immovable");
  add(options.islands, "islands");
  add(options.redundancy, "redundancy");
  return text.empty() ? "none" : text;
}

}  // namespace loopbench::harness
