#include "harness/exchange/import.h"

#include <limits>

#include "harness/base/text.h"
#include "harness/config/mechanism_sections.h"
#include "harness/exchange/import_draft.h"
#include "mechanism/algebra/symmetric_eigen.h"
#include "mechanism/description/topology.h"

namespace loopbench::harness {

namespace {

/// Reason why a body cannot move by itself, and the required values; "" if it can.
using MassFault = std::pair<std::string, std::string>;

MassFault MassFaultOf(const BodyDescription& body) {
  constexpr double kPrinted = 0.01;  // precision of mechanism files (mechanism_bodies.cpp)
  if (!std::isfinite(body.mass) || !body.com.allFinite() || !body.inertia.allFinite()) {
    return {"numbers too large for its mass and inertia", "a body of finite mass and size"};
  }
  if (body.mass == 0.0) {
    return {"a body without mass that moves",
            "a mass > 0, or a joint that fixes it to a body with one: nothing could accelerate it"};
  }
  const Eigen::Vector3d moments = SymmetricEigenvalues(body.inertia);
  const std::string shown =
      fmt::format("principal moments {:.4g}, {:.4g}, {:.4g} kg m^2, with all that is fixed to it",
                  moments[0], moments[1], moments[2]);
  if (!(moments[0] > exchange::kMomentRoundOff * moments[2])) return {shown, "three that are > 0"};
  if (moments[2] > (1.0 + kPrinted) * (moments[0] + moments[1])) {
    return {shown,
            "none larger than the sum of the other two, as no body's is (--balance-inertia "
            "replaces them by their mean)"};
  }
  return {};
}

/// Bodies welded to a root, and their carrier in or next to the cluster: the ground if present,
/// else the first body with valid mass properties, else the first with a mass.
struct Cluster {
  std::vector<int> members;
  std::map<int, Frame> poses;
  int carrier = -1;  ///< -1 if no body has a mass
};

/// Returns the cluster of a body. Bodies with valid mass properties (`sound`) end it and carry it,
/// unless `whole` includes all parts fixed together.
Cluster ClusterOf(const MechanismDescription& d, const BodyLoads& loads,
                  const std::vector<bool>& sound, bool whole, int root) {
  Cluster cluster;
  int best = 0;
  const auto add = [&](int body, const Frame& X) {
    cluster.poses[body] = X;
    const bool ends = body == kGround || (sound[body] && !whole);
    if (!ends || body == root) cluster.members.push_back(body);
    const int rank = body == kGround ? 3 : sound[body] ? 2 : d.bodies[body].mass > 0.0 ? 1 : 0;
    if (rank <= best) return;
    best = rank;
    cluster.carrier = body;
  };
  add(root, Frame());
  for (std::size_t k = 0; k < cluster.members.size(); ++k) {
    const int at = cluster.members[k];
    for (const int joint : loads.joints[at]) {
      const JointDescription& weld = d.joints[joint];
      if (weld.type != JointType::kWeld) continue;
      for (const auto& [here, there] : {std::pair{&weld.from, &weld.to}, {&weld.to, &weld.from}}) {
        if (here->body != at || cluster.poses.contains(there->body)) continue;
        add(there->body, cluster.poses[at] * PoseOf(*here) * PoseOf(*there).Inverse());
      }
    }
  }
  return cluster;
}

/// Sidecar: loops, forces and a start that the other format cannot express. The present mechanism,
/// and poses of its bodies in ground axes at zero coordinates, where loops given on one side close.
struct Sidecar : Draft {
  std::vector<Frame> at_rest;
  bool has_gravity = false;
};

/// A joint given on one side: at rest its other frame coincides.
using Loop = JointDescription;

const PartFields<Loop>& LoopFields() {
  const auto read_type = [](const JsonNode& node, Loop& loop) {
    loop.type = static_cast<JointType>(node.Choice(JointTypeNames(), "a joint type").value_or(0));
    if (!TraitsOf(loop.type).parameter.key.empty() || loop.type == JointType::kFree) {
      node.Fail("a type without a number of its own: others stand in \"joints\"");
    }
  };
  const auto read_second = [](const JsonNode& node, Loop& loop, const Draft& draft) {
    loop.to.body = ReadBodyName(node, draft).value_or(-1);
    if (loop.to.body >= 0 && loop.to.body == loop.from.body) node.Fail("another body");
  };
  const auto read_axis = [](const JsonNode& node, Loop& loop, const Draft& draft) {
    loop.axis = ReadVector(node, draft);
    if (TraitsOf(loop.type).own_axis == '-') {
      node.Fail(fmt::format("no axis of a {} joint", ToString(loop.type)));
    } else if (loop.axis.isZero()) {
      node.Fail("an axis that is not zero");
    }
  };
  const auto body = [](Loop& loop) -> int& { return loop.from.body; };
  const auto at = [](Loop& loop) -> Eigen::Vector3d& { return loop.from.position; };
  static const PartFields<Loop> fields(
      "loop", "A joint given on one side, which closes where all coordinates are 0.",
      {{"name", NewName<Loop>(&Loop::name, &Draft::joint_names), "One that no other joint has.",
        "a name"},
       {"type", By(ChoiceSchema(JointTypeNames().all()), +read_type), "What it leaves free.",
        "a joint type"},
       {"from", BodyOf<Loop>(body, true), "A body's name or \"ground\".", "the name of a body"},
       {"to", By(TextSchema(), +read_second), "Another.", "the name of a body"},
       {"at", PlaceOf<Loop>(body, at), "The joint in axes of `from` [m].",
        "a point of `from`, or coordinates in its axes"},
       {"axis", By(VectorSchema(), +read_axis), "In axes of `from`."}});
  return fields;
}

void ReadLoops(const JsonNode& node, Sidecar& sidecar) {
  for (const JsonNode& element : node.Elements("loops")) {
    Loop loop;
    loop.from.body = loop.to.body = -1;
    LoopFields().Read(element, &loop, sidecar);
    if (loop.from.body >= 0 && loop.to.body >= 0) {
      // the other side from the body poses
      const auto& rest = sidecar.at_rest;
      const Frame X_QP = rest[loop.to.body].Inverse() * rest[loop.from.body];
      const Eigen::AngleAxisd turn{Eigen::Quaterniond(X_QP.R)};
      loop.to.position = X_QP.R * loop.from.position + X_QP.p;
      loop.to.rotation = turn.angle() * turn.axis();
      loop.cut = true;
    }
    sidecar.joints.push_back(loop);
    sidecar.joint_names.Add(loop.name);
  }
}

const Fields<Sidecar, const Draft>& SidecarFields() {
  const auto read_gravity = [](const JsonNode& node, Sidecar& sidecar) {
    sidecar.gravity = ReadVector(node, sidecar);
    sidecar.has_gravity = true;
  };
  static const Fields<Sidecar, const Draft> fields(
      "sidecar", "What a description of another program cannot say.",
      {{"comment", Text(&Draft::comment), "Free text for readers."},
       {"gravity", By(VectorSchema(), +read_gravity), "In place of the file's [m/s^2]."},
       {"loops", By(ArraySchema(LoopFields().Schema()), ReadLoops), "Joints given on one side."},
       {"joints", JointsValue(), "Joints given on both sides."},
       {"couplings", CouplingsValue(), "Linear relations of joint coordinates."},
       {"forces", ForcesValue(), "Besides gravity."},
       {"initial", Object(&Draft::initial, InitialFields()), "In place of the file's start."},
       {"known_solution", Section(ObservationFields()),
        "Exact facts that observers compare with."}});
  return fields;
}

/// Adds the file to `description`, with its start. Throws ConfigError with all mistakes.
Sidecar ReadSidecar(const std::filesystem::path& path, const std::vector<Frame>& at_rest,
                    MechanismDescription* description) {
  Sidecar sidecar;
  static_cast<MechanismDescription&>(sidecar) = *description;
  sidecar.at_rest = at_rest;
  for (const BodyDescription& body : sidecar.bodies) sidecar.body_names.Add(body.name);
  for (const JointDescription& joint : sidecar.joints) sidecar.joint_names.Add(joint.name);
  ReadDocument(ReadTextFile(path), path.string(),
               [&](const JsonNode& root) { return SidecarFields().Read(root, &sidecar, sidecar); });
  *description = static_cast<MechanismDescription&>(sidecar);
  return sidecar;
}

}  // namespace

Imported ImportText(std::string_view text, const std::string& file, const ImportOptions& options,
                    const std::optional<std::filesystem::path>& path) {
  const XmlElement root(xml::Parse(text, {file, path}));
  const std::string format = root.tag() == "mujoco"  ? "mjcf"
                             : root.tag() == "robot" ? "urdf"
                             : root.tag() == "sdf"   ? "sdf"
                                                     : "";
  if (format.empty()) root.Fail("this root element", "<mujoco> (MJCF), <robot> (URDF) or <sdf>");
  if (!options.format.empty() && options.format != format) {
    root.Fail(format, fmt::format("{}, as --input-format says", options.format));
  }
  if (options.floats && format != "urdf") {
    root.Fail(format, "urdf with --floating: other formats say what is free");
  }
  ImportDraft draft(root, options);
  draft.description.name = std::filesystem::path(file).stem().string();
  if (format == "mjcf") ReadMjcf(root, &draft);
  if (format == "urdf") ReadUrdf(root, options, &draft);
  if (format == "sdf") ReadSdf(root, &draft);
  if (draft.description.name.empty()) draft.description.name = "imported";
  return draft.Finish(format);
}

Imported ImportMechanism(const std::filesystem::path& path, const ImportOptions& options) {
  return ImportText(ReadTextFile(path), path.string(), options, path);
}

BodyLoads::BodyLoads(const MechanismDescription& d) : joints(d.bodies.size()) {
  for (const BodyDescription& body : d.bodies) {
    has_load.push_back(body.mass > 0.0 || !body.inertia.isZero(0.0));
  }
  for (int j = 0; j < std::ssize(d.joints); ++j) {
    for (const auto& side : {d.joints[j].from, d.joints[j].to}) joints[side.body].push_back(j);
  }
  for (ForceDescription force : d.forces) {
    for (const BodyPoint* point : PartsOf(force).points) has_load[point->body] = true;
  }
}

std::vector<int> FixedTogether(const MechanismDescription& description) {
  const std::vector<bool> sound(description.bodies.size(), true);
  const BodyLoads loads(description);
  std::vector<int> groups(sound.size(), -1);
  for (int i = 0; i < std::ssize(groups); ++i) {
    if (groups[i] >= 0) continue;
    for (const int body : ClusterOf(description, loads, sound, true, i).members) groups[body] = i;
  }
  return groups;
}

void ImportDraft::MergeFixed(bool whole) {
  const std::size_t count = description.bodies.size();
  std::vector<bool> sound(count), seen(count);
  for (std::size_t i = 0; i < count; ++i) {
    sound[i] = i == kGround || MassFaultOf(description.bodies[i]).first.empty();
  }
  std::vector<Attachment> attachments(count);
  const BodyLoads loads(description);
  for (int i = 1; i < std::ssize(sound); ++i) {
    if (sound[i] || seen[i]) continue;
    Cluster cluster = ClusterOf(description, loads, sound, whole, i);
    if (cluster.carrier < 0) cluster.carrier = i;  // a link without mass of several parts
    for (const int body : cluster.members) {
      seen[body] = true;
      if (body == cluster.carrier) continue;
      const Frame X = cluster.poses.at(cluster.carrier).Inverse() * cluster.poses.at(body);
      attachments[body] = {cluster.carrier, X, 0.0, true};
      const BodyDescription& merged = description.bodies[body];
      const char* why = merged.mass == 0.0 ? "without mass and fixed"
                        : sound[body]      ? "fixed to a body without an inertia of its own"
                                           : "without an inertia of its own and fixed";
      std::string reason =
          fmt::format("{}: merged with \"{}\"", why, description.bodies[cluster.carrier].name);
      if (!merged.points.empty()) reason += fmt::format(", points are \"{}.POINT\"", merged.name);
      Note(elements_[body], reason);
    }
  }
  Attach(attachments);
}

void ImportDraft::Attach(const std::vector<Attachment>& attachments) {
  if (std::ranges::none_of(attachments, &Attachment::attached)) return;
  Renumbering renumbering;
  MechanismDescription merged = MergeRigidBodies(description, attachments, &renumbering);
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    const JointDescription& joint = description.joints[j];
    if (renumbering.joints[j] >= 0 || joint.type == JointType::kWeld) continue;
    Note(elements_[joint.to.body],
         "joint \"" + joint.name + "\" dropped: it leads from a body to what is fixed to it");
  }
  for (const CouplingDescription& coupling : description.couplings) {
    const auto lost = std::ranges::find_if(
        coupling.parts, [&](const auto& part) { return renumbering.joints[part.joint] < 0; });
    if (lost == coupling.parts.end()) continue;
    const int body = description.joints[lost->joint].to.body;
    Note(elements_[body], fmt::format("coupling \"{}\" dropped with its joint", coupling.name));
  }
  for (PoseTarget pose : description.initial.poses) {
    const Attachment& at = attachments[pose.body];
    if (at.attached) {
      pose.body = at.carrier;
      pose.point = at.X.R * pose.point + at.X.p;
      if (pose.rotation) {
        const Frame X = PoseOf({0, Eigen::Vector3d::Zero(), *pose.rotation});
        pose.rotation = RotationVector(Eigen::Quaterniond(X.R * at.X.R.transpose()));
      }
    }
    pose.body = renumbering.bodies[pose.body];
    merged.initial.poses.push_back(pose);
  }
  description = std::move(merged);
  for (std::size_t i = 0; i < attachments.size(); ++i) {
    const int kept = renumbering.bodies[i];  // never above i
    if (kept < 0) continue;
    at_rest[kept] = at_rest[i];
    elements_[kept] = elements_[i];
  }
  at_rest.resize(description.bodies.size());
}

/// A joint that follows one other joint has no effect on it. With a motion, or with several others,
/// it moves them.
bool ImportDraft::CouplesOthers(int joint) const {
  std::size_t coupled = 0;
  for (const CouplingDescription& coupling : description.couplings) {
    if (!Contains(coupling.parts, joint, &CouplingDescription::Part::joint)) continue;
    coupled += coupling.parts.size() - 1;
  }
  return coupled > 0 && coupled + description.joints[joint].motions.size() > 1;
}

void ImportDraft::FixMasslessEnds() {
  std::set<const void*> noted;
  for (bool found = true; found;) {
    found = false;
    const BodyLoads loads(description);
    std::vector<Attachment> attachments(description.bodies.size());
    for (std::size_t i = 1; i < attachments.size(); ++i) {
      if (loads.has_load[i] || loads.joints[i].size() != 1) continue;
      const int joint = loads.joints[i][0],
                carrier = Beyond(description.joints[joint], static_cast<int>(i));
      if (carrier == kGround || attachments[carrier].attached) continue;
      if (CouplesOthers(joint)) continue;
      const Placement X = at_rest[carrier].Inverse() * at_rest[i];
      attachments[i] = {carrier, X.AsFrame(), 0.0, true};
      if (noted.insert(elements_[i].id()).second) {
        Note(elements_[i], "without mass at the end of a chain: fixed where it is drawn");
      }
      found = true;
    }
    Attach(attachments);
  }
}

bool Balance(Eigen::Matrix3d* inertia) {
  const Eigen::Vector3d moments = SymmetricEigenvalues(*inertia);
  if (!(moments[0] + moments[1] < moments[2])) return false;
  *inertia = moments.mean() * Eigen::Matrix3d::Identity();
  return true;
}

void ImportDraft::CheckMasses() {
  for (std::size_t i = 1; i < description.bodies.size(); ++i) {
    BodyDescription& body = description.bodies[i];
    if (options_.balances_inertia && Balance(&body.inertia)) {
      Note(elements_[i],
           fmt::format("no body has such moments of inertia: their mean, {:.4g} kg m^2",
                       body.inertia(0, 0)),
           true);
    }
    const auto [found, expected] = MassFaultOf(body);
    if (!found.empty()) elements_[i].Fail(found, expected);
  }
}

void ImportDraft::HoldFloatingParts() {
  for (const Island& island : FindIslands(description, Connection::kJoints)) {
    if (island.grounded) continue;
    const bool has_base = std::ranges::count(island.bodies, base) > 0;
    const int root = has_base ? base : island.bodies.front();
    AddJoint(NameLater(description.bodies[root].name), JointType::kFree, {}, {root, {}});
    description.initial.coordinates.push_back({last_joint(), at_rest[root].AsCoordinates()});
  }
  NameJoints();
}

Imported ImportDraft::Finish(const std::string& format) {
  Imported imported;
  imported.format = format;
  NameJoints();
  bool gravity_is_said = options_.gravity.has_value() || !assumed_gravity_;
  if (!options_.sidecar.empty()) {
    std::vector<Frame> rest = Mapped<Frame>(at_rest, &Placement::AsFrame);
    const Sidecar facts = ReadSidecar(options_.sidecar, rest, &description);
    imported.observe = facts;
    gravity_is_said = gravity_is_said || facts.has_gravity;
  }
  if (!gravity_is_said) {
    Note(*assumed_gravity_, fmt::format("found no gravity: {} m/s^2 along -z (--gravity x,y,z "
                                        "sets another)",
                                        -description.gravity.z()));
  }
  if (options_.gravity) description.gravity = *options_.gravity;
  const std::vector<int> groups = FixedTogether(description);
  for (const auto& [body, read] : late_masses_) {
    if (groups[body] != kGround) read();
  }
  for (const auto& [body, share] : lifts_) {
    const BodyDescription& lifted = description.bodies[body];
    if (!(lifted.mass > 0.0) || description.gravity.isZero(0.0)) continue;
    description.forces.emplace_back(
        PointForce{{body, lifted.com}, -share * lifted.mass * description.gravity, false});
  }
  if (!rounded_.empty()) {
    notes_[rounded_note_].reason +=
        fmt::format("; values with rounded angles or directions: {} (--keep-digits keeps them)",
                    rounded_.size());
  }
  HoldFloatingParts();
  MergeFixed(false);
  FixMasslessEnds();
  ComposeChains();
  MergeFixed(true);
  CheckMasses();
  if (description.bodies.size() < 2) {
    elements_[kGround].Fail("no body", "at least one that is not fixed to the ground");
  }
  if (options_.planar) GoToPlane();
  const std::string fault = Validate(description);
  if (!fault.empty()) throw ConfigError(fmt::format("{}: {}", file(), fault));
  std::ranges::stable_sort(notes_, {}, [&](const ImportNote& note) {
    return std::tuple(note.file != file(), note.file, note.line);
  });
  if (has_replicas) {
    std::set<std::tuple<std::string, int, std::string, std::string>> seen;
    std::erase_if(notes_, [&](const ImportNote& note) {
      return !seen.emplace(note.file, note.line, note.element, note.reason).second;
    });
  }
  imported.description = std::move(description);
  imported.notes = std::move(notes_);
  return imported;
}

}  // namespace loopbench::harness
