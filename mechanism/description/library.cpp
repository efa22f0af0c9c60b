#include "mechanism/description/library.h"

#include <cmath>
#include <numbers>

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

MechanismDescription Chain(int num_bars) {
  const int n = num_bars;
  const Eigen::Vector3d tip = Eigen::Vector3d::UnitX();
  MechanismDescription chain;
  chain.name = "chain-" + std::to_string(n);
  chain.gravity = {0.0, -9.81, 0.0};
  // The bars and the ground are the sides of a regular polygon with n + 1 corners, below y = 0.
  const double turn = 2.0 * std::numbers::pi / (n + 1);
  for (int i = 1; i <= n; ++i) {
    chain.bodies.push_back(Bar("bar" + std::to_string(i), 1.0, 1.0, 1.0));
    chain.joints.push_back(Revolute("J" + std::to_string(i), i - 1, i == 1 ? 0.0 * tip : tip, i,
                                    Eigen::Vector3d::Zero()));
    const double angle = i == 1 ? -std::numbers::pi + turn : turn;
    chain.initial.coordinates.push_back({i - 1, {angle}});
  }
  chain.joints.push_back(Revolute("J" + std::to_string(n + 1), n, tip, kGround, tip));
  return chain;
}

MechanismDescription Arm(int num_bars, bool closed) {
  const int n = num_bars;
  const Eigen::Vector3d tip = Eigen::Vector3d::UnitX();
  const double turn = 2.0 * std::numbers::pi / (n + 1);
  MechanismDescription arm;
  arm.name = (closed ? "ring-" : "arm-") + std::to_string(n);
  arm.space = SpaceKind::kSpatial;
  arm.gravity = {0.0, -9.81, 0.0};
  // a joint at the start of side k, whose frames are turned to it from side k - 1
  const auto add = [&](int k, int from, int to, double turned) {
    const double roll = 2.4 * k;
    const Eigen::Vector3d start = Eigen::Vector3d::Zero();
    arm.joints.push_back(Revolute("J" + std::to_string(k), from, k == 1 ? start : tip, to,
                                  to == kGround ? tip : start));
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
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero(), tip = Eigen::Vector3d::UnitX();
  MechanismDescription ladder;
  ladder.name = "ladder-" + std::to_string(num_windows);
  ladder.gravity = {0.0, -9.81, 0.0};
  const auto add = [&](const JointDescription& joint, double q, double u) {
    const int index = static_cast<int>(ladder.joints.size());
    ladder.joints.push_back(joint);
    ladder.initial.coordinates.push_back({index, {q}});
    ladder.initial.speeds.push_back({index, {u}});
  };
  // bodies: crank 0, then per window a coupler and the next crank
  for (int i = 0; i <= num_windows; ++i) {
    const std::string number = std::to_string(i);
    if (i > 0) {
      ladder.bodies.push_back(Bar("coupler" + number, 1.0, 1.0, 1.0 / 12.0));
      const int coupler = static_cast<int>(ladder.bodies.size()) - 1;
      add(Revolute("C" + number, coupler - 1, tip, coupler, origin), -angle, -speed);
    }
    ladder.bodies.push_back(Bar("crank" + number, 1.0, 1.0, 1.0 / 12.0));
    const int crank = static_cast<int>(ladder.bodies.size()) - 1;
    add(Revolute("O" + number, kGround, Eigen::Vector3d(i, 0.0, 0.0), crank, origin), angle, speed);
  }
  for (int i = 1; i <= num_windows; ++i) {
    const int coupler = 2 * i, crank = 2 * i + 1;
    ladder.joints.push_back(Revolute("T" + std::to_string(i), coupler, tip, crank, tip));
  }
  return ladder;
}

MechanismDescription Grid(int num_storeys, int num_windows, double angle, double speed) {
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero(), tip = Eigen::Vector3d::UnitX();
  MechanismDescription grid;
  grid.name = "grid-" + std::to_string(num_storeys) + "x" + std::to_string(num_windows);
  grid.gravity = {0.0, -9.81, 0.0};
  const auto add = [&](const std::string& kind, int storey, int column, int from,
                       const Eigen::Vector3d& at, double q, double u) {
    const std::string place = std::to_string(storey) + "." + std::to_string(column);
    const int body = static_cast<int>(grid.bodies.size()), joint = body - 1;
    grid.bodies.push_back(Bar(kind + place, 1.0, 1.0, 1.0 / 12.0));
    grid.joints.push_back(Revolute("J" + kind + place, from, at, body, origin));
    grid.initial.coordinates.push_back({joint, {q}});
    grid.initial.speeds.push_back({joint, {u}});
    return body;
  };
  std::vector<JointDescription> closing;
  std::vector<int> above(num_windows + 1, kGround);
  for (int r = 1; r <= num_storeys; ++r) {
    const double turned = angle + 0.1 * (r - 1), turning = r * speed;
    const double q = r == 1 ? angle : 0.1, u = speed;
    int coupler = kGround;
    for (int c = 0; c <= num_windows; ++c) {
      const Eigen::Vector3d at = r == 1 ? Eigen::Vector3d(c, 0.0, 0.0) : tip;
      const int crank = add("crank", r, c, above[c], at, q, u);
      if (c > 0) closing.push_back(Revolute("T" + std::to_string(crank), coupler, tip, crank, tip));
      if (c < num_windows) coupler = add("coupler", r, c + 1, crank, tip, -turned, -turning);
      above[c] = crank;
    }
  }
  grid.joints.insert(grid.joints.end(), closing.begin(), closing.end());
  return grid;
}

MechanismDescription Tree(int num_bars, double speed) {
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero(), tip = Eigen::Vector3d::UnitX();
  constexpr double kBend = 0.4;
  MechanismDescription tree;
  tree.name = "tree-" + std::to_string(num_bars);
  tree.gravity = {0.0, -9.81, 0.0};
  for (int i = 1; i <= num_bars; ++i) {
    tree.bodies.push_back(Bar("bar" + std::to_string(i), 1.0, 1.0, 1.0 / 12.0));
    tree.joints.push_back(
        Revolute("J" + std::to_string(i), i / 2, i == 1 ? origin : tip, i, origin));
    const double bend = i == 1 ? -0.5 * std::numbers::pi : i % 2 == 0 ? kBend : -kBend;
    tree.initial.coordinates.push_back({i - 1, {bend}});
    tree.initial.speeds.push_back({i - 1, {speed}});
  }
  return tree;
}

MechanismDescription Hub(int num_arms, int num_bars, bool closed) {
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero(), tip = Eigen::Vector3d::UnitX();
  constexpr double kFirstBend = 0.3, kBend = 0.8;  // an arm is never stretched out
  MechanismDescription hub;
  hub.name = "hub-" + std::to_string(num_arms) + "x" + std::to_string(num_bars);
  hub.gravity = {0.0, -9.81, 0.0};
  BodyDescription disc;
  disc.name = "disc";
  disc.mass = 1.0;
  disc.inertia = 0.5 * Eigen::Matrix3d::Identity();
  hub.bodies.push_back(disc);
  const auto add = [&](const JointDescription& joint, double q) {
    hub.initial.coordinates.push_back({static_cast<int>(hub.joints.size()), {q}});
    hub.joints.push_back(joint);
  };
  add(Revolute("O", kGround, origin, 1, origin), 0.0);
  std::vector<JointDescription> closing;
  for (int arm = 1; arm <= num_arms; ++arm) {
    const double around = 2.0 * std::numbers::pi * (arm - 1) / num_arms;
    const Eigen::Vector3d rim(std::cos(around), std::sin(around), 0.0);
    Eigen::Vector3d end = rim;
    double turned = around + kFirstBend;
    for (int i = 1; i <= num_bars; ++i) {
      const std::string place = std::to_string(arm) + "." + std::to_string(i);
      hub.bodies.push_back(Bar("bar" + place, 1.0, 1.0, 1.0 / 12.0));
      const int body = static_cast<int>(hub.bodies.size()) - 1;
      if (i == 1) {
        add(Revolute("J" + place, 1, rim, body, origin), turned);
      } else {
        add(Revolute("J" + place, body - 1, tip, body, origin), kBend);
        turned += kBend;
      }
      end += Eigen::Vector3d(std::cos(turned), std::sin(turned), 0.0);
    }
    if (closed) {
      closing.push_back(Revolute("T" + std::to_string(arm), kGround, end,
                                 static_cast<int>(hub.bodies.size()) - 1, tip));
    }
  }
  hub.joints.insert(hub.joints.end(), closing.begin(), closing.end());
  return hub;
}

}  // namespace loopbench
