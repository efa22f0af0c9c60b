#include "harness/exchange/export_mjcf.h"

#include <Eigen/Geometry>
#include <cmath>

#include "harness/base/text.h"
#include "harness/exchange/export_names.h"
#include "mechanism/algebra/space.h"
#include "mechanism/description/joint_frames.h"

namespace loopbench::exchange {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// MuJoCo's mjMAXIMP.
constexpr double kHardest = 0.9999;
/// MuJoCo rejects smaller masses and moments of moving bodies (its mjMINVAL).
constexpr double kMinMass = 1e-15;
/// MuJoCo's parser rejects deeper documents.
constexpr int kMaxNested = 90;

/// Return frames or points of the model relative to the user's origin of their body.
Vector3d FromOrigin(const Model& model, int body, const Vec& at) {
  return ToEigen(model.bodies[body].com) + ToEigen(at);
}
loopbench::Frame FromOrigin(const Model& model, int body, const Frame& frame) {
  return {ToEigen(frame.R), FromOrigin(model, body, frame.p)};
}

/// Returns w, x, y, z.
std::array<double, 4> QuaternionOf(const Matrix3d& R) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(R).normalized();
  return {q.w(), q.x(), q.y(), q.z()};
}

// Tree joints as chains of MuJoCo joints of one body.

struct PartKind {
  char kind;       ///< 's' slide, 'h' hinge, 'b' ball
  int axis;        ///< x, y, z
  int coordinate;  ///< index in the joint; first one for a ball
};

/// A part about or along an axis of the moved body.
struct MjcfPart : PartKind {
  Vector3d direction;  ///< in body axes in the initial pose
  Vector3d at;         ///< a point of the axis, from the body's origin
  double value = 0.0;  ///< MuJoCo's coordinate in the initial pose; 0 for a ball
};

struct MjcfChain {
  loopbench::Frame pose;                 ///< body in its parent, both from their origins
  std::vector<MjcfPart> parts;           ///< in MuJoCo's order
  Matrix3d turn = Matrix3d::Identity();  ///< ball: rotation from its fixed frame
  Matrix3d axes = Matrix3d::Identity();  ///< moved joint frame, in body axes
};

/// Returns the parts of a tree joint, from F to M, each in axes moved by those before; or null.
const std::vector<PartKind>* PartsOf(const Joint& joint) {
  static const std::map<std::string, std::vector<PartKind>> kParts = {
      {"weld", {}},
      {"revolute", {{'h', 2, 0}}},
      {"prismatic", {{'s', 0, 0}}},
      {"cylindrical", {{'h', 2, 0}, {'s', 2, 1}}},
      {"pin-in-slot", {{'s', 0, 1}, {'h', 2, 0}}},
      {"universal", {{'h', 0, 0}, {'h', 1, 1}}},
      {"spherical", {{'b', 0, 0}}},
      {"planar", {{'s', 0, 1}, {'s', 1, 2}, {'h', 2, 0}}},
      {"free", {{'s', 0, 4}, {'s', 1, 5}, {'s', 2, 6}, {'b', 0, 0}}},
      {"translation", {{'s', 0, 0}, {'s', 1, 1}, {'s', 2, 2}}},
      {"schoenflies", {{'s', 0, 1}, {'s', 1, 2}, {'s', 2, 3}, {'h', 2, 0}}},
      {"point-on-line", {{'s', 0, 4}, {'b', 0, 0}}},
      {"point-in-plane", {{'s', 0, 4}, {'s', 1, 5}, {'b', 0, 0}}}};
  const bool in_plane = joint.kind == "free" && joint.coordinates.size() == 3;
  const auto found = kParts.find(in_plane ? "planar" : joint.kind);
  return found == kParts.end() ? nullptr : &found->second;
}

/// Returns the motion of one part for these coordinates of its joint.
loopbench::Frame Motion(const PartKind& part, const double* q, double sign) {
  loopbench::Frame X;
  if (part.kind == 's') X.p[part.axis] = sign * q[part.coordinate];
  if (part.kind == 'h') {
    X.R = Eigen::AngleAxisd(sign * q[part.coordinate], Vector3d::Unit(part.axis)).matrix();
  }
  if (part.kind == 'b') {
    X.R = Eigen::Quaterniond(q[0], sign * q[1], sign * q[2], sign * q[3])
              .normalized()
              .toRotationMatrix();
  }
  return X;
}

/// Returns the chain of a tree joint at Model::q. A reversed joint has its parts in reverse order
/// with opposite coordinates.
MjcfChain ChainOf(const Model& model, const Joint& joint) {
  const double sign = joint.from_is_child ? -1.0 : 1.0;
  const double* q = model.q.data() + joint.q;
  const auto X_PF = FromOrigin(model, joint.from, joint.F);
  const auto X_QM = FromOrigin(model, joint.to, joint.M);
  const loopbench::Frame& on_child = joint.from_is_child ? X_PF : X_QM;
  MjcfChain chain;
  chain.axes = on_child.R;
  for (const PartKind& kind : *PartsOf(joint)) chain.parts.push_back({kind, {}, {}});
  if (joint.from_is_child) std::ranges::reverse(chain.parts);
  loopbench::Frame moved;  // frame on the child, relative to the frame after a part
  for (auto part = chain.parts.rbegin(); part != chain.parts.rend(); ++part) {
    // frame after the part, relative to the child
    const loopbench::Frame behind = on_child * moved.Inverse();
    part->direction = behind.R * Vector3d::Unit(part->axis);
    part->at = behind.p;
    const loopbench::Frame motion = Motion(*part, q, sign);
    if (part->kind == 'b') {
      chain.turn = motion.R;
    } else {
      part->value = sign * q[part->coordinate];
    }
    moved = motion * moved;
  }
  chain.pose = (joint.from_is_child ? X_QM : X_PF) * moved * on_child.Inverse();
  return chain;
}

/// Returns all parts of the model that MJCF does not have.
std::vector<std::string> MissingInMjcf(const Model& model) {
  std::vector<std::string> missing = model.missing;
  std::vector<int> depth(model.bodies.size(), 0);
  for (const Joint& joint : model.tree) {
    if (PartsOf(joint) == nullptr) missing.push_back(ShownKind(joint));
    const int child = joint.child();
    depth[child] = depth[joint.parent()] + 1;
    if (depth[child] == kMaxNested + 1) {
      missing.push_back(fmt::format("body \"{}\": more than {} bodies between it and Ground",
                                    model.bodies[child].name, kMaxNested - 1));
    }
  }
  for (const Joint& joint : model.cut) {
    const auto kinds = {"revolute", "weld", "spherical", "rod", "free"};
    if (std::ranges::find(kinds, joint.kind) == kinds.end()) {
      missing.push_back(ShownKind(joint) + ", which closes a loop");
    }
  }
  for (std::size_t i = 1; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const std::string fault = FaultOfInertia(body, model.planar);
    if (!fault.empty()) missing.push_back(fault);
    const Vector3d moments = PrincipalInertiaOf(body, model.planar).moments;
    const double least = std::min(body.mass, moments.minCoeff());
    if (least >= kMinMass) continue;
    missing.push_back(fmt::format(
        "body \"{}\": a mass [kg] or moment of inertia [kg m^2] of {:.3g}, below {:.0e}", body.name,
        least, kMinMass));
  }
  return missing;
}

/// Returns ` name="1.0 2.0"`.
template <class Range>
std::string Attribute(const char* name, const Range& values) {
  return fmt::format(" {}=\"{}\"", name, harness::Joined(values, " ", NumberText));
}
std::string Attribute(const char* name, double value) {
  return Attribute(name, std::array<double, 1>{value});
}
/// Returns the attribute of a name.
std::string Named(const char* attribute, const std::string& name) {
  return fmt::format(" {}=\"{}\"", attribute, EscapeXmlAttribute(name));
}
/// Returns attributes of an actuator with a constant force, independent of its control.
std::string Constant(double force) {
  return R"( gaintype="fixed" gainprm="0.0" biastype="affine")" +
         Attribute("biasprm", std::array{force, 0.0, 0.0});
}

// Shapes for MuJoCo's viewer, without mass and contact.

/// Returns `geom` elements by body: bars from its first joint to the others, or to its centre of
/// mass if it has one joint; a ball if there is no bar.
std::vector<std::vector<std::string>> ShapesOf(const Model& model) {
  // joint positions on each body from its origin, then its centre of mass
  std::vector<std::vector<Vector3d>> places(model.bodies.size());
  const auto add = [&](int body, const Vec& at) {
    places[body].push_back(FromOrigin(model, body, at));
  };
  for (const std::vector<Joint>* joints : {&model.tree, &model.cut}) {
    for (const Joint& joint : *joints) {
      add(joint.from, joint.F.p);
      add(joint.to, joint.M.p);
    }
  }
  for (std::size_t b = 0; b < model.bodies.size(); ++b) add(static_cast<int>(b), {});
  double size = 0.0;  // size of the largest body
  for (std::size_t b = 1; b < places.size(); ++b) {
    for (const Vector3d& at : places[b]) size = std::max(size, (at - places[b].front()).norm());
  }
  const double radius = size > 0.0 ? 0.02 * size : 0.05;
  std::vector<std::vector<std::string>> shapes(places.size());
  for (std::size_t b = 1; b < places.size(); ++b) {
    const Vector3d& first = places[b].front();
    // with several joints the centre of mass is not part of the body's outline
    const std::size_t ends = std::max<std::size_t>(2, places[b].size() - 1);
    for (std::size_t i = 1; i < std::min(ends, places[b].size()); ++i) {
      const Vector3d& end = places[b][i];
      if (!((end - first).norm() > radius)) continue;
      const std::array both = {first[0], first[1], first[2], end[0], end[1], end[2]};
      shapes[b].push_back("<geom type=\"capsule\"" + Attribute("fromto", both) +
                          Attribute("size", radius) + "/>\n");
    }
    if (!shapes[b].empty()) continue;
    shapes[b].push_back("<geom type=\"sphere\"" + Attribute("pos", ToVec(places[b].back())) +
                        Attribute("size", 2.0 * radius) + "/>\n");
  }
  return shapes;
}

std::string Section(const char* name, const std::string& elements) {
  return elements.empty() ? "" : fmt::format("  <{}>\n{}  </{}>\n", name, elements, name);
}

class MjcfWriter {
 public:
  MjcfWriter(const Model& model, double time_step, bool shapes)
      : model_(model),
        time_step_(time_step),
        has_shapes_(shapes),
        children_(model.bodies.size()),
        contents_(model.bodies.size()) {
    if (shapes) contents_ = ShapesOf(model);
    for (int i = 0; i < std::ssize(model.tree); ++i) {
      children_[model.tree[i].parent()].push_back(i);
    }
  }

  Mjcf Write() {
    UniqueNames names({"world"});
    body_names_.push_back("world");
    for (std::size_t i = 1; i < model_.bodies.size(); ++i) {
      const std::string& given = model_.bodies[i].name;
      body_names_.push_back(Renamed("body", given, names.Take(XmlText(given))));
    }
    AddPoints();
    for (const Joint& joint : model_.cut) AddClosures(joint);
    for (const SpringDamper& force : model_.spring_dampers) AddSpringDamper(force);
    for (const PointForce& force : model_.point_forces) AddPointForce(force);
    std::string bodies, world;
    for (const int index : children_[0]) AddBody(index, 2, bodies);
    for (const Coupling& coupling : model_.couplings) AddCoupling(coupling);
    for (const std::string& site : contents_[0]) world += "    " + site;
    const std::string closures = Attribute("solref", std::array{2.0 * time_step_, 1.0}) +
                                 Attribute("solimp", std::array{kHardest, kHardest, 1e-3});
    const std::string shapes =
        has_shapes_ ? "    <geom contype=\"0\" conaffinity=\"0\" rgba=\"0.55 0.6 0.7 1\"/>\n" : "";
    made_.document =
        "<mujoco" + Named("model", Renamed("model", model_.name, XmlText(model_.name))) +
        ">\n  <compiler angle=\"radian\" autolimits=\"false\"/>\n  <option" +
        Attribute("timestep", time_step_) + Attribute("gravity", model_.gravity) +
        " integrator=\"RK4\" solver=\"Newton\" cone=\"elliptic\" jacobian=\"auto\" "
        "tolerance=\"1e-15\">\n    <flag contact=\"disable\" warmstart=\"disable\"/>\n  "
        "</option>\n" +
        fmt::format("  <size njmax=\"{}\" nconmax=\"1\"/>\n",
                    12 * (made_.closures.size() + 1) + model_.couplings.size()) +
        Section("default", "    <equality" + closures + "/>\n" + shapes) +
        Section("worldbody", world + bodies) + Section("tendon", tendons_) +
        Section("equality", equalities_) + Section("actuator", actuators_) +
        Section("keyframe", "    <key name=\"start\"" + Attribute("qpos", qpos_) +
                                Attribute("qvel", qvel_) + "/>\n") +
        "</mujoco>\n";
    AddNotes();
    return std::move(made_);
  }

 private:
  template <class... Values>
  void AddNote(fmt::format_string<Values...> text, Values&&... values) {
    made_.notes.push_back({false, fmt::format(text, std::forward<Values>(values)...)});
  }

  /// Returns `name`, which represents the user's `given`; adds a note if they differ.
  std::string Renamed(const char* what, const std::string& given, std::string name) {
    if (name != given) AddNote("{} \"{}\" is called \"{}\".", what, given, name);
    return name;
  }

  /// Adds a site and returns its name.
  std::string AddSite(int body, const Vector3d& at, const std::string& wanted) {
    const std::string name = site_names_.Take(XmlText(wanted));
    contents_[body].push_back(
        fmt::format("<site{}{}/>\n", Named("name", name), Attribute("pos", ToVec(at))));
    return name;
  }

  void AddPoints() {
    for (int b = 0; b < std::ssize(model_.bodies); ++b) {
      const Body& body = model_.bodies[b];
      for (const auto& [point, at] : body.points) {
        const std::string wanted = body.name + "." + point;
        Renamed("point", wanted, AddSite(b, FromOrigin(model_, b, at), wanted));
      }
    }
  }

  void AddBody(int index, int depth, std::string& text) {
    const Joint& joint = model_.tree[index];
    const int child = joint.child();
    const MjcfChain chain = ChainOf(model_, joint);
    const std::string indent(2 * depth, ' '), within = indent + "  ";
    text += fmt::format("{}<body{}{}{}>\n{}", indent, Named("name", body_names_[child]),
                        Attribute("pos", ToVec(chain.pose.p)),
                        Attribute("quat", QuaternionOf(chain.pose.R)), within + Inertial(child));
    AddJoint(index, chain, within, text);
    for (const std::string& element : contents_[child]) text += within + element;
    for (const int next : children_[child]) AddBody(next, depth + 1, text);
    text += indent + "</body>\n";
  }

  std::string Inertial(int index) const {
    const Body& body = model_.bodies[index];
    const PrincipalInertia I = PrincipalInertiaOf(body, model_.planar);
    std::string text = "<inertial" + Attribute("pos", body.com);
    if (!I.axes.isIdentity(0.0)) text += Attribute("quat", QuaternionOf(I.axes));
    return text + Attribute("mass", body.mass) + Attribute("diaginertia", ToVec(I.moments)) +
           "/>\n";
  }

  void AddJoint(int index, const MjcfChain& chain, const std::string& indent, std::string& text) {
    const Joint& joint = model_.tree[index];
    const bool alone = chain.parts.size() == 1;
    std::vector<std::string> names;
    for (const MjcfPart& part : chain.parts) {
      const std::string word = part.kind == 'b' ? "turn" : joint.coordinates[part.coordinate];
      const std::string& name = names.emplace_back(
          joint_names_.Take(XmlText(alone ? joint.name : joint.name + "." + word)));
      if (alone) Renamed("joint", joint.name, name);
      const char* type = part.kind == 's' ? "slide" : part.kind == 'h' ? "hinge" : "ball";
      text += fmt::format("{}<joint{} type=\"{}\" limited=\"false\"{}", indent, Named("name", name),
                          type, Attribute("pos", ToVec(part.at)));
      if (part.kind != 'b') {
        text += Attribute("axis", ToVec(part.direction)) + Attribute("ref", part.value);
      }
      text += AddEfforts(index, name) + "/>\n";
      AddCoordinate(joint, chain, part);
    }
    if (alone) alone_[index] = names.front();
    NoteParts(joint, names);
  }

  /// Names of joints are known. MuJoCo counts coordinates from the start (`ref`), where it holds.
  void AddCoupling(const Coupling& coupling) {
    const std::string name =
        Renamed("coupling", coupling.name, closure_names_.Take(XmlText(coupling.name)));
    const auto ratio_of = [&](std::size_t i) {
      const auto& [index, ratio] = coupling.parts[i];
      return model_.tree[index].from_is_child ? -ratio : ratio;
    };
    if (coupling.parts.size() == 2) {
      const std::array polynomial = {0.0, -ratio_of(1) / ratio_of(0), 0.0, 0.0, 0.0};
      equalities_ += "    <joint" + Named("name", name) +
                     Named("joint1", alone_.at(coupling.parts[0].first)) +
                     Named("joint2", alone_.at(coupling.parts[1].first)) +
                     Attribute("polycoef", polynomial) + "/>\n";
      return;
    }
    tendons_ += "    <fixed" + Named("name", name) + " limited=\"false\">\n";
    for (std::size_t i = 0; i < coupling.parts.size(); ++i) {
      tendons_ += "      <joint" + Named("joint", alone_.at(coupling.parts[i].first)) +
                  Attribute("coef", ratio_of(i)) + "/>\n";
    }
    tendons_ += "    </fixed>\n";
    equalities_ += "    <tendon" + Named("name", name) + Named("tendon1", name) + "/>\n";
  }

  /// Returns springs and dampers of a tree joint as attributes; adds constants as actuator `name`.
  std::string AddEfforts(int index, const std::string& name) {
    // effort = constant - stiffness q - damping u, of all forces on the joint
    double constant = 0.0, stiffness = 0.0, pull = 0.0, damping = 0.0;
    for (const JointForce& force : model_.joint_forces) {
      if (force.joint != index) continue;
      constant += force.constant;
      stiffness += force.stiffness;
      pull += force.stiffness * force.rest;
      damping += force.damping;
    }
    const Joint& joint = model_.tree[index];
    const double sign = joint.from_is_child ? -1.0 : 1.0;
    if (constant != 0.0) {
      actuators_ += "    <general" + Named("joint", name) + Constant(sign * constant) + "/>\n";
      AddNote("The constant effort along joint \"{}\" is an actuator without control.", joint.name);
    }
    std::string text;
    if (stiffness != 0.0) {
      text = Attribute("stiffness", stiffness) + Attribute("springref", sign * pull / stiffness);
    }
    if (joint.rotor_inertia > 0.0) text += Attribute("armature", joint.rotor_inertia);
    return damping != 0.0 ? text + Attribute("damping", damping) : text;
  }

  void AddCoordinate(const Joint& joint, const MjcfChain& chain, const MjcfPart& part) {
    // a quaternion has one speed fewer than coordinates, at the same first index
    const int place =
        joint.num_q > joint.num_u && part.coordinate > 0 ? part.coordinate - 1 : part.coordinate;
    MjcfCoordinate& made = made_.coordinates.emplace_back();
    made.ball = part.kind == 'b';
    made.q = joint.q + part.coordinate;
    made.u = joint.u + place;
    made.sign = joint.from_is_child ? -1.0 : 1.0;
    const double* u = model_.u.data() + made.u;
    if (made.ball) {
      made.axes = ToMatrix(chain.axes);
      // MuJoCo's speeds are in axes of the moved body
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

  void NoteParts(const Joint& joint, const std::vector<std::string>& names) {
    if (names.empty()) {
      AddNote("joint \"{}\" (weld) is body \"{}\" without a joint.", joint.name,
              model_.bodies[joint.child()].name);
    }
    if (names.size() > 1) {
      AddNote("joint \"{}\" ({}) is written as joints \"{}\" of one body.", joint.name, joint.kind,
              fmt::join(names, "\", \""));
    }
    if (joint.from_is_child && !names.empty()) {
      AddNote("joint \"{}\" is seen from its second body: coordinates have the opposite sign.",
              joint.name);
    }
    if (joint.num_q > joint.num_u) {
      AddNote("joint \"{}\": the quaternion is counted from the start.", joint.name);
    }
  }

  void AddNotes() {
    if (model_.planar) AddNote(kPlaneNote);
    if (made_.closures.empty() && model_.couplings.empty()) return;
    made_.notes.push_back(
        {true,
         fmt::format("MuJoCo's closures are soft: springs and dampers with a time constant of "
                     "two steps (solref), and forces that leave a share of {:.0e} of the "
                     "acceleration unopposed (solimp), without the accelerations that come "
                     "with speed. Loops come apart a little in motion; shorter steps "
                     "(timestep, and solref with it) make it less.",
                     1.0 - kHardest)});
  }

  /// Adds coincident points of a joint: one for a pivot, more along its axes for orientations.
  void AddClosures(const Joint& joint) {
    const std::string& kind = joint.kind;
    if (kind == "free") return;
    std::vector<Vector3d> points = {Vector3d::Zero()};
    if (kind == "revolute" && !model_.planar) points.push_back(Vector3d::UnitZ());
    if (kind == "weld") points.push_back(Vector3d::UnitX());
    if (kind == "weld" && !model_.planar) points.push_back(Vector3d::UnitY());
    // distance of the pivot from its body's centre of mass, a length of the mechanism
    const Vec& p = joint.M.p;
    const double reach = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::string wanted = i == 0 ? joint.name : fmt::format("{}.{}", joint.name, i + 1);
      const std::string name = closure_names_.Take(XmlText(wanted));
      if (i == 0) Renamed("joint", joint.name, name);
      AddClosure(joint, points[i] * (reach > 0.0 ? reach : 1.0), name);
    }
    const std::string pairs = points.size() == 1
                                  ? "a pair of points is"
                                  : fmt::format("{} pairs of points are", points.size());
    AddNote("joint \"{}\" ({}) closes a loop: {} held {}.", joint.name, kind, pairs,
            kind == "rod" ? "at a distance, by a tendon" : "together");
  }

  void AddClosure(const Joint& joint, const Vector3d& at, const std::string& name) {
    const auto F = FromOrigin(model_, joint.from, joint.F);
    const auto M = FromOrigin(model_, joint.to, joint.M);
    const Vector3d first = F.p + F.R * at, second = M.p + M.R * at;
    MjcfClosure closure{ToVec(first), ToVec(second), -1.0};
    if (joint.kind == "rod") {
      closure.rod = joint.parameter;
      AddTendon(name, joint.from, first, joint.to, second, "");
      equalities_ += "    <tendon" + Named("name", name) + Named("tendon1", name) + "/>\n";
    } else {
      // MuJoCo requires a body other than the world first
      const bool swap = joint.from == 0;
      if (swap) std::swap(closure.at_first, closure.at_second);
      equalities_ += "    <connect" + Named("name", name) +
                     Named("body1", body_names_[swap ? joint.to : joint.from]) +
                     Named("body2", body_names_[swap ? joint.from : joint.to]) +
                     Attribute("anchor", closure.at_first) + "/>\n";
    }
    made_.closures.push_back(closure);
  }

  void AddTendon(const std::string& name, int from, const Vector3d& at_from, int to,
                 const Vector3d& at_to, const std::string& attributes) {
    const std::string first = AddSite(from, at_from, name + ".from");
    const std::string second = AddSite(to, at_to, name + ".to");
    tendons_ += fmt::format(
        "    <spatial{} limited=\"false\"{}>\n      <site{}/>\n      <site{}/>\n    </spatial>\n",
        Named("name", name), attributes, Named("site", first), Named("site", second));
  }

  void AddSpringDamper(const SpringDamper& force) {
    const auto number = &force - model_.spring_dampers.data() + 1;
    const std::string name = closure_names_.Take(fmt::format("spring_damper {}", number));
    const auto &from = force.from, &to = force.to;
    AddTendon(name, from.body, FromOrigin(model_, from.body, from.at), to.body,
              FromOrigin(model_, to.body, to.at),
              Attribute("stiffness", force.stiffness) + Attribute("damping", force.damping) +
                  Attribute("springlength", force.length));
    if (force.preload == 0.0) return;
    // positive tension shortens
    actuators_ += "    <general" + Named("tendon", name) + Constant(-force.preload) + "/>\n";
    AddNote("The preload of {} is an actuator without control.", name);
  }

  void AddPointForce(const PointForce& force) {
    const int body = force.point.body;
    const std::string name = fmt::format("point_force {}", &force - model_.point_forces.data() + 1);
    std::string sites =
        Named("site", AddSite(body, FromOrigin(model_, body, force.point.at), name));
    if (!force.in_body_axes) {
      sites += Named("refsite", AddSite(0, Vector3d::Zero(), name + ".axes"));
    }
    const Vec& F = force.force;
    actuators_ += "    <general" + sites +
                  Attribute("gear", std::array{F[0], F[1], F[2], 0.0, 0.0, 0.0}) + Constant(1.0) +
                  "/>\n";
    AddNote("{} on body \"{}\" is an actuator without control.", name, model_.bodies[body].name);
  }

  const Model& model_;
  const double time_step_;
  const bool has_shapes_;
  std::vector<std::vector<int>> children_;          ///< tree joints below each body
  std::vector<std::vector<std::string>> contents_;  ///< shapes, then sites, by body
  std::vector<std::string> body_names_;
  std::map<int, std::string> alone_;  ///< MuJoCo joint of a tree joint with one coordinate
  UniqueNames site_names_, joint_names_, closure_names_;
  std::string tendons_, equalities_, actuators_;
  std::vector<double> qpos_, qvel_;
  Mjcf made_;
};

}  // namespace

Mjcf MakeMjcf(const Model& model, double time_step, bool shapes) {
  std::vector<std::string> missing = MissingInMjcf(model);
  if (!missing.empty()) throw Unsupported(std::move(missing));
  return MjcfWriter(model, time_step, shapes).Write();
}

}  // namespace loopbench::exchange
