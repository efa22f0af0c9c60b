#include "peers/mujoco/mujoco_model.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "peers/mujoco/frames.h"

namespace loopbench::peers {
namespace {

/// A part of a joint: slide or hinge along or about an axis of the frame that it moves, or a ball.
struct Part {
  char kind;       ///< 's', 'h', 'b'
  int axis = 0;    ///< x, y, z
  int coordinate;  ///< the joint's
};

/// What a joint of this kind is made of, from F to M, each part in the axes that those before it
/// have moved.
std::vector<Part> PartsOf(const Joint& joint) {
  const std::string& kind = joint.kind;
  if (kind == "weld") return {};
  if (kind == "revolute") return {{'h', 2, 0}};
  if (kind == "prismatic") return {{'s', 0, 0}};
  if (kind == "cylindrical") return {{'h', 2, 0}, {'s', 2, 1}};
  if (kind == "pin-in-slot") return {{'s', 0, 1}, {'h', 2, 0}};
  if (kind == "universal") return {{'h', 0, 0}, {'h', 1, 1}};
  if (kind == "spherical") return {{'b', 0, 0}};
  if (kind == "planar" || (kind == "free" && joint.num_q == 3)) {
    return {{'s', 0, 1}, {'s', 1, 2}, {'h', 2, 0}};
  }
  if (kind == "free") return {{'s', 0, 4}, {'s', 1, 5}, {'s', 2, 6}, {'b', 0, 0}};
  throw NotThere("joint \"" + joint.name + "\": " + kind);
}

std::string Numbers(const double* values, int count) {
  std::string text;
  for (int i = 0; i < count; ++i) {
    char number[32];
    std::snprintf(number, sizeof number, i == 0 ? "%.17g" : " %.17g", values[i]);
    text += number;
  }
  return text;
}
std::string Attribute(const char* name, const double* values, int count) {
  return std::string(" ") + name + "=\"" + Numbers(values, count) + "\"";
}
std::string Attribute(const char* name, double value) { return Attribute(name, &value, 1); }
std::string Attribute(const char* name, const Vec& v) { return Attribute(name, v.data(), 3); }

std::string BodyName(int body) { return body == 0 ? "world" : "b" + std::to_string(body); }

/// Writes the document. MuJoCo's frame of a body is the frame of its tree joint on it, so that
/// joints lie in origins and along axes.
class Writer {
 public:
  explicit Writer(const Model& model) : model_(model), frames_(model.bodies.size()) {
    children_.resize(model.bodies.size());
    sites_.resize(model.bodies.size());
    for (std::size_t i = 0; i < model.tree.size(); ++i) {
      const Joint& joint = model.tree[i];
      const int child = joint.from_is_child ? joint.from : joint.to;
      frames_[At(child)] = joint.from_is_child ? joint.F : joint.M;
      children_[At(joint.from_is_child ? joint.to : joint.from)].push_back(i);
    }
  }

  MujocoModel Write() {
    if (!model_.point_forces.empty()) throw NotThere("point_force");
    for (const Joint& joint : model_.cut) AddClosures(joint);
    AddSpringDampers();
    std::string world;
    for (const std::string& site : sites_[0]) world += site;
    for (const std::size_t index : children_[0]) AddBody(index, world);
    made_.document =
        "<mujoco>\n<compiler angle=\"radian\" autolimits=\"false\"/>\n<option integrator=\"RK4\" "
        "solver=\"Newton\" cone=\"elliptic\" jacobian=\"auto\" tolerance=\"1e-15\"" +
        Attribute("gravity", model_.gravity) +
        "><flag contact=\"disable\" warmstart=\"disable\"/></option>\n"
        "<size njmax=\"" +
        std::to_string(12 * (made_.closures.size() + 1)) + "\" nconmax=\"1\"/>\n<worldbody>\n" +
        world + "</worldbody>\n<tendon>" + tendons_ + "</tendon>\n<equality>" + equalities_ +
        "</equality>\n</mujoco>\n";
    return std::move(made_);
  }

 private:
  static std::size_t At(int index) { return static_cast<std::size_t>(index); }

  /// A point of a body from its centre of mass, in MuJoCo's frame.
  Vec PointIn(int body, const Vec& at) const { return SeenFrom(frames_[At(body)], at); }

  void AddBody(std::size_t index, std::string& text) {
    const Joint& joint = model_.tree[index];
    const int parent = joint.from_is_child ? joint.to : joint.from;
    const int child = joint.from_is_child ? joint.from : joint.to;
    const Frame pose = SeenFrom(frames_[At(parent)], joint.from_is_child ? joint.M : joint.F);
    const Matrix& R = pose.R;
    const Vec x = {R[0], R[3], R[6]}, y = {R[1], R[4], R[7]};
    const double axes[] = {x[0], x[1], x[2], y[0], y[1], y[2]};
    text += "<body name=\"" + BodyName(child) + "\"" + Attribute("pos", pose.p) +
            Attribute("xyaxes", axes, 6) + ">\n" + Inertial(child);
    AddJoint(index, text);
    for (const std::string& site : sites_[At(child)]) text += site;
    for (const std::size_t next : children_[At(child)]) AddBody(next, text);
    text += "</body>\n";
  }

  std::string Inertial(int index) const {
    const Body& body = model_.bodies[At(index)];
    const Frame& X = frames_[At(index)];
    Matrix I = body.inertia;
    // of a planar body only the moment about z says anything
    if (model_.planar) I = {I[8], 0, 0, 0, I[8], 0, 0, 0, I[8]};
    I = Product(Product(Transposed(X.R), I), X.R);
    const double full[] = {I[0], I[4], I[8], I[1], I[2], I[5]};
    return "<inertial" + Attribute("pos", PointIn(index, {0, 0, 0})) +
           Attribute("mass", body.mass) + Attribute("fullinertia", full, 6) + "/>\n";
  }

  /// Seen from the other side, a joint is its parts in the other order with opposite coordinates.
  void AddJoint(std::size_t index, std::string& text) {
    const Joint& joint = model_.tree[index];
    std::vector<Part> parts = PartsOf(joint);
    const double sign = joint.from_is_child ? -1.0 : 1.0;
    if (joint.from_is_child) std::reverse(parts.begin(), parts.end());
    // effort = constant - stiffness q - damping u, of all forces on the joint
    double constant = 0.0, stiffness = 0.0, damping = 0.0;
    for (const JointForce& force : model_.joint_forces) {
      if (At(force.joint) != index) continue;
      constant += force.constant + force.stiffness * force.rest;
      stiffness += force.stiffness;
      damping += force.damping;
    }
    for (const Part& part : parts) {
      Vec axis = {};
      axis[At(part.axis)] = 1.0;
      const char* type = part.kind == 's' ? "slide" : part.kind == 'h' ? "hinge" : "ball";
      text += std::string("<joint type=\"") + type + "\" limited=\"false\"" +
              Attribute("axis", axis) + Attribute("stiffness", stiffness) +
              Attribute("damping", damping) + "/>\n";
      // speeds of a quaternion are one fewer than its numbers and stand where they do
      const int place =
          joint.num_q > joint.num_u && part.coordinate > 0 ? part.coordinate - 1 : part.coordinate;
      made_.coordinates.push_back(
          {part.kind == 'b', joint.q + part.coordinate, joint.u + place, sign, sign * constant});
    }
  }

  /// Points that the joint holds together: one for a pivot, more along its axes for orientations.
  void AddClosures(const Joint& joint) {
    const std::string& kind = joint.kind;
    if (kind == "free") return;
    const Vec z = {0, 0, 1}, x = {1, 0, 0}, y = {0, 1, 0};
    std::vector<Vec> axes;
    if (kind == "revolute" && !model_.planar) axes = {z};
    if (kind == "weld") axes = model_.planar ? std::vector<Vec>{x} : std::vector<Vec>{x, y};
    const bool is_rod = kind == "rod";
    if (kind != "revolute" && kind != "weld" && kind != "spherical" && !is_rod) {
      throw NotThere("joint \"" + joint.name + "\": " + kind + ", which closes a loop");
    }
    AddClosure(joint, {0, 0, 0});
    // as far away as the pivot is from its body's centre of mass, a length of the mechanism
    const Vec& p = joint.M.p;
    const double reach = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    for (Vec axis : axes) {
      for (double& component : axis) component *= reach > 0.0 ? reach : 1.0;
      AddClosure(joint, axis);
    }
  }

  void AddClosure(const Joint& joint, const Vec& at) {
    MujocoClosure closure;
    closure.at_first = PointIn(joint.from, Sum(joint.F.p, Product(joint.F.R, at)));
    closure.at_second = PointIn(joint.to, Sum(joint.M.p, Product(joint.M.R, at)));
    if (joint.kind == "rod") {
      closure.rod = joint.parameter;
      equalities_ += "<tendon tendon1=\"" +
                     AddTendon(joint.from, closure.at_first, joint.to, closure.at_second, "") +
                     "\"/>\n";
    } else {
      // MuJoCo wants a body other than the world first
      const bool swap = joint.from == 0;
      if (swap) std::swap(closure.at_first, closure.at_second);
      equalities_ += "<connect body1=\"" + BodyName(swap ? joint.to : joint.from) + "\" body2=\"" +
                     BodyName(swap ? joint.from : joint.to) + "\"" +
                     Attribute("anchor", closure.at_first) + "/>\n";
    }
    made_.closures.push_back(closure);
  }

  void AddSpringDampers() {
    for (const SpringDamper& force : model_.spring_dampers) {
      // a preload is a shorter free length
      double length = force.length;
      if (force.preload != 0.0) length -= force.preload / force.stiffness;
      if (!(length >= 0.0)) throw NotThere("spring_damper whose preload no free length gives");
      AddTendon(force.from.body, PointIn(force.from.body, force.from.at), force.to.body,
                PointIn(force.to.body, force.to.at),
                Attribute("stiffness", force.stiffness) + Attribute("damping", force.damping) +
                    Attribute("springlength", length));
    }
  }

  /// Its name.
  std::string AddTendon(int from, const Vec& at_from, int to, const Vec& at_to,
                        const std::string& attributes) {
    const std::string name = "t" + std::to_string(num_tendons_++);
    const auto site = [&](int body, const Vec& at, const char* end) {
      sites_[At(body)].push_back("<site name=\"" + name + end + "\"" + Attribute("pos", at) +
                                 "/>\n");
      return "<site site=\"" + name + end + "\"/>";
    };
    tendons_ += "<spatial name=\"" + name + "\" limited=\"false\"" + attributes + ">" +
                site(from, at_from, "f") + site(to, at_to, "t") + "</spatial>\n";
    return name;
  }

  const Model& model_;
  std::vector<Frame> frames_;  ///< MuJoCo's frame of each body, from its centre of mass
  std::vector<std::vector<std::size_t>> children_;  ///< tree joints below each body
  std::vector<std::vector<std::string>> sites_;
  std::string tendons_, equalities_;
  int num_tendons_ = 0;
  MujocoModel made_;
};

}  // namespace

MujocoModel MakeMujocoModel(const Model& model) { return Writer(model).Write(); }

}  // namespace loopbench::peers
