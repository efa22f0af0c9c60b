#include "harness/config/mechanism_writer.h"

#include <fmt/format.h>

#include "harness/config/mechanism_reader.h"
#include "harness/config/mechanism_sections.h"
#include "harness/json/json_text.h"
#include "harness/text/config_error.h"

namespace loopbench::harness {

namespace {

void RefuseReleased(const MechanismDescription& description) {
  for (const JointDescription& joint : description.joints) {
    if (joint.released.empty()) continue;
    throw ConfigError(fmt::format(
        "{}: joint \"{}\": found released directions, expected none: no mechanism file says them",
        description.name, joint.name));
  }
}

}  // namespace

std::string MechanismText(const MechanismDescription& description, const SceneObservation& observe,
                          const std::string& comment) {
  RefuseReleased(description);
  Draft draft;
  static_cast<MechanismDescription&>(draft) = description;
  draft.bodies[kGround].name = "ground";
  draft.observe = observe;
  draft.comment = comment;
  std::string text = JsonText(MechanismFileFields().Write(draft));
  ParseMechanism(text, description.name + " (written)");
  return text;
}

}  // namespace loopbench::harness
