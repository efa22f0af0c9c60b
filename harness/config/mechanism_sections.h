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

/// Part of a mechanism file, which refers to other parts by name.
template <class T>
struct PartOf : T {
  const Draft* draft = nullptr;
};
inline const Draft& DraftOf(const Draft& draft) { return draft; }
template <class T>
const Draft& DraftOf(const PartOf<T>& part) {
  return *part.draft;
}

/// Cure for non-planar values in a file without "space".
inline constexpr std::string_view kSpatialCure = "\"space\": \"spatial\" at the top level";

/// Reads a mechanism; `root` is the top level of a file or a value inside an experiment.
MechanismFile ReadMechanismObject(const JsonNode& root);

/// Fields of the sections of the same names.
FieldValue<Draft> GroundValue();
FieldValue<Draft> BodiesValue();
FieldValue<Draft> JointsValue();
FieldValue<Draft> CouplingsValue();
FieldValue<Draft> ForcesValue();
const Fields<Draft>& InitialFields();
const Fields<Draft>& ObservationFields();

// Readers and writers of values. Writers return null for values that a file leaves out.

/// Reads a number (a constant), or an object with "type" polynomial, harmonic or table. Returns a
/// placeholder after an error.
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

/// Writers that leave out zeros, and values that are not there.
template <Json (*write)(const Eigen::Vector3d&, const Draft&)>
Json UnlessZero(const Eigen::Vector3d& vector, const Draft& draft) {
  return vector.isZero(0.0) ? Json() : write(vector, draft);
}
template <Json (*write)(const Eigen::Vector3d&, const Draft&)>
Json IfAny(const std::optional<Eigen::Vector3d>& vector, const Draft& draft) {
  return vector ? write(*vector, draft) : Json();
}

/// Field for the value that `get(owner)` refers to, by `read(node, draft)` and `write(value,
/// draft)`.
template <class T, class Get, class Read, class Write>
FieldValue<T> Coded(Get get, Json schema, Read read, Write write) {
  return {
      std::move(schema),
      [=](const JsonNode& node, T& owner) { std::invoke(get, owner) = read(node, DraftOf(owner)); },
      nullptr, [=](const T& owner) { return write(std::invoke(get, owner), DraftOf(owner)); }};
}

/// Reads a part; `start` contains the defaults.
template <class T>
T ReadPart(const Fields<PartOf<T>>& fields, const JsonNode& node, const Draft& draft,
           T start = {}) {
  PartOf<T> part;
  static_cast<T&>(part) = std::move(start);
  part.draft = &draft;
  fields.Read(node, &part);
  return part;
}

/// Writes a part as in a file.
template <class T>
Json WritePart(const Fields<PartOf<T>>& fields, const Draft& draft, const T& whole) {
  PartOf<T> part;
  static_cast<T&>(part) = whole;
  part.draft = &draft;
  return fields.Write(part);
}

/// Field for an object within an object.
template <class T, class Owner>
FieldValue<PartOf<Owner>> Part(T Owner::*member, const Fields<PartOf<T>>& fields) {
  return {fields.Schema(),
          [member, &fields](const JsonNode& node, PartOf<Owner>& owner) {
            owner.*member = ReadPart(fields, node, *owner.draft, owner.*member);
          },
          nullptr,
          [member, &fields](const PartOf<Owner>& owner) {
            return WritePart(fields, *owner.draft, owner.*member);
          }};
}

/// Rules of a list of parts.
template <class T>
struct PartRules {
  const char* what;             ///< the elements in messages: "joints"
  const char* least = "";       ///< as for JsonNode::Elements()
  std::size_t first = 0;        ///< index of the first part of a file
  bool is_always_there = true;  ///< also without parts
  T start = {};                 ///< defaults of a part
};

/// Field for a list of parts with names, which are added to `names`.
template <class T>
FieldValue<Draft> PartList(std::vector<T> MechanismDescription::*list,
                           const Fields<PartOf<T>>& fields, NameList Draft::*names,
                           const PartRules<T>& rules) {
  return {ArraySchema(fields.Schema(), *rules.least == '\0' ? 0 : 1),
          [=, &fields](const JsonNode& node, Draft& draft) {
            for (const JsonNode& element : node.Elements(rules.what, rules.least)) {
              (draft.*list).push_back(ReadPart(fields, element, draft, rules.start));
              (draft.*names).Add((draft.*list).back().name);
            }
          },
          nullptr,
          [=, &fields](const Draft& draft) {
            Json parts = Json::array();
            for (std::size_t i = rules.first; i < (draft.*list).size(); ++i) {
              parts.push_back(WritePart(fields, draft, (draft.*list)[i]));
            }
            return parts.empty() && !rules.is_always_there ? Json() : parts;
          }};
}

/// Field for a name that `taken` does not contain.
template <class T>
FieldValue<PartOf<T>> NewName(std::string T::*member, NameList Draft::*taken) {
  return {TextSchema(),
          [=](const JsonNode& node, PartOf<T>& owner) {
            owner.*member = node.Text();
            if ((owner.draft->*taken).Find(owner.*member))
              node.Fail("a name that is not in use yet");
          },
          nullptr, [=](const PartOf<T>& owner) { return Json(owner.*member); }};
}

template <class T>
FieldValue<T> TimeFunctionOf(TimeFunctionDescription T::*member) {
  return {TimeFunctionSchema(),
          [=](const JsonNode& node, T& owner) { owner.*member = ReadTimeFunction(node); }, nullptr,
          [=](const T& owner) { return WriteTimeFunction(owner.*member); }};
}

/// Field for the index of a body, -1 for an unknown name; `get(owner)` is a reference to it.
template <class T, class Get>
FieldValue<PartOf<T>> BodyOf(Get get, bool may_be_ground) {
  return {TextSchema(),
          [=](const JsonNode& node, PartOf<T>& owner) {
            int& body = std::invoke(get, static_cast<T&>(owner));
            body = ReadBodyName(node, *owner.draft).value_or(-1);
            if (body == kGround && !may_be_ground) node.Fail("a body that can move");
          },
          nullptr,
          [=](const PartOf<T>& owner) {
            T part = owner;  // accessors of forces need a mutable copy
            const int body = std::invoke(get, part);
            return Json(owner.draft->bodies[body].name);
          }};
}

/// Field for a point of that body, in body axes from the body's origin.
template <class T, class GetBody, class Get>
FieldValue<PartOf<T>> PlaceOf(GetBody body, Get get) {
  return {PlaceSchema(),
          [=](const JsonNode& node, PartOf<T>& owner) {
            T& part = owner;
            const int index = std::invoke(body, part);
            if (index < 0) return;
            std::invoke(get, part) = ReadPoint(node, index, *owner.draft);
          },
          nullptr,
          [=](const PartOf<T>& owner) {
            T part = owner;
            return WritePoint(std::invoke(get, part), std::invoke(body, part), *owner.draft);
          }};
}

/// Returns the names of joint types in files, by value of JointType.
const NameList& JointTypeNames();

}  // namespace loopbench::harness
