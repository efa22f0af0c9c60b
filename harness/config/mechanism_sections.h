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
#include <string_view>
#include <vector>

#include "harness/config/scene.h"
#include "harness/json/json_reader.h"

namespace loopbench::harness {

/// A description being read, with its names in the order of its lists: references are looked up
/// without a search, so that reading is linear in the size of the file.
struct Draft : MechanismDescription {
  NameList body_names;  ///< ground first
  NameList joint_names;
};

/// What makes everything right that leaves the plane in a file that does not say so.
inline constexpr std::string_view kSpatialCure = "\"space\": \"spatial\" at the top level";

/// The whole of a mechanism; `root` may be a file's top level or a value inside an experiment.
MechanismFile ReadMechanismObject(const JsonNode& root);

/// "ground" and "bodies".
void ReadBodies(const JsonNode& root, Draft* draft);
/// "joints".
void ReadJoints(const JsonNode& root, Draft* draft);
/// "forces".
void ReadForces(const JsonNode& root, Draft* draft);
/// "initial".
void ReadInitial(const JsonNode& root, Draft* draft);
/// "independent".
void ReadIndependent(const JsonNode& root, Draft* draft);
/// "observe".
SceneObservation ReadObservation(const JsonNode& root, const Draft& draft);

/// A number (a constant), or an object with "type" polynomial, harmonic or table. A stand-in after
/// an error.
TimeFunctionDescription ReadTimeFunction(const JsonNode& node);
/// A number that must be there.
double ReadRequiredNumber(const JsonNode& owner, const std::string& key, const Range& range = {});
/// A number, or `otherwise` when it is absent.
double ReadOptionalNumber(const JsonNode& owner, const std::string& key, const Range& range = {},
                          double otherwise = 0.0);
/// Two or three numbers; reports a third one that is not zero in the plane.
Eigen::Vector3d ReadVector(const JsonNode& node, SpaceKind space);
/// The point that a name of the body's points or a vector denotes.
Eigen::Vector3d ReadPoint(const JsonNode& node, const BodyDescription& body, SpaceKind space);
/// Index of the body with this name ("ground" is one of them).
std::optional<int> ReadBodyName(const JsonNode& node, const Draft& draft);
/// Index of the joint with this name.
std::optional<int> ReadJointName(const JsonNode& node, const Draft& draft);
/// A name that is not empty and not yet in `taken`.
std::string ReadNewName(const JsonNode& owner, const NameList& taken);

/// Names of joint types in files, by value of JointType.
const NameList& JointTypeNames();

}  // namespace loopbench::harness
