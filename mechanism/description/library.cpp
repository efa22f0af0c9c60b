#include "mechanism/description/library.h"

#include <cmath>
#include <numbers>
#include <optional>

namespace loopbench {

BodyDescription Bar(const std::string& name, double length, double mass, double inertia) {
  BodyDescription bar;
  bar.name = name;
  bar.mass = mass;
  bar.com = {length / 2, 0.0, 0.0};
  bar.inertia = inertia * Eigen::Matrix3d::Identity();
  bar.points = {{"A", {0.0, 0.0, 0.0}}, {"B", {length, 0.0, 0.0}}};
  return bar;
}

JointDescription Revolute(const std::string& name, int from, const Eigen::Vector3d& at_from, int to,
                          const Eigen::Vector3d& at_to) {
  JointDescription joint;
  joint.name = name;
  joint.type = JointType::kRevolute;
  joint.from = {from, at_from, Eigen::Vector3d::Zero()};
  joint.to = {to, at_to, Eigen::Vector3d::Zero()};
  return joint;
}

namespace {

Eigen::Vector3d Origin() { return Eigen::Vector3d::Zero(); }
Eigen::Vector3d Tip() { return Eigen::Vector3d::UnitX(); }

MechanismDescription Named(const std::string& name) {
  MechanismDescription mechanism;
  mechanism.name = name;
  mechanism.gravity = {0.0, -9.81, 0.0};
  return mechanism;
}

/// Adds a slender bar of 1 m and 1 kg, and returns its index.
int AddBar(const std::string& name, MechanismDescription& mechanism) {
  mechanism.bodies.push_back(Bar(name, 1.0, 1.0, 1.0 / 12.0));
  return static_cast<int>(mechanism.bodies.size()) - 1;
}

/// Adds a joint with its initial coordinate and, if given, speed.
void AddJoint(const JointDescription& joint, double q, std::optional<double> u,
              MechanismDescription& mechanism) {
  const int index = static_cast<int>(mechanism.joints.size());
  mechanism.joints.push_back(joint);
  mechanism.initial.coordinates.push_back({index, {q}});
  if (u) mechanism.initial.speeds.push_back({index, {*u}});
}

}  // namespace

MechanismDescription Chain(int num_bars) {
  const int n = num_bars;
  MechanismDescription chain = Named("chain-" + std::to_string(n));
  // The bars and the ground are the sides of a regular polygon with n + 1 corners, below y = 0.
  const double turn = 2.0 * std::numbers::pi / (n + 1);
  for (int i = 1; i <= n; ++i) {
    chain.bodies.push_back(Bar("bar" + std::to_string(i), 1.0, 1.0, 1.0));
    AddJoint(Revolute("J" + std::to_string(i), i - 1, i == 1 ? Origin() : Tip(), i, Origin()),
             i == 1 ? -std::numbers::pi + turn : turn, std::nullopt, chain);
  }
  chain.joints.push_back(Revolute("J" + std::to_string(n + 1), n, Tip(), kGround, Tip()));
  return chain;
}

MechanismDescription Arm(int num_bars, bool closed) {
  const int n = num_bars;
  const double turn = 2.0 * std::numbers::pi / (n + 1);
  MechanismDescription arm = Named((closed ? "ring-" : "arm-") + std::to_string(n));
  arm.space = SpaceKind::kSpatial;
  // a joint at the start of side k, whose frames are turned to it from side k - 1
  const auto add = [&](int k, int from, int to, double turned) {
    const double roll = 2.4 * k;
    arm.joints.push_back(Revolute("J" + std::to_string(k), from, k == 1 ? Origin() : Tip(), to,
                                  to == kGround ? Tip() : Origin()));
    arm.joints.back().from.rotation = {0.0, 0.0, turned};
    arm.joints.back().axis = Eigen::Vector3d(0.3, std::cos(roll), std::sin(roll)).normalized();
  };
  for (int k = 1; k <= n; ++k) {
    BodyDescription bar = Bar("bar" + std::to_string(k), 1.0, 1.0, 0.31);
    bar.inertia = Eigen::Vector3d(0.02, 0.3, 0.31).asDiagonal();
    arm.bodies.push_back(std::move(bar));
    add(k, k - 1, k, k == 1 ? turn - std::numbers::pi : turn);
  }
  // Ground's own axes: a whole turn and a half, less the n turns so far
  if (closed) add(n + 1, n, kGround, std::numbers::pi - n * turn);
  return arm;
}

MechanismDescription Ladder(int num_windows, double angle, double speed) {
  MechanismDescription ladder = Named("ladder-" + std::to_string(num_windows));
  // bodies: crank 0, then per window a coupler and the next crank
  for (int i = 0; i <= num_windows; ++i) {
    const std::string number = std::to_string(i);
    if (i > 0) {
      const int coupler = AddBar("coupler" + number, ladder);
      AddJoint(Revolute("C" + number, coupler - 1, Tip(), coupler, Origin()), -angle, -speed,
               ladder);
    }
    const int crank = AddBar("crank" + number, ladder);
    AddJoint(Revolute("O" + number, kGround, Eigen::Vector3d(i, 0.0, 0.0), crank, Origin()), angle,
             speed, ladder);
  }
  for (int i = 1; i <= num_windows; ++i) {
    const int coupler = 2 * i, crank = 2 * i + 1;
    ladder.joints.push_back(Revolute("T" + std::to_string(i), coupler, Tip(), crank, Tip()));
  }
  return ladder;
}

MechanismDescription Grid(int num_storeys, int num_windows, double angle, double speed) {
  MechanismDescription grid =
      Named("grid-" + std::to_string(num_storeys) + "x" + std::to_string(num_windows));
  const auto add = [&](const std::string& kind, int storey, int column, int from,
                       const Eigen::Vector3d& at, double q, double u) {
    const std::string name = kind + std::to_string(storey) + "." + std::to_string(column);
    const int body = AddBar(name, grid);
    AddJoint(Revolute("J" + name, from, at, body, Origin()), q, u, grid);
    return body;
  };
  std::vector<JointDescription> closing;
  std::vector<int> above(num_windows + 1, kGround);
  for (int r = 1; r <= num_storeys; ++r) {
    const double turned = angle + 0.1 * (r - 1), turning = r * speed;
    const double q = r == 1 ? angle : 0.1, u = speed;
    int coupler = kGround;
    for (int c = 0; c <= num_windows; ++c) {
      const Eigen::Vector3d at = r == 1 ? Eigen::Vector3d(c, 0.0, 0.0) : Tip();
      const int crank = add("crank", r, c, above[c], at, q, u);
      if (c > 0) {
        closing.push_back(Revolute("T" + std::to_string(crank), coupler, Tip(), crank, Tip()));
      }
      if (c < num_windows) coupler = add("coupler", r, c + 1, crank, Tip(), -turned, -turning);
      above[c] = crank;
    }
  }
  grid.joints.insert(grid.joints.end(), closing.begin(), closing.end());
  return grid;
}

MechanismDescription Tree(int num_bars, double speed) {
  constexpr double kBend = 0.4;
  MechanismDescription tree = Named("tree-" + std::to_string(num_bars));
  for (int i = 1; i <= num_bars; ++i) {
    AddBar("bar" + std::to_string(i), tree);
    const double bend = i == 1 ? -0.5 * std::numbers::pi : i % 2 == 0 ? kBend : -kBend;
    AddJoint(Revolute("J" + std::to_string(i), i / 2, i == 1 ? Origin() : Tip(), i, Origin()), bend,
             speed, tree);
  }
  return tree;
}

MechanismDescription Hub(int num_arms, int num_bars, bool closed) {
  constexpr double kFirstBend = 0.3, kBend = 0.8;  // an arm is never stretched out
  MechanismDescription hub =
      Named("hub-" + std::to_string(num_arms) + "x" + std::to_string(num_bars));
  BodyDescription disc;
  disc.name = "disc";
  disc.mass = 1.0;
  disc.inertia = 0.5 * Eigen::Matrix3d::Identity();
  hub.bodies.push_back(disc);
  AddJoint(Revolute("O", kGround, Origin(), 1, Origin()), 0.0, std::nullopt, hub);
  std::vector<JointDescription> closing;
  for (int arm = 1; arm <= num_arms; ++arm) {
    const double around = 2.0 * std::numbers::pi * (arm - 1) / num_arms;
    const Eigen::Vector3d rim(std::cos(around), std::sin(around), 0.0);
    Eigen::Vector3d end = rim;
    double turned = around;
    int body = 1;
    for (int i = 1; i <= num_bars; ++i) {
      const std::string place = std::to_string(arm) + "." + std::to_string(i);
      const int before = body;
      body = AddBar("bar" + place, hub);
      turned += i == 1 ? kFirstBend : kBend;
      AddJoint(Revolute("J" + place, before, i == 1 ? rim : Tip(), body, Origin()),
               i == 1 ? turned : kBend, std::nullopt, hub);
      end += Eigen::Vector3d(std::cos(turned), std::sin(turned), 0.0);
    }
    if (closed) closing.push_back(Revolute("T" + std::to_string(arm), kGround, end, body, Tip()));
  }
  hub.joints.insert(hub.joints.end(), closing.begin(), closing.end());
  return hub;
}

}  // namespace loopbench
