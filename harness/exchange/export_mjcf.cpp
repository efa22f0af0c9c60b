#include "harness/exchange/export_mjcf.h"

#include <algorithm>
#include <array>

#include "harness/exchange/export_body.h"
#include "harness/exchange/export_mjcf_shapes.h"
#include "harness/exchange/export_mjcf_writer.h"

namespace loopbench::exchange {
namespace {

using Eigen::Vector3d;

/// MuJoCo's mjMAXIMP.
constexpr double kHardest = 0.9999;

std::string Section(const char* name, const std::string& elements) {
  return elements.empty() ? "" : fmt::format("  <{}>\n{}  </{}>\n", name, elements, name);
}

}  // namespace

MjcfWriter::MjcfWriter(const Model& model, const MjcfOptions& options)
    : model_(model),
      options_(options),
      children_(model.bodies.size()),
      sites_(model.bodies.size()),
      shapes_(options.shapes ? ShapesOf(model)
                             : std::vector<std::vector<std::string>>(model.bodies.size())) {
  for (std::size_t i = 0; i < model.tree.size(); ++i) {
    children_[At(model.tree[i].parent())].push_back(i);
  }
}

Mjcf MjcfWriter::Write() {
  NameBodies();
  AddPoints();
  for (const Joint& joint : model_.cut) AddClosures(joint);
  for (std::size_t i = 0; i < model_.spring_dampers.size(); ++i) AddSpringDamper(i);
  for (std::size_t i = 0; i < model_.point_forces.size(); ++i) AddPointForce(i);
  std::string bodies, world;
  for (const std::size_t index : children_[0]) AddBody(index, 2, bodies);
  for (const std::string& site : sites_[0]) world += "    " + site;
  const double h = options_.time_step;
  const std::string closures = Attribute("solref", std::array{2.0 * h, 1.0}) +
                               Attribute("solimp", std::array{kHardest, kHardest, 1e-3});
  const std::string shapes =
      options_.shapes ? "    <geom contype=\"0\" conaffinity=\"0\" rgba=\"0.55 0.6 0.7 1\"/>\n"
                      : "";
  made_.document =
      "<mujoco" + Named("model", Renamed("model", model_.name, XmlText(model_.name))) +
      ">\n  <compiler angle=\"radian\" autolimits=\"false\"/>\n  <option" +
      Attribute("timestep", h) + Attribute("gravity", model_.gravity) +
      " integrator=\"RK4\" solver=\"Newton\" cone=\"elliptic\" jacobian=\"auto\" "
      "tolerance=\"1e-15\">\n    <flag contact=\"disable\" warmstart=\"disable\"/>\n  </option>\n" +
      fmt::format("  <size njmax=\"{}\" nconmax=\"1\"/>\n", 12 * (made_.closures.size() + 1)) +
      Section("default", "    <equality" + closures + "/>\n" + shapes) +
      Section("worldbody", world + bodies) + Section("tendon", tendons_) +
      Section("equality", equalities_) + Section("actuator", actuators_) +
      Section("keyframe", "    <key name=\"start\"" + Attribute("qpos", qpos_) +
                              Attribute("qvel", qvel_) + "/>\n") +
      "</mujoco>\n";
  AddNotes();
  return std::move(made_);
}

std::string MjcfWriter::Renamed(const char* what, const std::string& given, std::string name) {
  if (name != given) Say(fmt::format("{} \"{}\" is called \"{}\".", what, given, name));
  return name;
}

void MjcfWriter::NameBodies() {
  UniqueNames names({"world"});
  body_names_.push_back("world");
  for (std::size_t i = 1; i < model_.bodies.size(); ++i) {
    const std::string& given = model_.bodies[i].name;
    body_names_.push_back(Renamed("body", given, names.Take(XmlText(given))));
  }
}

std::string MjcfWriter::AddSite(int body, const Vector3d& at, const std::string& wanted) {
  const std::string name = site_names_.Take(XmlText(wanted));
  sites_[At(body)].push_back(
      fmt::format("<site{}{}/>\n", Named("name", name), Attribute("pos", ToVec(at))));
  return name;
}

void MjcfWriter::AddPoints() {
  for (int b = 0; b < static_cast<int>(model_.bodies.size()); ++b) {
    const Body& body = model_.bodies[At(b)];
    for (const auto& [point, at] : body.points) {
      const std::string wanted = body.name + "." + point;
      Renamed("point", wanted, AddSite(b, FromOrigin(model_, b, at), wanted));
    }
  }
}

void MjcfWriter::AddBody(std::size_t index, int depth, std::string& text) {
  const Joint& joint = model_.tree[index];
  const int child = joint.child();
  const MjcfChain chain = ChainOf(model_, joint);
  const std::string indent(At(2 * depth), ' '), within = indent + "  ";
  text += fmt::format("{}<body{}{}{}>\n{}", indent, Named("name", body_names_[At(child)]),
                      Attribute("pos", ToVec(chain.pose.p)),
                      Attribute("quat", QuaternionOf(chain.pose.R)), within + Inertial(child));
  AddJoint(index, chain, within, text);
  for (const std::string& shape : shapes_[At(child)]) text += within + shape;
  for (const std::string& site : sites_[At(child)]) text += within + site;
  for (const std::size_t next : children_[At(child)]) AddBody(next, depth + 1, text);
  text += indent + "</body>\n";
}

std::string MjcfWriter::Inertial(int index) const {
  const Body& body = model_.bodies[At(index)];
  const PrincipalInertia I = PrincipalInertiaOf(body, model_.planar);
  std::string text = "<inertial" + Attribute("pos", body.com);
  if (!I.axes.isIdentity(0.0)) text += Attribute("quat", QuaternionOf(I.axes));
  return text + Attribute("mass", body.mass) + Attribute("diaginertia", ToVec(I.moments)) + "/>\n";
}

void MjcfWriter::AddJoint(std::size_t index, const MjcfChain& chain, const std::string& indent,
                          std::string& text) {
  const Joint& joint = model_.tree[index];
  const bool alone = chain.parts.size() == 1;
  std::vector<std::string> names;
  for (const MjcfPart& part : chain.parts) {
    const std::string word = part.kind == 'b' ? "turn" : joint.coordinates[At(part.coordinate)];
    const std::string& name = names.emplace_back(
        joint_names_.Take(XmlText(alone ? joint.name : joint.name + "." + word)));
    if (alone) Renamed("joint", joint.name, name);
    const char* type = part.kind == 's' ? "slide" : part.kind == 'h' ? "hinge" : "ball";
    text += fmt::format("{}<joint{} type=\"{}\" limited=\"false\"{}", indent, Named("name", name),
                        type, Attribute("pos", ToVec(part.at)));
    if (part.kind != 'b') {
      text += Attribute("axis", ToVec(part.axis)) + Attribute("ref", part.value);
    }
    text += AddEfforts(index, name) + "/>\n";
    AddCoordinate(joint, chain, part);
  }
  SayParts(joint, names);
}

std::string MjcfWriter::AddEfforts(std::size_t index, const std::string& name) {
  // effort = constant - stiffness q - damping u, of all forces on the joint
  double constant = 0.0, stiffness = 0.0, pull = 0.0, damping = 0.0;
  for (const JointForce& force : model_.joint_forces) {
    if (At(force.joint) != index) continue;
    constant += force.constant;
    stiffness += force.stiffness;
    pull += force.stiffness * force.rest;
    damping += force.damping;
  }
  const Joint& joint = model_.tree[index];
  const double sign = joint.from_is_child ? -1.0 : 1.0;
  if (constant != 0.0) {
    actuators_ += "    <general" + Named("joint", name) + Constant(sign * constant) + "/>\n";
    Say(fmt::format("The constant effort along joint \"{}\" is an actuator without control.",
                    joint.name));
  }
  std::string text;
  if (stiffness != 0.0) {
    text = Attribute("stiffness", stiffness) + Attribute("springref", sign * pull / stiffness);
  }
  return damping != 0.0 ? text + Attribute("damping", damping) : text;
}

void MjcfWriter::AddCoordinate(const Joint& joint, const MjcfChain& chain, const MjcfPart& part) {
  // speeds of a quaternion are one fewer than its numbers and stand where they do
  const int place =
      joint.num_q > joint.num_u && part.coordinate > 0 ? part.coordinate - 1 : part.coordinate;
  MjcfCoordinate& made = made_.coordinates.emplace_back();
  made.ball = part.kind == 'b';
  made.q = joint.q + part.coordinate;
  made.u = joint.u + place;
  made.sign = joint.from_is_child ? -1.0 : 1.0;
  const double* u = model_.u.data() + made.u;
  if (made.ball) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(made.axes.data()) = chain.axes;
    // MuJoCo's speeds are in axes of the body that moves
    Vector3d w = made.sign * Vector3d(u[0], u[1], u[2]);
    if (made.sign > 0.0) w = chain.turn.transpose() * w;
    w = chain.axes * w;
    qpos_.insert(qpos_.end(), {1.0, 0.0, 0.0, 0.0});
    qvel_.insert(qvel_.end(), w.begin(), w.end());
  } else {
    qpos_.push_back(part.value);
    qvel_.push_back(made.sign * *u);
  }
}

void MjcfWriter::SayParts(const Joint& joint, const std::vector<std::string>& names) {
  if (names.empty()) {
    Say(fmt::format("joint \"{}\" (weld) is body \"{}\" without a joint.", joint.name,
                    model_.bodies[At(joint.child())].name));
  }
  if (names.size() > 1) {
    Say(fmt::format("joint \"{}\" ({}) is written as joints \"{}\" of one body.", joint.name,
                    joint.kind, fmt::join(names, "\", \"")));
  }
  if (joint.from_is_child && !names.empty()) {
    Say(fmt::format(
        "joint \"{}\" is seen from its second body: coordinates have the opposite sign.",
        joint.name));
  }
  if (joint.num_q > joint.num_u) {
    Say(fmt::format("joint \"{}\": the quaternion is counted from the start.", joint.name));
  }
}

void MjcfWriter::AddNotes() {
  if (model_.planar) {
    Say("The plane is z = 0 of space. Moments of inertia about x and y, of which the motion says "
        "nothing, are those about z.");
  }
  if (made_.closures.empty()) return;
  made_.notes.push_back(
      {true, fmt::format("MuJoCo's closures are soft: springs and dampers with a time constant of "
                         "two steps (solref), and forces that leave a share of {:.0e} of the "
                         "acceleration unopposed (solimp), without the accelerations that come "
                         "with speed. Loops come apart a little in motion; shorter steps "
                         "(timestep, and solref with it) make it less.",
                         1.0 - kHardest)});
}

Mjcf MakeMjcf(const Model& model, const MjcfOptions& options) {
  std::vector<std::string> missing = MissingInMjcf(model);
  if (!missing.empty()) throw NotThere(std::move(missing));
  return MjcfWriter(model, options).Write();
}

}  // namespace loopbench::exchange
