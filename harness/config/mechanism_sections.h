// The sections of a mechanism file, each read into its part of the description.
//
// Internal to harness/config. `root` is the file's top-level object. Later sections refer to
// earlier ones by name, so the order of the calls is that of the declarations. Entries with errors
// stay in the lists with stand-in values: the file is refused in the end, and indices stay valid
// until then.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/config/mechanism_reader.h"
#include "harness/json/fields.h"

namespace loopbench::harness {

/// A mechanism file being read, with the names in the order of its lists: references are looked up
/// without a search, so that reading is linear in the size of the file.
struct Draft : MechanismDescription {
  NameList body_names;  ///< ground first
  NameList joint_names;
  SceneObservation observe;
  std::string comment;
};

/// A part of it, which refers to others by name.
template <class T>
struct PartOf : T {
  const Draft* draft = nullptr;
};

/// What makes everything right that leaves the plane in a file that does not say so.
inline constexpr std::string_view kSpatialCure = "\"space\": \"spatial\" at the top level";

/// The whole of a mechanism; `root` may be a file's top level or a value inside an experiment.
MechanismFile ReadMechanismObject(const JsonNode& root);

/// All that a mechanism file may hold.
const Fields<Draft>& MechanismFileFields();
/// The sections of the same names.
FieldValue<Draft> GroundValue();
FieldValue<Draft> BodiesValue();
FieldValue<Draft> JointsValue();
FieldValue<Draft> ForcesValue();
FieldValue<Draft> IndependentValue();
const Fields<Draft>& InitialFields();
const Fields<Draft>& ObservationFields();

/// A number (a constant), or an object with "type" polynomial, harmonic or table. A stand-in after
/// an error.
TimeFunctionDescription ReadTimeFunction(const JsonNode& node);
/// A constant as a number.
Json WriteTimeFunction(const TimeFunctionDescription& function);
Json TimeFunctionSchema();
/// Two or three numbers; reports a third one that is not zero in the plane.
Eigen::Vector3d ReadVector(const JsonNode& node, SpaceKind space);
/// Two numbers in the plane, unless the third is not zero; else three.
Json WriteVector(const Eigen::Vector3d& vector, SpaceKind space);
/// The name of the body's point that is there, else the vector.
Json WritePoint(const Eigen::Vector3d& at, const BodyDescription& body, SpaceKind space);
/// The point that a name of the body's points or a vector denotes.
Eigen::Vector3d ReadPoint(const JsonNode& node, const BodyDescription& body, SpaceKind space);
Json PlaceSchema();
/// Index of the body with this name ("ground" is one of them).
std::optional<int> ReadBodyName(const JsonNode& node, const Draft& draft);
/// Index of the joint with this name.
std::optional<int> ReadJointName(const JsonNode& node, const Draft& draft);
/// A name that is not empty and not yet in `taken`.
std::string ReadNewName(const JsonNode& node, const NameList& taken);

/// A part that begins as `start`, where nothing is said.
template <class T>
T ReadPart(const Fields<PartOf<T>>& fields, const JsonNode& node, const Draft& draft,
           T start = {}) {
  PartOf<T> part;
  static_cast<T&>(part) = std::move(start);
  part.draft = &draft;
  fields.Read(node, &part);
  return part;
}

/// A part as a file says it.
template <class T>
Json WritePart(const Fields<PartOf<T>>& fields, const Draft& draft, const T& whole) {
  PartOf<T> part;
  static_cast<T&>(part) = whole;
  part.draft = &draft;
  return fields.Write(part);
}

/// An object within an object.
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

template <class T>
FieldValue<PartOf<T>> VectorOf(Eigen::Vector3d T::*member) {
  return {VectorSchema(),
          [=](const JsonNode& node, PartOf<T>& owner) {
            owner.*member = ReadVector(node, owner.draft->space);
          },
          nullptr,
          [=](const PartOf<T>& owner) {
            const Eigen::Vector3d& vector = owner.*member;
            return vector.isZero(0.0) ? Json() : WriteVector(vector, owner.draft->space);
          }};
}

template <class T>
FieldValue<T> TimeFunctionOf(TimeFunctionDescription T::*member) {
  return {TimeFunctionSchema(),
          [=](const JsonNode& node, T& owner) { owner.*member = ReadTimeFunction(node); }, nullptr,
          [=](const T& owner) { return WriteTimeFunction(owner.*member); }};
}

/// The index of a body, -1 for a name that is not known; `get(owner)` refers to it.
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
            T part = owner;  // forces know their parts by reference
            const int body = std::invoke(get, part);
            return Json(owner.draft->bodies[body].name);
          }};
}

/// A place on that body, in its axes from its origin.
template <class T, class GetBody, class Get>
FieldValue<PartOf<T>> PlaceOf(GetBody body, Get get) {
  return {PlaceSchema(),
          [=](const JsonNode& node, PartOf<T>& owner) {
            T& part = owner;
            const int index = std::invoke(body, part);
            if (index < 0) return;
            const Draft& draft = *owner.draft;
            std::invoke(get, part) = ReadPoint(node, draft.bodies[index], draft.space);
          },
          nullptr,
          [=](const PartOf<T>& owner) {
            T part = owner;
            const int index = std::invoke(body, part);
            return WritePoint(std::invoke(get, part), owner.draft->bodies[index],
                              owner.draft->space);
          }};
}

/// Names of joint types in files, by value of JointType.
const NameList& JointTypeNames();

}  // namespace loopbench::harness
