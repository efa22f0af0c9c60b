#include "harness/exchange/import_mjcf.h"

namespace loopbench::harness {

using Eigen::Quaterniond, Eigen::Vector3d;

namespace {

constexpr const char* kNoMedium = "there is no medium";

constexpr DroppedReason kMjcfReasons[] = {
    {"contact", "there is no contact"},
    {"sensor", "there are no sensors"},
    {"extension", "there are no plugins", true},
    {"deformable", "bodies are rigid", true},
    {"joint@springdamper", "stiffness and damping by frequency depend on masses of the start",
     true},
    {"option@timestep", "runs choose their own steps"},
    {"option@integrator", "runs choose their own integrator"},
    {"compiler@fusestatic", "bodies without joints stay bodies, welded"},
    // without influence on the motion
    {"visual statistic size custom light camera @group @user @margin @solimplimit @solreflimit "
     "@solimpfriction @solreffriction @actuatorfrcrange @actuatorfrclimited freejoint@align "
     "site@type site@size @rgba @material @width body@sleep option@cone option@jacobian "
     "option@solver option@iterations option@tolerance option@ls_iterations "
     "option@ls_tolerance option@noslip_iterations option@noslip_tolerance "
     "option@mpr_iterations option@mpr_tolerance option@ccd_iterations option@ccd_tolerance "
     "option@impratio option@apirate option@magnetic option@o_margin option@o_solref "
     "option@o_solimp option@o_friction option@collision option@sdf_iterations "
     "option@sdf_initpoints @warmstart @filterparent @multiccd @island @eulerdamp @energy "
     "@fwdinv @override @sensor @midphase @nativeccd @autoreset @invdiscrete @sensornoise "
     "@refsafe @frictionloss @limit compiler@strippath compiler@texturedir "
     "compiler@discardvisual compiler@usethread compiler@convexhull "
     "compiler@fitaabb compiler@saveinertial",
     ""}};

constexpr std::size_t kActuatorGroups = 31;  // groups that can be disabled

/// Rejects macro elements anywhere, which represent other parts of a model.
void RefuseMacros(const XmlElement& root) {
  const std::vector<std::string_view> macros = {"include", "composite", "flexcomp", "replicate",
                                                "attach"};
  std::vector<XmlElement> found = root.Children(macros);
  for (const XmlElement& section : root.Children({"compiler", "option", "default", "worldbody",
                                                  "equality", "tendon", "actuator", "keyframe"})) {
    std::vector<std::string_view> wrong = macros;
    if (section.tag() == "worldbody") std::erase(wrong, "replicate");
    const auto all = section.node()->Descendants();
    const auto macro = std::ranges::find_if(
        all, [&](const XmlNodePointer& one) { return Contains(wrong, one->tag); });
    if (macro != all.end()) found.emplace_back(*macro);
  }
  if (found.empty()) return;
  found[0].Fail("an element that stands for other parts of a model",
                "the whole model in one file, as MuJoCo saves it (mj_saveLastXML)");
}

void ReadCompiler(const XmlElement& element, MjcfSettings* settings) {
  constexpr XmlChoice<MjcfSettings::Inertia> kInertias[] = {{"false", MjcfSettings::kFromInertial},
                                                            {"true", MjcfSettings::kFromGeoms},
                                                            {"auto", MjcfSettings::kAuto}};
  if (const auto angle = element.Attribute("angle")) {
    settings->degrees = angle->Choice<bool>({{"radian", false}, {"degree", true}});
  }
  const auto coordinate = element.Attribute("coordinate");
  if (coordinate && coordinate->text() != "local") {
    coordinate->Fail("local: global coordinates left MuJoCo with version 2.3.2");
  }
  if (const auto euler = element.Attribute("eulerseq")) {
    settings->euler = euler->text();
    const bool whole = settings->euler.size() == 3 &&
                       settings->euler.find_first_not_of("xyzXYZ") == std::string::npos;
    if (!whole) euler->Fail("three letters of x, y, z, X, Y, Z");
  }
  const auto from = element.Attribute("inertiafromgeom");
  if (from) settings->inertia = from->Choice(kInertias);
  if (const auto range = element.Attribute("inertiagrouprange")) {
    const std::vector<double> groups = range->Numbers(2, 2);
    settings->first_group = static_cast<int>(std::clamp(groups[0], -1e6, 1e6));
    settings->last_group = static_cast<int>(std::clamp(groups[1], -1e6, 1e6));
  }
  for (const char* folder : {"assetdir", "meshdir"}) {
    if (const auto given = element.Attribute(folder)) settings->mesh_folder = given->text();
  }
  for (const auto& [name, flag] : {std::pair{"balanceinertia", &settings->balances_inertia},
                                   {"autolimits", &settings->limits_by_range},
                                   {"exactmeshinertia", &settings->has_exact_meshes},
                                   {"alignfree", &settings->aligns_free}}) {
    *flag = BoolOr(element.Attribute(name), *flag);
  }
  for (const auto& [name, least] : {std::pair{"boundmass", &settings->least_mass},
                                    {"boundinertia", &settings->least_inertia}}) {
    *least = element.Number(name, *least, kNotNegative);
  }
  settings->total_mass = element.Number("settotalmass", settings->total_mass);
}

void ReadOption(const XmlElement& element, MjcfModel* model) {
  MjcfSettings& settings = model->settings;
  Vector3d& gravity = model->draft->description.gravity;
  if (const auto given = element.Attribute("gravity")) gravity = given->Vector();
  if (const auto groups = element.Attribute("actuatorgroupdisable")) {
    for (const double group : groups->Numbers(0, kActuatorGroups)) {
      if (!(group >= 0.0 && group < kActuatorGroups) || group != std::floor(group)) {
        groups->Fail("whole numbers from 0 to 30");
      }
      settings.silent_groups.insert(static_cast<int>(group));
    }
  }
}

/// Reads the flags of all <option>, of which the last value counts, and applies them.
void ReadFlags(const XmlElement& root, MjcfModel* model) {
  MjcfSettings& settings = model->settings;
  bool has_gravity = true, has_passive = true, has_constraints = true;
  for (const XmlElement& flags : root.InSections("option", {"flag"})) {
    for (const auto& [name, value] : {std::pair{"gravity", &has_gravity},
                                      {"passive", &has_passive},
                                      {"spring", &settings.has_springs},
                                      {"damper", &settings.has_dampers},
                                      {"equality", &settings.has_equality},
                                      {"constraint", &has_constraints},
                                      {"actuation", &settings.has_actuation},
                                      {"clampctrl", &settings.clamps_controls},
                                      {"limit", &settings.has_limits},
                                      {"frictionloss", &settings.has_friction},
                                      {"contact", &settings.has_contact}}) {
      const auto given = flags.Attribute(name);
      if (given) *value = given->Choice<bool>({{"disable", false}, {"enable", true}});
    }
  }
  if (!has_gravity) model->draft->description.gravity.setZero();
  if (!has_constraints) {
    settings.has_equality = settings.has_limits = settings.has_friction = false;
  }
  if (!has_passive) settings.has_springs = settings.has_dampers = false;
}

/// Notes a medium. Wind alone has no effect.
void NoteMedium(const XmlElement& root, const MjcfModel& model) {
  bool has_medium = false;
  for (const char* name : {"density", "viscosity", "wind"}) {
    for (const XmlElement& element : root.Children({"option"})) {
      const auto given = element.Attribute(name);
      const std::vector<double> medium = given ? given->Numbers(1, 3) : std::vector<double>();
      if (std::ranges::all_of(medium, [](double value) { return value == 0.0; })) continue;
      has_medium = has_medium || std::string_view(name) != "wind";
      if (has_medium && model.settings.has_passive()) model.draft->Drop(element, name, kNoMedium);
    }
  }
}

/// Keeps meshes for the masses of geoms, by default under their file's name without ending.
void ReadAssets(const XmlElement& root, MjcfModel* model) {
  for (const XmlElement& assets : root.Children({"asset"})) {
    for (const XmlElement& mesh : assets.Children({"mesh"})) {
      const XmlElement element = model->defaults.Of(mesh, "");
      const auto name = mesh.Attribute("name"), file = element.Attribute("file");
      element.Ignore();  // a mesh without use has no note
      if (!name && !file) continue;
      const std::string known =
          name ? name->Name() : std::filesystem::path(file->Name()).stem().string();
      if (!model->meshes.emplace(known, element).second) {
        (name ? *name : *file).Fail("a name that no other mesh has");
      }
    }
    model->draft->DropWhole(assets, "only masses of meshes and attached models matter");
  }
}

// Default classes, and orientations.

constexpr std::size_t kMaxLayers = 100;  // each element searches all its defaults

/// Returns the element type of defaults: the tag, or "actuator".
std::string DescribedBy(const std::string& tag) {
  static const std::set<std::string> kActuators = {"general",     "motor",  "position", "velocity",
                                                   "intvelocity", "damper", "cylinder", "muscle",
                                                   "adhesion",    "plugin"};
  return kActuators.contains(tag) ? "actuator" : tag;
}

}  // namespace

void ReadMjcf(const XmlElement& root, ImportDraft* draft) {
  IncludeMjcf(root);
  MjcfModel model(draft);
  if (const auto name = root.Attribute("model")) draft->description.name = name->Name();
  draft->description.gravity = {0.0, 0.0, -9.81};
  RefuseMacros(root);
  for (const XmlElement& element : root.Children({"compiler"})) {
    ReadCompiler(element, &model.settings);
  }
  for (const XmlElement& element : root.Children({"option"})) ReadOption(element, &model);
  ReadFlags(root, &model);
  NoteMedium(root, model);
  for (const XmlElement& element : root.Children({"default"})) model.defaults.Read(element, "");
  ReadAssets(root, &model);
  const std::vector<XmlElement> worlds = root.Children({"worldbody"});
  if (worlds.empty()) root.Fail("no <worldbody>", "one");
  for (const XmlElement& world : worlds) ReadMjcfWorld(world, &model);
  AdjustMasses(&model);
  // as in MuJoCo, negative ones alone have no effect
  if (std::ranges::any_of(model.lifts, [](const auto& lift) { return lift.second > 0.0; })) {
    for (const auto& [body, share] : model.lifts) draft->AddLift(body, share);
  }
  ReadMjcfLoops(root, &model);
  ReadMjcfKeys(root, &model);
  model.defaults.IgnoreUnused();
  draft->NoteUnread(kMjcfReasons);
}

void MjcfDefaults::Read(const XmlElement& element, const std::string& parent) {
  const auto given = element.Attribute("class");
  if (!given && !parent.empty()) element.Fail("no \"class\"", "a name: it is a nested class");
  const bool is_main = parent.empty() && !element.node()->is_attached_default;
  const std::string name = is_main ? kMain : given->Name();
  if (is_main) {
    // a second top-level <default> adds to the first
    const std::string also = given ? given->Name() : kMain;
    if (also != kMain && classes_.contains(also)) given->Fail("a class that is not described yet");
    names_of_main_.insert(also);
  } else if (classes_.contains(Known(name))) {
    given->Fail("a class that is not described yet");
  }
  classes_[name].parent = parent;
  for (const XmlElement& child : element.Children()) {
    if (child.tag() == "default") {
      Read(child, name);
    } else {
      classes_[name].elements[DescribedBy(child.tag())].push_back(child);
    }
  }
}

XmlElement MjcfDefaults::Of(const XmlElement& element, const std::string& childclass,
                            const std::string& tag, bool uses) const {
  const std::string wanted = DescribedBy(tag.empty() ? element.tag() : tag);
  std::string name = childclass.empty() ? kMain : childclass;
  if (const auto given = element.Attribute("class")) {
    CheckClass(*given);
    name = given->text();
  }
  XmlElement made = element;
  for (auto found = classes_.find(Known(name)); found != classes_.end();
       found = classes_.find(found->second.parent)) {
    const auto defaults = found->second.elements.find(wanted);
    if (defaults == found->second.elements.end()) continue;
    // of several defaults in one class, the last one counts
    std::for_each(defaults->second.rbegin(), defaults->second.rend(),
                  [&made](const XmlElement& layer) { made.AddDefault(layer); });
    if (uses) used_.emplace(found->first, wanted);
    element.RequireFew(made.Layers().size() - 1, kMaxLayers, "defaults of its kind");
  }
  return made;
}

void MjcfDefaults::IgnoreUnused() const {
  for (const auto& [name, one] : classes_) {
    for (const auto& [what, elements] : one.elements) {
      if (used_.contains({name, what})) continue;
      for (const XmlElement& element : elements) element.Ignore();
    }
  }
}

Quaterniond MjcfModel::OrientationOf(const XmlElement& element) const {
  constexpr const char* kWays[] = {"quat", "axisangle", "euler", "xyaxes", "zaxis"};
  std::optional<XmlValue> found;
  for (const XmlElement& layer : element.Layers()) {
    std::optional<XmlValue> here;
    for (const char* one : kWays) {
      const auto value = layer.Attribute(one);
      if (!value) continue;
      if (here) value->Fail(fmt::format("one orientation: there is \"{}\" too", here->attribute()));
      here = value;
    }
    // as in MuJoCo, a quaternion does not replace another notation of a default class
    const bool is_weak = !found || found->attribute() == kWays[0];
    if (here && is_weak && (!found || here->attribute() != kWays[0])) found = here;
  }
  if (!found) return Quaterniond::Identity();
  const std::string& way = found->attribute();
  const auto unit = [&](const Vector3d& v) -> Vector3d {
    if (!(v.norm() > 0.0)) found->Fail("axes that are not zero");
    return v.normalized();
  };
  if (way == "quat") {
    const std::vector<double> q = draft->Numbers(*found, "q");
    return UnitQuaternion(*found, {q[0], q[1], q[2], q[3]});
  }
  if (way == "euler") {
    const Vector3d angles = draft->Vector(*found, settings.degrees ? "nnn" : "aaa");
    return FromEuler(settings.euler,
                     angles.unaryExpr([&](double angle) { return settings.Angle(angle); }));
  }
  if (way == "axisangle") {
    const std::vector<double> a = draft->Numbers(*found, settings.degrees ? "dn" : "da");
    return Quaterniond(Eigen::AngleAxisd(settings.Angle(a[3]), unit({a[0], a[1], a[2]})));
  }
  if (way == "zaxis") return TurnOfZ(unit(draft->Vector(*found, "d")));
  const std::vector<double> a = draft->Numbers(*found, "dd");
  const Vector3d x = unit({a[0], a[1], a[2]}), y_given(a[3], a[4], a[5]);
  const Vector3d y = unit(y_given - x.dot(y_given) * x);
  return FromAxes(x, y, x.cross(y));
}

double MjcfModel::PlaceAlong(const XmlValue& fromto, Placement* X) const {
  const std::vector<double> ends = fromto.Numbers(6, 6);
  const Vector3d from(ends.data()), to(ends.data() + 3);
  const double length = (to - from).norm();
  if (!(length > 0.0)) fromto.Fail("two different points");
  X->p = 0.5 * (from + to);
  X->q = TurnOfZ(from - to);
  return length;
}

std::optional<MjcfLimits> MjcfModel::LimitsOf(const XmlElement& element, const std::string& flag,
                                              const std::string& range) const {
  const auto limited = element.Attribute(flag), given = element.Attribute(range);
  std::optional<bool> choice;  // none: by the range
  if (limited) {
    choice = limited->Choice<std::optional<bool>>(
        {{"false", false}, {"true", true}, {"auto", std::nullopt}});
  }
  if (!choice.value_or(given && settings.limits_by_range)) return std::nullopt;
  if (!given) element.Fail(fmt::format("\"{}\" without \"{}\"", flag, range), "both");
  const std::vector<double> ends = given->Numbers(2, 2);
  if (ends[0] < ends[1]) return MjcfLimits{ends[0], ends[1]};
  if (choice) given->Fail("two numbers, the first below the second");
  return std::nullopt;  // as in MuJoCo, whose default is 0 0
}

}  // namespace loopbench::harness
