// Layout of an AssemblySweep: slots of handles, zeta and joins in its lists, and their constants.
#include <algorithm>

#include "mechanism/loops/loop_solver.h"
#include "odca/assembly_sweep.h"
#include "odca/path_links.h"

namespace loopbench::odca::pins {

namespace {

/// A pin of the tree on Ground: a property of its body.
bool HoldsBody(const Joint<Planar, double>& joint) {
  return joint.in_tree() && (joint.from == kGround || joint.to == kGround);
}

/// Returns the arm from a body's centre of mass, or from Ground's origin, to one of its joints.
Vector2<double> ArmOf(const Joint<Planar, double>& joint, bool at_Q) {
  const Linear<Planar, double>& p = at_Q ? joint.X_QM.p : joint.X_PF.p;
  return {p[0], p[1]};
}

}  // namespace

struct AssemblySweep::Layout {
  /// A body or an assembly during the layout of joins.
  struct Assembly {
    int handles = 0, first_block = 0, bodies = 1;
    bool held = false;      ///< by Ground
    std::vector<int> pins;  ///< of each handle the joint, twice its index, and one more at its Q
  };

  AssemblySweep& sweep;
  const Mechanism<Planar, double>& mechanism;
  const Plan& plan;
  std::vector<int> handle_of = std::vector<int>(2 * mechanism.joints().size(), -1);  ///< as pins
  std::vector<int> cut_of = std::vector<int>(mechanism.joints().size(), -1);
  std::vector<Assembly> assemblies = std::vector<Assembly>(plan.num_nodes());
  double most_work = static_cast<double>(plan.operations());
  int handles = 0;
  double blocks = 0.0, W = 0.0, most_U = 0.0, work = 0.0, vectors = 0.0;

  /// Returns false if the general pass is less work, or places exceed an int.
  bool Fits() const { return work + vectors <= most_work && blocks < 5e8 && W < 5e8; }
  bool AddBodies();
  bool AddBody(int index, const std::vector<int>& joints);
  void AddSteps();
  bool AddNodes();
  bool AddNode(const PlanNode& planned, Assembly& all);
  Pin MakePin(const PlanNode& planned, const NodeJoint& closed) const;
  void Keep(const PlanNode& planned, Node& node, Assembly& all);
  void SetLimits(const PlanNode& planned, std::span<const int> joints, int bodies);
  void Count(const Node& node);
  void Resize();
};

bool AssemblySweep::Layout::AddBodies() {
  std::vector<std::vector<int>> joints_of_body(mechanism.num_bodies());
  for (int j = 0; j < static_cast<int>(mechanism.joints().size()); ++j) {
    const Joint<Planar, double>& joint = mechanism.joints()[j];
    joints_of_body[joint.from].push_back(2 * j);
    joints_of_body[joint.to].push_back(2 * j + 1);
  }
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    if (!AddBody(body, joints_of_body[body])) return false;
  }
  return true;
}

bool AssemblySweep::Layout::AddBody(int index, const std::vector<int>& joints) {
  const auto joint = [&](int side) -> const Joint<Planar, double>& {
    return mechanism.joints()[side / 2];
  };
  Body body;
  Assembly& assembly = assemblies[index - 1];
  Vector origin = {0.0, 0.0};
  const auto held = std::ranges::find_if(joints, [&](int side) { return HoldsBody(joint(side)); });
  assembly.held = held != joints.end();
  if (assembly.held) {
    origin = ArmOf(joint(*held), *held % 2 == 1);
    body.stand = ArmOf(joint(*held), *held % 2 == 0);
    body.centre = -origin;
  }
  body.link = MeasureLink(mechanism.bodies()[index], mechanism.gravity(),
                          assembly.held ? &origin : nullptr);
  body.first_handle = handles;
  body.first_block = static_cast<int>(blocks);
  for (const int side : joints) {
    if (HoldsBody(joint(side))) continue;
    handle_of[side] = handles++;
    assembly.pins.push_back(side);
    sweep.handles_.push_back(
        Scaled(1.0 / body.link.radius, ArmOf(joint(side), side % 2 == 1) - origin));
  }
  body.handles = assembly.handles = handles - body.first_handle;
  assembly.first_block = body.first_block;
  blocks += static_cast<double>(body.handles) * body.handles;
  work += 4.0 * body.handles * body.handles;
  sweep.bodies_.push_back(body);
  return Fits();
}

void AssemblySweep::Layout::AddSteps() {
  for (const TreeStep& step : mechanism.tree()) {
    if (step.parent == kGround) continue;
    const int parent_side = mechanism.joints()[step.joint].from == step.parent ? 0 : 1;
    sweep.steps_.push_back({.parent = step.parent - 1,
                            .child = step.child - 1,
                            .parent_handle = handle_of[2 * step.joint + parent_side],
                            .child_handle = handle_of[2 * step.joint + 1 - parent_side]});
  }
  for (const int j : mechanism.constraints()) {
    const Joint<Planar, double>& joint = mechanism.joints()[j];
    cut_of[j] = static_cast<int>(sweep.cuts_.size());
    sweep.cuts_.push_back({.P = handle_of[2 * j],
                           .Q = handle_of[2 * j + 1],
                           .body_P = joint.from - 1,
                           .body_Q = joint.to - 1,
                           .ground = ArmOf(joint, joint.to == kGround)});
  }
}

AssemblySweep::Pin AssemblySweep::Layout::MakePin(const PlanNode& planned,
                                                  const NodeJoint& closed) const {
  const auto side = [&](int handle, int pin) {
    if (handle < 0) return Side{};
    const int child = planned.handles[handle].child;
    const Assembly& assembly = assemblies[planned.children[child]];
    const auto place = std::ranges::find(assembly.pins, pin) - assembly.pins.begin();
    return Side{child, static_cast<int>(place), handle_of[pin]};
  };
  return {side(closed.from, 2 * closed.index), side(closed.to, 2 * closed.index + 1),
          cut_of[closed.index]};
}

/// Keeps the remaining handles, the first child's first.
void AssemblySweep::Layout::Keep(const PlanNode& planned, Node& node, Assembly& all) {
  const auto closes = [&](int pin) {
    return std::ranges::find(planned.joints, pin / 2, &NodeJoint::index) != planned.joints.end();
  };
  all.bodies = 0;
  for (const int c : {0, 1}) {
    if (planned.children[c] < 0) continue;
    const Assembly& child = assemblies[planned.children[c]];
    all.bodies += child.bodies;
    all.held = all.held || child.held;
    node.blocks[c] = child.first_block;
    node.handles[c] = child.handles;
    for (int place = 0; place < child.handles; ++place) {
      if (closes(child.pins[place])) continue;
      all.pins.push_back(child.pins[place]);
      sweep.kept_.push_back({c, place, handle_of[child.pins[place]]});
    }
  }
  const auto on_ground = [](const Pin& pin) { return pin.P.place < 0 || pin.Q.place < 0; };
  all.held =
      all.held || std::any_of(sweep.pins_.begin() + node.first_pin, sweep.pins_.end(), on_ground);
  node.kept = all.handles = static_cast<int>(all.pins.size());
}

/// Multiply-adds and room of a join.
void AssemblySweep::Layout::Count(const Node& node) {
  const double n = 2.0 * node.pins, d = 2.0 * node.kept;
  blocks += static_cast<double>(node.kept) * node.kept;
  work += n * n * n / 6.0 + n * n * d / 2.0 + n * d * d / 2.0;
  vectors += 2.0 * n * (n + d);
  W += n * (node.pins > 1 ? n + d : d);
  most_U = std::max(most_U, n * (n + d));
}

/// A pin closes a loop if Ground holds both its sides, both are on one assembly, or the join has
/// several pins. The lighter side determines the response of one pin, all `bodies` of several.
void AssemblySweep::Layout::SetLimits(const PlanNode& planned, std::span<const int> joints,
                                      int bodies) {
  const Assembly& one = assemblies[planned.children[0]];
  Pin* pin = &sweep.pins_.back() + 1 - joints.size();
  const bool on_ground = pin->P.place < 0 || pin->Q.place < 0;
  bool closes = on_ground ? one.held : true;
  int lighter = one.bodies;
  if (planned.children[1] >= 0) {
    const Assembly& other = assemblies[planned.children[1]];
    closes = one.held && other.held;
    lighter = std::min(lighter, other.bodies);
  }
  const bool several = joints.size() > 1;
  if (!closes && !several) return;
  const double share = ShareOfLimit(several ? bodies : lighter);
  for (const int joint : joints) (pin++)->limit = share * LimitOf(mechanism, joint);
}

bool AssemblySweep::Layout::AddNode(const PlanNode& planned, Assembly& all) {
  Node node;
  node.first_pin = static_cast<int>(sweep.pins_.size());
  node.first_kept = static_cast<int>(sweep.kept_.size());
  std::vector<int> joints;
  for (const NodeJoint& closed : planned.joints) {
    if (HoldsBody(mechanism.joints()[closed.index])) continue;
    sweep.pins_.push_back(MakePin(planned, closed));
    joints.push_back(closed.index);
  }
  node.pins = static_cast<int>(joints.size());
  if (node.pins == 0) {  // a body already held by Ground
    all = std::move(assemblies[planned.children[0]]);
    return true;
  }
  Keep(planned, node, all);
  node.first_block = all.first_block = static_cast<int>(blocks);
  node.matrix = static_cast<int>(W);
  SetLimits(planned, joints, all.bodies);
  Count(node);
  sweep.nodes_.push_back(node);
  return Fits();
}

bool AssemblySweep::Layout::AddNodes() {
  for (int n = 0; n < plan.num_leaves(); ++n) {
    const PlanSide& hold = plan.leaves()[n].hold;
    if (hold.joint < 0 || HoldsBody(mechanism.joints()[hold.joint])) continue;
    const Handle leaf{.body = n + 1};
    const NodeJoint closed{
        .index = hold.joint, .from = hold.at_Q ? -1 : 0, .to = hold.at_Q ? 0 : -1};
    PlanNode node;
    node.children[0] = n;
    node.handles = std::span(&leaf, 1);
    node.joints = std::span(&closed, 1);
    Assembly all;
    if (!AddNode(node, all)) return false;
    assemblies[n] = std::move(all);
  }
  for (int n = plan.num_leaves(); n < plan.num_nodes(); ++n) {
    if (!AddNode(plan.nodes()[n - plan.num_leaves()], assemblies[n])) return false;
  }
  return true;
}

void AssemblySweep::Layout::Resize() {
  const auto places = static_cast<std::size_t>(mechanism.num_bodies() + kLanes - 1) / kLanes;
  sweep.angle_.assign(places * kLanes, 0.0);
  sweep.speed_ = sweep.alpha_ = sweep.sine_ = sweep.cosine_ = sweep.angle_;
  sweep.arm_ = sweep.handles_;
  for (const Body& body : sweep.bodies_) sweep.reference_.push_back({body.stand, {0.0, 0.0}});
  if (!mechanism.forces().empty()) {
    sweep.applied_.resize(sweep.bodies_.size());
    sweep.wrenches_.resize(mechanism.num_bodies());
  }
  sweep.SetSize(mechanism);
  sweep.zeta_.resize(static_cast<std::size_t>(blocks));
  sweep.W_.resize(static_cast<std::size_t>(W));
  sweep.U_.resize(static_cast<std::size_t>(most_U));
  sweep.factors_.resize(sweep.pins_.size());
  sweep.s_.assign(2 * sweep.pins_.size(), 0.0);
  sweep.b_.assign(sweep.handles_.size(), {0.0, 0.0});
  sweep.F_ = sweep.b_;
  sweep.of_matrices_ = static_cast<long>(work);
  sweep.of_vectors_ = static_cast<long>(vectors + 8.0 * static_cast<double>(sweep.handles_.size()));
}

std::unique_ptr<AssemblySweep> AssemblySweep::Make(const Mechanism<Planar, double>& mechanism,
                                                   const Plan& plan) {
  if (!HasOnlyPins(mechanism)) return nullptr;
  std::unique_ptr<AssemblySweep> sweep(new AssemblySweep);
  Layout layout{*sweep, mechanism, plan};
  if (!layout.AddBodies()) return nullptr;
  layout.AddSteps();
  if (!layout.AddNodes()) return nullptr;
  layout.Resize();
  std::vector<int> place_of(mechanism.num_bodies(), mechanism.num_bodies() - 1);
  for (int body = 1; body < mechanism.num_bodies(); ++body) place_of[body] = body - 1;
  sweep->tree_ =
      TreeAngles<double>(mechanism, place_of, std::vector<double>(mechanism.num_bodies(), 0.0));
  return sweep;
}

}  // namespace loopbench::odca::pins
