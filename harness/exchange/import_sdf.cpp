#include "harness/exchange/import_sdf.h"

#include <fmt/format.h>

#include <charconv>

namespace loopbench::harness {

namespace {

constexpr int kFirstVersion = 4, kLastVersion = 12;
constexpr double kSdfGravity = 9.8;  // [m/s^2]

constexpr DroppedReason kSdfReasons[] = {
    {"visual", "shapes do not move anything"},
    {"collision", "there is no contact"},
    {"sensor", "there are no sensors"},
    {"audio_source", ""},
    {"audio_sink", ""},
    {"light", ""},
    {"projector", ""},
    {"particle_emitter", ""},
    {"battery", ""},
    {"scene", ""},
    {"gui", ""},
    {"audio", ""},
    {"physics", "runs choose their own integrator and steps"},
    {"atmosphere", "there is no medium"},
    {"wind", "there is no medium", true},
    {"magnetic_field", ""},
    {"spherical_coordinates", ""},
    {"self_collide", ""},
    {"allow_auto_disable", ""},
    {"enable_wind", "there is no medium"},
    {"must_be_base_link", ""},
    {"velocity_decay", "there is no medium: a force would have to say it", true},
    {"kinematic", "bodies move as forces make them", true},
    {"fluid_added_mass", "there is no medium", true},
    {"mimic", "no joint follows another: a freedom more than in the file", true},
    {"plugin", "there are no plugins", true},
    {"state", "the start is that of the poses", true},
    {"actor", "actors are no mechanism"},
    {"road", ""},
    {"population", "it makes models while it runs", true},
    {"gripper", "", true},
    {"link@name", ""},
    {"model@canonical_link", ""},
    {"sdf@version", ""}};

SdfVersion ReadVersion(const XmlElement& root) {
  const XmlValue value = root.Required("version", "1.4 to 1.12");
  const std::string& text = value.text();
  SdfVersion version;
  const bool first = text.starts_with("1.");
  const char* start = text.data() + (first ? 2 : 0);
  const auto [end, error] = std::from_chars(start, text.data() + text.size(), version.minor);
  const bool whole = first && error == std::errc() && end == text.data() + text.size();
  if (!whole || version.minor < kFirstVersion || version.minor > kLastVersion) {
    value.Fail("a version from 1.4 to 1.12");
  }
  return version;
}

void RefuseIncludes(const XmlElement& element) {
  for (const XmlElement& include : element.Children("include")) {
    include.Fail("a model in another file", "all in one file (gz sdf -p FILE writes it)");
  }
}

/// What a joint moves.
XmlValue ReadChild(const XmlElement& joint) {
  const XmlValue child = joint.RequiredChild("child").Content();
  if (child.Name() == "world") {
    child.Fail("a link, frame or nested model: the world is no child, it can be the <parent>");
  }
  return child;
}

/// All names of a world or model, models within it included.
void ReadNames(SdfScope* scope, SdfVersion version, ImportDraft* draft) {
  const XmlElement& element = scope->element;
  RefuseIncludes(element);
  for (const char* tag : {"link", "frame", "joint"}) {
    for (const XmlElement& child : element.Children(tag)) {
      SdfFrame frame = ReadSdfPose(child, version, draft);
      if (child.tag() == "frame") {
        if (const auto attached = child.Attribute("attached_to")) {
          frame.attached_to = attached->text();
        }
      } else if (child.tag() == "joint") {
        frame.attached_to = ReadChild(child).text();
      }
      if (frame.relative_to.empty()) {
        frame.relative_to = frame.attached_to;
        frame.is_raw_to_child = child.tag() == "joint";
      }
      scope->Add(child.Required("name", "a name").Name(), std::move(frame));
    }
  }
  for (const XmlElement& child : element.Children("model")) {
    const std::string name = child.Required("name", "a name").Name();
    if (const auto placement = child.Attribute("placement_frame")) {
      if (!placement->text().empty()) placement->Fail("none: poses are those of the model's frame");
    }
    const auto fixed = child.Child("static");
    const bool is_static = scope->is_static || (fixed && fixed->Content().Bool());
    scope->Add(name, ReadSdfPose(child, version, draft));
    auto model = std::make_unique<SdfScope>(child, scope->prefix + name + "::", is_static);
    ReadNames(model.get(), version, draft);
    scope->models.emplace(name, std::move(model));
  }
}

/// Where models and links stand; links become bodies.
void ReadLinks(SdfScope* scope, SdfVersion version, ImportDraft* draft) {
  for (const XmlElement& child : scope->element.Children("link")) {
    const std::string name = child.Required("name", "a name").Name();
    const int body = draft->AddBody(child, scope->prefix + name);
    const Placement X = scope->at_rest * scope->Resolve(name, child);
    draft->at_rest[static_cast<std::size_t>(body)] = X;
    ReadSdfLink(child, body, scope->is_static, version, draft);
    if (!scope->is_static) continue;
    const std::string& body_name = draft->description.bodies[static_cast<std::size_t>(body)].name;
    draft->AddJoint(draft->NameLater(body_name + " fixed"), JointType::kWeld, kGround, X, body, {});
  }
  for (auto& [name, model] : scope->models) {
    model->at_rest = scope->at_rest * scope->Resolve(name, model->element);
    ReadLinks(model.get(), version, draft);
  }
}

void ReadJoints(const SdfScope& scope, SdfVersion version, ImportDraft* draft) {
  for (const XmlElement& joint : scope.element.Children("joint")) {
    const std::string name = joint.Required("name", "a name").Name();
    ReadSdfJoint(joint, scope.prefix + name, scope, version, draft);
  }
  for (const auto& [name, model] : scope.models) ReadJoints(*model, version, draft);
}

}  // namespace

void ReadSdfLink(const XmlElement& element, int index, bool is_static, SdfVersion version,
                 ImportDraft* draft) {
  BodyDescription& body = draft->description.bodies[static_cast<std::size_t>(index)];
  if (const auto gravity = element.Child("gravity")) {
    if (!gravity->Content().Bool() && !is_static) draft->AddLift(index, 1.0);
  }
  const auto kinematic = element.Child("kinematic");
  if (kinematic && kinematic->Content().Bool()) {
    draft->Note(*kinematic, "dropped: bodies move as forces make them", true);
  }
  const auto inertial = element.Child("inertial");
  if (is_static) {
    if (inertial) inertial->Ignore();
    return;  // merged with the ground
  }
  if (!inertial) {
    body.mass = 1.0;
    body.inertia.setIdentity();
    draft->Note(element, "no <inertial>: 1 kg and 1 kg m^2, the defaults of SDF");
    return;
  }
  if (const auto automatic = inertial->Attribute("auto"); automatic && automatic->Bool()) {
    draft->LeaveMass(index, *automatic);
    inertial->Ignore();
    return;
  }
  const auto number = [](const XmlElement& of, const char* name, double otherwise) {
    const auto child = of.Child(name);
    return child ? child->Content().Number() : otherwise;
  };
  const auto mass = inertial->Child("mass");
  body.mass = mass ? mass->Content().Number(kNotNegative) : 1.0;
  body.inertia.setIdentity();
  if (const auto inertia = inertial->Child("inertia")) {
    body.inertia = SymmetricMatrix(number(*inertia, "ixx", 1.0), number(*inertia, "iyy", 1.0),
                                   number(*inertia, "izz", 1.0), number(*inertia, "ixy", 0.0),
                                   number(*inertia, "ixz", 0.0), number(*inertia, "iyz", 0.0));
  }
  const SdfFrame pose = ReadSdfPose(*inertial, version, draft);
  if (!pose.relative_to.empty() && pose.relative_to != element.Required("name", "a name").text()) {
    inertial->RequiredChild("pose").Required("relative_to", "").Fail("none, or its own link");
  }
  body.com = pose.raw.p;
  body.inertia = InTurnedAxes(pose.raw.q, body.inertia);
}

void ReadSdf(const XmlElement& root, ImportDraft* draft) {
  const SdfVersion version = ReadVersion(root);
  const auto world = root.Child("world");
  RefuseIncludes(root);
  const XmlElement& top = world ? *world : root;
  if (world && !root.Children("model").empty()) {
    root.Fail("a <world> and a <model> beside it", "one of the two");
  }
  const std::vector<XmlElement> models = top.Children("model");
  if (models.empty()) top.Fail("no <model>", "at least one");
  if (const auto gravity = world ? world->Child("gravity") : std::nullopt) {
    draft->description.gravity = gravity->Content().Vector();
  } else {
    draft->AssumeGravity(top, kSdfGravity);
  }
  SdfScope scope(top, "", false);
  ReadNames(&scope, version, draft);
  if (models.size() == 1) {
    // names within the only model need not say whose they are
    SdfScope& only = *scope.models.begin()->second;
    const std::string before = only.prefix;
    draft->description.name = models[0].Required("name", "a name").Name();
    const auto shorten = [&](auto&& self, SdfScope* one) -> void {
      one->prefix = one->prefix.substr(before.size());
      for (auto& [name, model] : one->models) self(self, model.get());
    };
    shorten(shorten, &only);
  } else if (world) {
    if (const auto name = world->Attribute("name")) draft->description.name = name->Name();
  }
  if (world) world->Attribute("name");
  ReadLinks(&scope, version, draft);
  ReadJoints(scope, version, draft);
  draft->NoteUnread(kSdfReasons);
}

}  // namespace loopbench::harness
