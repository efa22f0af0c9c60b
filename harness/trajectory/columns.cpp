#include "harness/trajectory/columns.h"

#include <fmt/format.h>

#include "harness/text/escape.h"

namespace loopbench::harness {
namespace {

using Columns = std::vector<TrajectoryColumn>;

/// "x y z" or "x y".
void AddVector(const std::string& kind, const std::string& name, const std::string& prefix,
               const std::string& unit, bool planar, Columns* columns) {
  for (const char* axis : {"x", "y", "z"}) {
    if (planar && *axis == 'z') continue;
    columns->push_back({kind, name, prefix + axis, unit});
  }
}

/// The unit of an effort along a coordinate.
std::string EffortUnit(bool is_length) { return is_length ? "N" : "N m"; }

bool IsLength(const MechanismDescription& user, int joint) {
  const auto words =
      ValueWords(user.joints[static_cast<std::size_t>(joint)].type, user.space, false);
  return !words.empty() && words.front().is_length();
}

void AddReaction(const MechanismDescription& user, const JointDescription& joint, bool planar,
                 Columns* columns) {
  if (joint.type == JointType::kFree) return;
  const std::string name = LabelName(joint.name);
  AddVector("reaction", name, "f", "N", planar, columns);
  if (planar) {
    columns->push_back({"reaction", name, "mz", "N m"});
  } else {
    AddVector("reaction", name, "m", "N m", planar, columns);
  }
  const auto words = ValueWords(joint.type, user.space, false);
  for (const PrescribedMotion& motion : joint.motions) {
    const ValueWord& word = words[static_cast<std::size_t>(motion.coordinate)];
    columns->push_back({"drive", name, std::string(word.name), EffortUnit(word.is_length())});
  }
}

void AddForce(const MechanismDescription& user, std::size_t index, bool planar, Columns* columns) {
  ForceDescription force = user.forces[index];
  const ForceParts parts = PartsOf(force);
  const std::string name = fmt::format("{}:{}", index, LabelName(parts.name));
  if (parts.joint != nullptr) {
    columns->push_back(
        {"force", name + ":" + LabelName(user.joints[static_cast<std::size_t>(*parts.joint)].name),
         "effort", EffortUnit(IsLength(user, *parts.joint))});
  } else if (parts.points.size() == 2) {
    columns->push_back({"force", name, "tension", "N"});
  } else {
    AddVector("force", name, "f", "N", planar, columns);
  }
}

}  // namespace

std::string TrajectoryColumn::Label() const {
  if (kind == component) return fmt::format("{} [{}]", kind, unit);
  return fmt::format("{}{}:{} [{}]", kind, name.empty() ? "" : ":" + name, component, unit);
}

std::string LabelName(std::string_view name) {
  std::string marked;
  for (const char c : name) {
    if (c == ':' || c == '\\') marked += '\\';
    marked += c;
  }
  return EscapeTerminal(marked);
}

std::optional<TrajectoryColumn> ParseLabel(std::string_view label) {
  const std::size_t bracket = label.rfind(" [");
  if (bracket == std::string_view::npos || !label.ends_with(']')) return std::nullopt;
  TrajectoryColumn column;
  column.unit = label.substr(bracket + 2, label.size() - bracket - 3);
  label = label.substr(0, bracket);
  // components have no colon; a name's have a backslash before them
  const std::size_t first = label.find(':'), last = label.rfind(':');
  column.kind = label.substr(0, first);
  column.component = first == std::string_view::npos ? label : label.substr(last + 1);
  if (first == std::string_view::npos && label != "t") return std::nullopt;
  if (first != last) column.name = label.substr(first + 1, last - first - 1);
  if (column.kind.empty() || column.component.empty()) return std::nullopt;
  return column;
}

std::vector<TrajectoryColumn> JointColumns(const MechanismDescription& user, std::size_t j) {
  Columns columns;
  const JointDescription& joint = user.joints[j];
  const std::string name = LabelName(joint.name);
  for (const ValueWord& word : ValueWords(joint.type, user.space, false)) {
    columns.push_back(
        {"joint", name, std::string(word.name), word.unit.empty() ? "1" : std::string(word.unit)});
  }
  for (const ValueWord& word : ValueWords(joint.type, user.space, true)) {
    // those of rotations without coordinates of their own are called so already
    const bool is_speed = word.name.starts_with('w');
    columns.push_back({"joint", name, std::string(word.name) + (is_speed ? "" : " speed"),
                       std::string(word.unit)});
  }
  return columns;
}

std::vector<TrajectoryColumn> BodyColumns(const MechanismDescription& user, std::size_t b) {
  const bool planar = user.space == SpaceKind::kPlanar;
  const std::string name = LabelName(user.bodies[b].name);
  Columns columns;
  AddVector("body", name, "", "m", planar, &columns);
  if (planar) {
    columns.push_back({"body", name, "angle", "rad"});
  } else {
    for (const char* part : {"qw", "qx", "qy", "qz"}) columns.push_back({"body", name, part, "1"});
  }
  AddVector("body", name, "v", "m/s", planar, &columns);
  if (planar) {
    columns.push_back({"body", name, "w", "rad/s"});
  } else {
    AddVector("body", name, "w", "rad/s", planar, &columns);
  }
  return columns;
}

std::vector<TrajectoryColumn> TrajectoryColumns(const MechanismDescription& user,
                                                const OutputOptions& output) {
  const bool planar = user.space == SpaceKind::kPlanar;
  Columns columns = {{"t", "", "t", "s"}};
  const auto add = [&](const Columns& more) {
    columns.insert(columns.end(), more.begin(), more.end());
  };
  if (output.Has(OutputPart::kJoints)) {
    for (std::size_t j = 0; j < user.joints.size(); ++j) add(JointColumns(user, j));
  }
  for (std::size_t b = 1; b < user.bodies.size(); ++b) {
    if (output.Has(OutputPart::kBodies)) add(BodyColumns(user, b));
    if (!output.Has(OutputPart::kPoints)) continue;
    for (const auto& [point, at] : user.bodies[b].points) {
      const std::string name = LabelName(user.bodies[b].name) + ":" + LabelName(point);
      AddVector("point", name, "", "m", planar, &columns);
      AddVector("point", name, "v", "m/s", planar, &columns);
    }
  }
  if (output.Has(OutputPart::kReactions)) {
    for (const JointDescription& joint : user.joints) AddReaction(user, joint, planar, &columns);
  }
  if (output.Has(OutputPart::kForces)) {
    for (std::size_t f = 0; f < user.forces.size(); ++f) AddForce(user, f, planar, &columns);
  }
  if (output.Has(OutputPart::kEnergy)) {
    for (const char* part : {"kinetic", "potential", "supplied", "dissipated"}) {
      columns.push_back({"energy", "", part, "J"});
    }
  }
  return columns;
}

}  // namespace loopbench::harness
