// Sections of a mechanism file, each read into its part of the description.
//
// Internal to harness/config. `root` is the file's top-level object. Sections refer to earlier
// sections by name, so the calls follow the order of declarations. Entries with errors stay in the
// lists with placeholder values: indices stay valid until the file is rejected.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/base/fields.h"
#include "harness/config/mechanism_reader.h"

namespace loopbench::harness {

/// Mechanism file being read, with names in the order of its lists. Lookup of names takes constant
/// time, so that reading is linear in the size of the file.
struct Draft : MechanismDescription, ObservedQuantities {
  NameList body_names;  ///< ground first
  NameList joint_names;
  NameList coupling_names;
  std::string comment;
};

/// Fields of a part of a mechanism file, which refers to other parts by name.
template <class T>
using PartFields = Fields<T, const Draft>;
template <class T>
using PartValue = FieldValue<T, const Draft>;
template <class T>
using PartField = Field<T, const Draft>;

/// Cure for non-planar values in a file without "space".
inline constexpr std::string_view kSpatialCure = "\"space\": \"spatial\" at the top level";

/// Reads a mechanism; `root` is the top level of a file or a value inside an experiment.
MechanismFile ReadMechanismObject(const JsonNode& root);

/// Fields of the sections of the same names.
PartValue<Draft> GroundValue();
PartValue<Draft> BodiesValue();
PartValue<Draft> JointsValue();
PartValue<Draft> CouplingsValue();
PartValue<Draft> ForcesValue();
const PartFields<InitialDescription>& InitialFields();
const PartFields<ObservedQuantities>& ObservationFields();

// Readers and writers of values. Writers return null for values that a file leaves out.

/// Reads a number (a constant) or an object with a "type". Returns a placeholder after an error.
TimeFunctionDescription ReadTimeFunction(const JsonNode& node);
/// Writes a function; a constant as a number.
Json WriteTimeFunction(const TimeFunctionDescription& function);
Json TimeFunctionSchema();
/// Reads two or three numbers; reports a third number that is not zero in the plane.
Eigen::Vector3d ReadVector(const JsonNode& node, const Draft& draft);
/// Writes two numbers in the plane if the third is zero, otherwise three.
Json WriteVector(const Eigen::Vector3d& vector, const Draft& draft);
/// Reads an angle about z, or a rotation vector of three numbers.
Eigen::Vector3d ReadRotation(const JsonNode& node, const Draft& draft);
/// Writes the angle if the rotation is about z.
Json WriteRotation(const Eigen::Vector3d& turn, const Draft& draft);
Json RotationSchema();
Json PlaceSchema();
/// Reads the name of a body, including "ground", and returns its index.
std::optional<int> ReadBodyName(const JsonNode& node, const Draft& draft);
/// Reads the name of a joint and returns its index.
std::optional<int> ReadJointName(const JsonNode& node, const Draft& draft);
/// Reads a point: the name of a point of the body, or a vector.
Eigen::Vector3d ReadPoint(const JsonNode& node, int body, const Draft& draft);
/// Writes the name of the body's point at this position, otherwise the vector.
Json WritePoint(const Eigen::Vector3d& at, int body, const Draft& draft);

/// Writer that leaves out zeros.
template <Json (*write)(const Eigen::Vector3d&, const Draft&)>
Json UnlessZero(const Eigen::Vector3d& vector, const Draft& draft) {
  return vector.isZero(0.0) ? Json() : write(vector, draft);
}

/// Returns the value that `get(owner)` refers to. Accessors of forces need a mutable copy.
template <class T, class Get>
auto ValueOf(const T& owner, const Get& get) {
  if constexpr (std::invocable<Get, const T&>) {
    return std::invoke(get, owner);
  } else {
    T copy = owner;
    return std::invoke(get, copy);
  }
}

/// Field for the value of `get(owner)`, by `read(node, draft)` and `write(value, draft)`.
template <class T, class Get, class Read, class Write>
PartValue<T> Coded(Get get, Json schema, Read read, Write write) {
  return {std::move(schema),
          [=](const JsonNode& node, T& owner, const Draft& draft) {
            std::invoke(get, owner) = read(node, draft);
          },
          nullptr,
          [=](const T& owner, const Draft& draft) { return write(ValueOf(owner, get), draft); }};
}

/// Field for a list of parts, whose names are added to `names`. `least` as for
/// JsonNode::Elements(). `start`: defaults of a part.
template <class T>
PartValue<Draft> PartList(std::vector<T> MechanismDescription::*list, const PartFields<T>& fields,
                          NameList Draft::*names, const char* what, const char* least = "",
                          const T& start = {}) {
  PartValue<Draft> value = ObjectList(list, fields, what);
  value.schema = ArraySchema(fields.Schema(), *least == '\0' ? 0 : 1);
  value.read = [=, &fields](const JsonNode& node, Draft& draft, const Draft& all) {
    for (const JsonNode& element : node.Elements(what, least)) {
      T part = start;
      fields.Read(element, &part, all);
      (draft.*names).Add(part.name);
      (draft.*list).push_back(std::move(part));
    }
  };
  return value;
}

/// Field for a name that `taken` does not contain.
template <class T>
PartValue<T> NewName(std::string T::*member, NameList Draft::*taken) {
  const auto read = [=](const JsonNode& node, const Draft& draft) {
    const std::string name = node.Text();
    if ((draft.*taken).Find(name)) node.Fail("a name that is not in use yet");
    return name;
  };
  return Coded<T>(member, TextSchema(), read,
                  [](const std::string& name, const Draft&) { return Json(name); });
}

template <class T, class Get>
FieldValue<T> TimeFunctionOf(Get get) {
  return {TimeFunctionSchema(),
          [=](const JsonNode& node, T& owner) { std::invoke(get, owner) = ReadTimeFunction(node); },
          nullptr, [=](const T& owner) { return WriteTimeFunction(ValueOf(owner, get)); }};
}

/// Field for the index of a body, -1 for an unknown name; `get(owner)` is a reference to it.
template <class T, class Get>
PartValue<T> BodyOf(Get get, bool may_be_ground) {
  const auto read = [=](const JsonNode& node, const Draft& draft) {
    const int body = ReadBodyName(node, draft).value_or(-1);
    if (body == kGround && !may_be_ground) node.Fail("a body that can move");
    return body;
  };
  return Coded<T>(get, TextSchema(), read,
                  [](int body, const Draft& draft) { return Json(draft.bodies[body].name); });
}

/// Field for a point of that body, in body axes from the body's origin.
template <class T, class GetBody, class Get>
PartValue<T> PlaceOf(GetBody body, Get get) {
  return {PlaceSchema(),
          [=](const JsonNode& node, T& owner, const Draft& draft) {
            const int index = std::invoke(body, owner);
            if (index >= 0) std::invoke(get, owner) = ReadPoint(node, index, draft);
          },
          nullptr,
          [=](const T& owner, const Draft& draft) {
            return WritePoint(ValueOf(owner, get), ValueOf(owner, body), draft);
          }};
}

/// Returns the names of joint types in files, by value of JointType.
const NameList& JointTypeNames();

}  // namespace loopbench::harness
