// The sections of a mechanism file, each read into its part of the description.
//
// Internal to harness/config. `root` is the file's top-level object. Later sections refer to
// earlier ones by name, so the order of the calls is that of the declarations. Entries with errors
// stay in the lists with stand-in values: the file is refused in the end, and indices stay valid
// until then.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "harness/config/json_reader.h"
#include "harness/config/scene.h"

namespace loopbench::harness {

/// "ground" and "bodies".
void ReadBodies(const JsonNode& root, MechanismDescription* description);
/// "joints".
void ReadJoints(const JsonNode& root, MechanismDescription* description);
/// "forces".
void ReadForces(const JsonNode& root, MechanismDescription* description);
/// "initial".
void ReadInitial(const JsonNode& root, MechanismDescription* description);
/// "independent".
void ReadIndependent(const JsonNode& root, MechanismDescription* description);
/// "observe".
SceneObservation ReadObservation(const JsonNode& root, const MechanismDescription& description);

/// Two or three numbers; reports a third one that is not zero in the plane.
Eigen::Vector3d ReadVector(const JsonNode& node, SpaceKind space);
/// The point that a name of the body's points or a vector denotes.
Eigen::Vector3d ReadPoint(const JsonNode& node, const BodyDescription& body, SpaceKind space);
/// Index of the body with this name ("ground" is one of them).
std::optional<int> ReadBodyName(const JsonNode& node, const MechanismDescription& description);
/// Index of the joint with this name.
std::optional<int> ReadJointName(const JsonNode& node, const MechanismDescription& description);
/// A name that is not empty and not yet in `taken`.
std::string ReadNewName(const JsonNode& owner, const std::vector<std::string>& taken);

std::vector<std::string> BodyNames(const MechanismDescription& description);
std::vector<std::string> JointNames(const MechanismDescription& description);

/// Names of joint types in files, by value of JointType.
const std::vector<std::string>& JointTypeNames();
/// Numbers of coordinates and speeds of a joint (mechanism/joint.h): revolute and prismatic 1, weld
/// 0, free 3 and 3 in the plane [angle, x, y], 7 and 6 in space [qw, qx, qy, qz, x, y, z].
int CoordinateCount(JointType type, SpaceKind space);
int SpeedCount(JointType type, SpaceKind space);

}  // namespace loopbench::harness
