#include "mechanism/description/parts.h"

#include <numeric>
#include <utility>

namespace loopbench {

namespace {

/// Renumbers a force. False when there is nothing left for it to do.
bool Keep(const ForceParts& force, const Renumbering& renumbering) {
  if (force.joint != nullptr) {
    *force.joint = renumbering.joints[*force.joint];
    return *force.joint >= 0;
  }
  bool moves = false, lost = false;  // another part's
  for (BodyPoint* point : force.points) {
    point->body = renumbering.bodies[point->body];
    moves = moves || point->body > kGround;
    lost = lost || point->body < 0;
  }
  const bool on_itself = force.points.size() > 1 && force.points[0]->body == force.points[1]->body;
  return moves && !lost && !on_itself;
}

/// Returns the names of independent speeds if all still exist, else none.
std::vector<std::string> KeptNames(const MechanismDescription& old, const Renumbering& kept) {
  for (const std::string& name : old.independent) {
    const std::string owner = name.substr(0, name.rfind('.'));
    for (std::size_t i = 0; i < old.bodies.size(); ++i) {
      if (old.bodies[i].name == owner && kept.bodies[i] < 0) return {};
    }
    for (std::size_t j = 0; j < old.joints.size(); ++j) {
      if ((old.joints[j].name == name || old.joints[j].name == owner) && kept.joints[j] < 0) {
        return {};
      }
    }
  }
  return old.independent;
}

std::vector<JointValues> KeptValues(const std::vector<JointValues>& old, const Renumbering& kept) {
  std::vector<JointValues> values;
  for (const JointValues& one : old) {
    if (kept.joints[one.joint] >= 0) {
      values.push_back({kept.joints[one.joint], one.values, one.weight});
    }
  }
  return values;
}

}  // namespace

MechanismDescription Select(const MechanismDescription& description,
                            const Renumbering& renumbering) {
  // A new member of the description must be thought about here: this line stops compiling.
  const auto& [name, space, gravity, bodies, joints, couplings, forces, initial, independent,
               accuracy, rounded] = description;
  MechanismDescription part;
  part.name = name;
  part.space = space;
  part.accuracy = accuracy;
  part.rounded = rounded;
  part.gravity = gravity;
  part.bodies.clear();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (renumbering.bodies[i] >= 0) part.bodies.push_back(bodies[i]);
  }
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (renumbering.joints[j] < 0) continue;
    // Add new members of a joint here; they must stay valid if its frames' bodies change.
    const auto& [joint_name, type, from, to, axis, parameter, cut, released, moving, motions,
                 rotor_inertia] = joints[j];
    JointDescription joint{joint_name, type,     from,   to,      axis,         parameter,
                           cut,        released, moving, motions, rotor_inertia};
    joint.from.body = renumbering.bodies[from.body];
    joint.to.body = renumbering.bodies[to.body];
    part.joints.push_back(joint);
  }
  for (CouplingDescription coupling : couplings) {
    bool is_kept = true;
    for (auto& [joint, ratio] : coupling.parts) {
      joint = renumbering.joints[joint];
      is_kept = is_kept && joint >= 0;
    }
    if (is_kept) part.couplings.push_back(std::move(coupling));
  }
  for (ForceDescription force : forces) {
    if (Keep(PartsOf(force), renumbering)) part.forces.push_back(force);
  }
  part.initial.coordinates = KeptValues(initial.coordinates, renumbering);
  part.initial.speeds = KeptValues(initial.speeds, renumbering);
  for (const int joint : initial.held) {
    if (renumbering.joints[joint] >= 0) part.initial.held.push_back(renumbering.joints[joint]);
  }
  part.independent = KeptNames(description, renumbering);
  return part;
}

std::vector<Part> Split(const MechanismDescription& description,
                        const std::vector<Island>& islands) {
  if (islands.size() == 1) {
    Part whole{description, std::vector<int>(description.bodies.size()),
               std::vector<int>(description.joints.size())};
    std::iota(whole.bodies.begin(), whole.bodies.end(), 0);
    std::iota(whole.joints.begin(), whole.joints.end(), 0);
    return {whole};
  }
  std::vector<Part> parts;
  for (const Island& island : islands) {
    Part part;
    Renumbering own{std::vector<int>(description.bodies.size(), -1),
                    std::vector<int>(description.joints.size(), -1)};
    const auto take = [](int index, std::vector<int>& numbers, std::vector<int>& taken) {
      numbers[index] = static_cast<int>(taken.size());
      taken.push_back(index);
    };
    take(kGround, own.bodies, part.bodies);
    for (const int body : island.bodies) take(body, own.bodies, part.bodies);
    for (std::size_t j = 0; j < description.joints.size(); ++j) {
      const auto& [from, to] =
          std::pair(description.joints[j].from.body, description.joints[j].to.body);
      if (own.bodies[from == kGround ? to : from] > kGround) {
        take(static_cast<int>(j), own.joints, part.joints);
      }
    }
    part.description = Select(description, own);
    part.description.name += "#" + std::to_string(parts.size() + 1);
    parts.push_back(std::move(part));
  }
  return parts;
}

std::vector<Part> SplitByJoints(MechanismDescription description) {
  // forces along joints stay: they decide which joints are coordinates, and with them the rank
  std::erase_if(description.forces,
                [](ForceDescription& force) { return PartsOf(force).joint == nullptr; });
  return Split(description, FindIslands(description));
}

}  // namespace loopbench
