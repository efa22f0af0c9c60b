#include "harness/exchange/import_mjcf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace loopbench::harness {

namespace {

constexpr DroppedReason kMjcfReasons[] = {
    {"asset", "meshes, textures and materials do not move anything"},
    {"visual", ""},
    {"statistic", ""},
    {"size", ""},
    {"custom", ""},
    {"light", ""},
    {"camera", ""},
    {"contact", "there is no contact"},
    {"sensor", "there are no sensors"},
    {"extension", "there are no plugins", true},
    {"deformable", "bodies are rigid", true},
    {"joint@armature", "rotors have no inertia beside that of the bodies", true},
    {"joint@frictionloss", "dry friction is no force of mechanism files", true},
    {"@group", ""},
    {"@user", ""},
    {"@margin", ""},
    {"@solimplimit", ""},
    {"@solreflimit", ""},
    {"@solimpfriction", ""},
    {"@solreffriction", ""},
    {"@actuatorfrcrange", ""},
    {"@actuatorfrclimited", ""},
    {"joint@springdamper", "stiffness and damping by frequency depend on masses of the start",
     true},
    {"freejoint@align", ""},
    {"site@type", ""},
    {"site@size", ""},
    {"@rgba", ""},
    {"@material", ""},
    {"@width", ""},
    {"site@fromto", "a site is taken as the point at its `pos`"},
    {"body@sleep", ""},
    {"option@timestep", "runs choose their own steps"},
    {"option@integrator", "runs choose their own integrator"},
    {"option@density", "there is no medium", true},
    {"option@viscosity", "there is no medium", true},
    {"option@wind", "there is no medium", true},
    {"option@cone", ""},
    {"option@jacobian", ""},
    {"option@solver", ""},
    {"option@iterations", ""},
    {"option@tolerance", ""},
    {"option@ls_iterations", ""},
    {"option@ls_tolerance", ""},
    {"option@noslip_iterations", ""},
    {"option@noslip_tolerance", ""},
    {"option@mpr_iterations", ""},
    {"option@mpr_tolerance", ""},
    {"option@ccd_iterations", ""},
    {"option@ccd_tolerance", ""},
    {"option@impratio", ""},
    {"option@apirate", ""},
    {"option@magnetic", ""},
    {"option@o_margin", ""},
    {"option@o_solref", ""},
    {"option@o_solimp", ""},
    {"option@o_friction", ""},
    {"option@collision", ""},
    {"option@sdf_iterations", ""},
    {"option@sdf_initpoints", ""},
    {"@warmstart", ""},
    {"@filterparent", ""},
    {"@multiccd", ""},
    {"@island", ""},
    {"@eulerdamp", ""},
    {"@energy", ""},
    {"@fwdinv", ""},
    {"@override", ""},
    {"@sensor", ""},
    {"@midphase", ""},
    {"@nativeccd", ""},
    {"@autoreset", ""},
    {"@invdiscrete", ""},
    {"@sensornoise", ""},
    {"@refsafe", ""},
    {"@frictionloss", ""},
    {"@limit", ""},
    {"compiler@strippath", ""},
    {"compiler@meshdir", ""},
    {"compiler@texturedir", ""},
    {"compiler@assetdir", ""},
    {"compiler@discardvisual", ""},
    {"compiler@usethread", ""},
    {"compiler@fusestatic", "bodies without joints stay bodies, welded"},
    {"compiler@convexhull", ""},
    {"compiler@exactmeshinertia", ""},
    {"compiler@fitaabb", ""},
    {"compiler@saveinertial", ""},
    {"compiler@alignfree", ""}};

constexpr std::size_t kActuatorGroups = 31;  // that can be switched off

/// Refuses elements that stand for other parts of a model, wherever something is read.
void RefuseMacros(const XmlElement& root) {
  const std::vector<std::string_view> macros = {"include", "composite", "flexcomp", "replicate",
                                                "attach"};
  std::vector<XmlElement> found = root.ChildrenOf(macros);
  for (const XmlElement& section :
       root.ChildrenOf({"compiler", "option", "default", "worldbody", "equality", "tendon",
                        "actuator", "keyframe"})) {
    if (const auto macro = section.Within(macros)) found.push_back(*macro);
  }
  if (found.empty()) return;
  found[0].Fail("an element that stands for other parts of a model",
                "the whole model in one file, as MuJoCo saves it (mj_saveLastXML)");
}

void ReadCompiler(const XmlElement& element, MjcfSettings* settings) {
  const auto flag = [&](const char* name, bool* value) {
    if (const auto given = element.Attribute(name)) *value = given->Bool();
  };
  const auto number = [&](const char* name, double* value, const Range& range) {
    if (const auto given = element.Attribute(name)) *value = given->Number(range);
  };
  if (const auto angle = element.Attribute("angle")) {
    settings->degrees = angle->Choice({"radian", "degree"}) == 1;
  }
  if (const auto coordinate = element.Attribute("coordinate")) {
    if (coordinate->text() != "local") {
      coordinate->Fail("local: global coordinates left MuJoCo with version 2.3.2");
    }
  }
  if (const auto euler = element.Attribute("eulerseq")) {
    settings->euler = euler->text();
    const bool whole = settings->euler.size() == 3 &&
                       settings->euler.find_first_not_of("xyzXYZ") == std::string::npos;
    if (!whole) euler->Fail("three letters of x, y, z, X, Y, Z");
  }
  if (const auto from = element.Attribute("inertiafromgeom")) {
    const std::size_t choice = from->Choice({"false", "true", "auto"});
    settings->inertia = choice == 0   ? MjcfSettings::kFromInertial
                        : choice == 1 ? MjcfSettings::kFromGeoms
                                      : MjcfSettings::kAuto;
  }
  if (const auto range = element.Attribute("inertiagrouprange")) {
    const std::vector<double> groups = range->Numbers(2, 2);
    settings->first_group = static_cast<int>(std::clamp(groups[0], -1e6, 1e6));
    settings->last_group = static_cast<int>(std::clamp(groups[1], -1e6, 1e6));
  }
  flag("balanceinertia", &settings->balances_inertia);
  flag("autolimits", &settings->limits_by_range);
  number("boundmass", &settings->least_mass, kNotNegative);
  number("boundinertia", &settings->least_inertia, kNotNegative);
  number("settotalmass", &settings->total_mass, {});
}

void ReadOption(const XmlElement& element, MjcfModel* model) {
  MjcfSettings& settings = model->settings;
  if (const auto gravity = element.Attribute("gravity")) {
    model->draft->description.gravity = gravity->Vector();
  }
  const auto has_medium = [&](const char* name) {
    if (!element.HasAttribute(name)) return false;
    for (const double value : element.Attribute(name)->Numbers(1, 3)) {
      if (value != 0.0) return true;
    }
    return false;
  };
  for (const char* name : {"density", "viscosity", "wind"}) {
    if (has_medium(name)) model->draft->Note(element, name, "dropped: there is no medium", true);
  }
  if (const auto groups = element.Attribute("actuatorgroupdisable")) {
    for (const double group : groups->Numbers(0, kActuatorGroups)) {
      if (!(group >= 0.0 && group < kActuatorGroups) || group != std::floor(group)) {
        groups->Fail("whole numbers from 0 to 30");
      }
      settings.silent_groups.insert(static_cast<int>(group));
    }
  }
  for (const XmlElement& flag : element.Children("flag")) {
    const auto on = [&](const char* name, bool* value) {
      const auto given = flag.Attribute(name);
      if (given) *value = given->Choice({"disable", "enable"}) == 1;
    };
    bool has_gravity = true, has_passive = true;
    on("gravity", &has_gravity);
    on("passive", &has_passive);
    on("spring", &settings.has_springs);
    on("damper", &settings.has_dampers);
    bool has_constraints = true;
    on("equality", &settings.has_equality);
    on("constraint", &has_constraints);
    on("actuation", &settings.has_actuation);
    on("clampctrl", &settings.clamps_controls);
    on("contact", &settings.has_contact);
    if (!has_gravity) model->draft->description.gravity.setZero();
    if (!has_constraints) settings.has_equality = false;
    if (!has_passive) settings.has_springs = settings.has_dampers = false;
  }
}

/// Tendons that an active <equality><tendon> keeps at their length.
std::map<std::string, XmlElement> HeldTendons(const XmlElement& root, MjcfModel* model) {
  std::map<std::string, XmlElement> held;
  for (const XmlElement& section : root.Children("equality")) {
    for (const XmlElement& element : section.Children("tendon")) {
      const MjcfElement equality = model->defaults.Peek(element, "", "equality");
      const auto active = equality.Attribute("active");
      const auto first = equality.Attribute("tendon1");
      if (!first || equality.Attribute("tendon2") || (active && !active->Bool())) continue;
      held.emplace(first->Name(), element);
    }
  }
  return held;
}

}  // namespace

void ReadMjcf(const XmlElement& root, ImportDraft* draft) {
  MjcfModel model(draft);
  if (const auto name = root.Attribute("model")) draft->description.name = name->Name();
  draft->description.gravity = {0.0, 0.0, -9.81};
  RefuseMacros(root);
  for (const XmlElement& element : root.Children("compiler")) {
    ReadCompiler(element, &model.settings);
  }
  for (const XmlElement& element : root.Children("option")) ReadOption(element, &model);
  for (const XmlElement& element : root.Children("default")) model.defaults.Read(element, "");
  const std::vector<XmlElement> worlds = root.Children("worldbody");
  if (worlds.empty()) root.Fail("no <worldbody>", "one");
  for (const XmlElement& world : worlds) ReadMjcfWorld(world, &model);
  AdjustMasses(&model);
  const auto held = HeldTendons(root, &model);
  for (const XmlElement& section : root.Children("equality")) ReadMjcfEquality(section, &model);
  ReadMjcfTendons(root, held, &model);
  ReadMjcfKeys(root, &model);
  model.defaults.IgnoreUnused();
  for (const char* silent : {"visual", "statistic", "size", "custom"}) {
    for (const XmlElement& element : root.Children(silent)) element.Ignore();
  }
  for (const char* whole : {"asset", "contact", "sensor", "extension", "deformable"}) {
    for (const XmlElement& element : root.Children(whole)) {
      const auto known = std::ranges::find(kMjcfReasons, whole, &DroppedReason::what);
      element.Ignore();
      draft->Note(element, fmt::format("dropped: {}", known->reason), known->changes_motion);
    }
  }
  draft->NoteUnread(kMjcfReasons);
}

}  // namespace loopbench::harness
