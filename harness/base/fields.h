// Lists of fields: the keys of an object of a file, defined once for all uses.
//
//   const Fields<Limits>& LimitsFields() {
//     static const Fields<Limits> fields(
//         "limits", "Limits at which a case is stopped.",
//         {{"cpu_s", Number(&Limits::cpu_s, kPositive), "CPU time of one run [s], ..."},
//          {"steps", Integer(&Limits::steps, 1, kMaxSteps), "Number of accepted steps."}});
//     return fields;
//   }
//
// A row contains the key, its value type and target member, and a sentence with the unit. A
// required key also has a text for the error message. Defaults are the struct's defaults. The rows
// generate the reader, the errors for unknown keys, the JSON schema (configs/schema/), the tables
// of docs/fields.md, and, if every row can write its value, the writer.
#pragma once

#include <concepts>
#include <functional>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "harness/base/file_kind.h"
#include "harness/base/json_reader.h"
#include "harness/base/schema.h"
#include "harness/base/text.h"

namespace loopbench::harness {

/// Value type of a key, and its member in a T. The context C, if any, is passed to readers and
/// writers: names that the value refers to, for example.
template <class T, class... C>
struct FieldValue {
  using Read = std::function<void(const JsonNode&, T&, C&...)>;
  using Show = std::function<Json(const T&)>;
  using Write = std::function<Json(const T&, C&...)>;

  Json schema;
  Read read;  ///< null: read by other code
  Show show;  ///< value as in a file; null if there is no unique form
  /// Value for writing; null if the key is left out. Without `write`, `show` is used, and default
  /// values of optional keys are left out.
  Write write;

  FieldValue(Json what, Read reader = nullptr, Show shown = nullptr,  // NOLINT: a schema is one
             Write written = nullptr)
      : schema(std::move(what)),
        read(std::move(reader)),
        show(std::move(shown)),
        write(std::move(written)) {}
  /// Converts a field of a base class.
  template <class Base>
  requires(std::derived_from<T, Base> && !std::same_as<T, Base>)
      FieldValue(const FieldValue<Base, C...>& other)  // NOLINT: as a T is a Base
      : schema(other.schema), read(other.read), show(other.show), write(other.write) {}
  /// Converts a field without context.
  template <class Base>
  requires(std::derived_from<T, Base> && sizeof...(C) > 0)
      FieldValue(const FieldValue<Base>& other)  // NOLINT: as a T is a Base
      : schema(other.schema), show(other.show) {
    if (other.read) {
      read = [by = other.read](const JsonNode& node, T& owner, C&...) { by(node, owner); };
    }
    if (other.write) write = [by = other.write](const T& owner, C&...) { return by(owner); };
  }
};

/// Row of a list of fields. Without a name it is a rule for the whole object: `schema` states it,
/// and `read` is called with the object after the previous rows.
template <class T, class... C>
struct Field {
  std::string name;
  FieldValue<T, C...> value;
  std::string sentence = "";
  std::string missing = "";  ///< expected value, for the error if a required key is missing
  /// Returns true if the rows after it cannot be checked.
  bool (*ends)(const T&, C&...) = nullptr;
};

template <class T, class... C>
class Fields {
 public:
  /// `name` is the object's name in schemas and tables.
  Fields(std::string name, std::string sentence, std::vector<Field<T, C...>> rows)
      : name_(std::move(name)), sentence_(std::move(sentence)), rows_(std::move(rows)) {
    for (const auto& row : rows_) {
      if (!row.name.empty()) keys_.Add(row.name);
    }
  }

  /// Reads all rows into `result`, or returns false if `node` is no object. Reports unknown keys.
  bool Read(const JsonNode& node, T* result, C&... context) const {
    if (!node.ExpectObject(keys_)) return false;
    ReadRows(node, result, context...);
    return true;
  }

  /// Reads all rows of an object whose keys are already checked.
  void ReadRows(const JsonNode& node, T* result, C&... context) const {
    for (const auto& row : rows_) {
      const auto member = row.name.empty()      ? std::optional(node)
                          : row.missing.empty() ? node.Optional(row.name)
                                                : node.Required(row.name, row.missing);
      if (member && row.value.read) row.value.read(*member, *result, context...);
      if (row.ends && row.ends(*result, context...)) return;
    }
  }

  /// Calls `put` with the key and plain value of each row, in order.
  template <class Put>
  void Show(const T& object, Put put) const {
    for (const auto& row : rows_) {
      if (row.value.show) put(row.name, row.value.show(object));
    }
  }

  /// Returns the object as JSON, from all rows that can be written, without empty lists and objects
  /// of optional keys. Read() gives the same object.
  Json Write(const T& object, C&... context) const {
    const T standard{};
    Json written = Json::object();
    for (const auto& [name, value, sentence, missing, ends] : rows_) {
      if (name.empty() || !(value.write || value.show)) continue;
      Json json = value.write ? value.write(object, context...) : value.show(object);
      const bool is_standard =
          value.write ? json.is_structured() && json.empty() : json == value.show(standard);
      if (json.is_null() || (missing.empty() && is_standard)) continue;
      written[name] = std::move(json);
    }
    return written;
  }

  /// Return the object's own schema, and a named reference to it.
  Json OwnSchema() const {
    const T standard{};
    std::vector<FieldSchema> fields;
    for (const auto& row : rows_) {
      fields.push_back({row.name, row.value.schema, row.sentence, !row.missing.empty(),
                        row.value.show ? row.value.show(standard) : Json()});
    }
    return ObjectSchema(sentence_, fields);
  }
  Json Schema() const { return Named(name_, OwnSchema()); }

 private:
  std::string name_, sentence_;
  std::vector<Field<T, C...>> rows_;
  NameList keys_;
};

/// Returns a value with its own reader, a function of the node and a T, and optionally a writer.
template <class T, class... C>
FieldValue<T, C...> By(Json schema, void (*read)(const JsonNode&, T&, C&...),
                       std::type_identity_t<Json (*)(const T&, C&...)> write = nullptr) {
  return {std::move(schema), read, nullptr, write};
}

/// Returns the constant word of an object's type; `what` names the object.
template <class T>
FieldValue<T> Constant(const std::string& word, const std::string& what = "") {
  return {ChoiceSchema({word}), [=](const JsonNode& node, T&) { node.Choice({word}, what); },
          nullptr, [word](const T&) { return Json(word); }};
}

template <class T>
FieldValue<T> Number(double T::*member, Range range = {}) {
  return {NumberSchema(range),
          [=](const JsonNode& node, T& owner) { owner.*member = node.Number(range); },
          [=](const T& owner) {
            // out-of-range values are sentinels and are written as null
            return range.Contains(owner.*member) ? Json(owner.*member) : Json();
          }};
}

template <class T, std::integral Int>
FieldValue<T> Integer(Int T::*member, std::int64_t min, std::int64_t max) {
  return {IntegerSchema(min, max),
          [=](const JsonNode& node, T& owner) {
            owner.*member = static_cast<Int>(node.Integer(min, max));
          },
          [=](const T& owner) { return Json(owner.*member); }};
}

template <class T>
FieldValue<T> Bool(bool T::*member) {
  return {BoolSchema(), [=](const JsonNode& node, T& owner) { owner.*member = node.Bool(); },
          [=](const T& owner) { return Json(owner.*member); }};
}

template <class T>
FieldValue<T> Text(std::string T::*member) {
  return {TextSchema(), [=](const JsonNode& node, T& owner) { owner.*member = node.Text(); },
          nullptr,
          [=](const T& owner) { return (owner.*member).empty() ? Json() : Json(owner.*member); }};
}

/// Returns a chosen name, or the enum or bool value of its index.
template <class Chosen>
Chosen ChosenOf(const NameList& names, std::size_t index) {
  if constexpr (std::same_as<Chosen, std::string>) {
    return names.all()[index];
  } else {
    return static_cast<Chosen>(index);
  }
}

/// Returns the name of a choice; null for an empty name.
template <class Chosen>
Json NameOf(const Chosen& chosen, const NameList& names) {
  if constexpr (std::same_as<Chosen, std::string>) {
    return chosen.empty() ? Json() : Json(chosen);
  } else {
    return names.all()[static_cast<std::size_t>(chosen)];
  }
}

/// Returns a choice among names of `what`. The member is the name, or an enum or bool of its index.
template <class T, class Chosen>
FieldValue<T> Choice(Chosen T::*member, const NameList& names, std::string what) {
  return {ChoiceSchema(names.all()),
          [=](const JsonNode& node, T& owner) {
            if (const auto index = node.Choice(names, what)) {
              owner.*member = ChosenOf<Chosen>(names, static_cast<std::size_t>(*index));
            }
          },
          [=](const T& owner) { return NameOf(owner.*member, names); }};
}

/// Returns one or several different names, as in Choice(). `names()` is called when reading.
template <class T, class Chosen, class Names>
FieldValue<T> Choices(std::vector<Chosen> T::*member, Names names, std::string what) {
  return {OneOrMoreSchema(ChoiceSchema(NameList(names()).all()), true),
          [=](const JsonNode& node, T& owner) {
            const NameList known = names();
            (owner.*member).clear();
            for (const std::size_t index : node.Choices(known, what)) {
              (owner.*member).push_back(ChosenOf<Chosen>(known, index));
            }
          },
          [=](const T& owner) {
            return (owner.*member).size() == 1 ? NameOf((owner.*member)[0], names()) : Json();
          }};
}

/// Returns one number, several numbers or a range.
template <class T>
FieldValue<T> NumberList(std::vector<double> T::*member, Range range = {}) {
  return {NumberListSchema(range),
          [=](const JsonNode& node, T& owner) { owner.*member = node.NumberList(range); }};
}

template <class T>
FieldValue<T> IntegerList(std::vector<std::int64_t> T::*member, std::int64_t min,
                          std::int64_t max) {
  return {IntegerListSchema(min, max),
          [=](const JsonNode& node, T& owner) { owner.*member = node.IntegerList(min, max); }};
}

template <class T, class Part, class... C>
FieldValue<T, C...> Object(Part T::*member, const Fields<Part, C...>& fields) {
  return {fields.Schema(),
          [member, &fields](const JsonNode& node, T& owner, C&... context) {
            fields.Read(node, &(owner.*member), context...);
          },
          nullptr,
          [member, &fields](const T& owner, C&... context) {
            return fields.Write(owner.*member, context...);
          }};
}

/// Returns an object that may be absent.
template <class T, class Part, class... C>
FieldValue<T, C...> OptionalObject(std::optional<Part> T::*member,
                                   const Fields<Part, C...>& fields) {
  return {fields.Schema(),
          [member, &fields](const JsonNode& node, T& owner, C&... context) {
            fields.Read(node, &(owner.*member).emplace(), context...);
          },
          nullptr,
          [member, &fields](const T& owner, C&... context) {
            return owner.*member ? fields.Write(*(owner.*member), context...) : Json();
          }};
}

/// Returns an object whose fields are members of the same struct.
template <class T, class... C>
FieldValue<T, C...> Section(const Fields<T, C...>& fields) {
  return {fields.Schema(),
          [&fields](const JsonNode& node, T& owner, C&... context) {
            fields.Read(node, &owner, context...);
          },
          nullptr,
          [&fields](const T& owner, C&... context) { return fields.Write(owner, context...); }};
}

/// Returns an array of objects; `what` names them.
template <class T, class Part, class... C>
FieldValue<T, C...> ObjectList(std::vector<Part> T::*member, const Fields<Part, C...>& fields,
                               std::string what) {
  return {ArraySchema(fields.Schema()),
          [=, &fields](const JsonNode& node, T& owner, C&... context) {
            for (const JsonNode& element : node.Elements(what)) {
              fields.Read(element, &(owner.*member).emplace_back(), context...);
            }
          },
          nullptr,
          [=, &fields](const T& owner, C&... context) {
            Json list = Json::array();
            for (const Part& part : owner.*member) list.push_back(fields.Write(part, context...));
            return list;
          }};
}

// Top level of each kind of file: its keys, and the error for a file of another kind.
//
// Internal to harness/config (see json_document.h).

/// Returns true if `root` is an object that may be of this kind. Reports all errors: not an object,
/// a document with more keys of another kind ("found a mechanism (it has "bodies"), expected an
/// experiment"), another format, otherwise every unknown key, and a "$schema" that is not a string.
/// "$schema" is allowed in every kind, for editors only.
bool ExpectDocument(const JsonNode& root, FileKind kind);

/// Returns the common rows of all kinds, followed by `own`.
template <class T, class... C>
std::vector<Field<T, C...>> DocumentRows(std::vector<Field<T, C...>> own) {
  std::vector<Field<T, C...>> rows = {
      {"$schema", TextSchema(), "Address of this schema, for editors."},
      {"format", IntegerSchema(kFileFormat, kFileFormat),
       "Version of the file format. Files of other versions are rejected."}};
  rows.insert(rows.end(), std::make_move_iterator(own.begin()), std::make_move_iterator(own.end()));
  return rows;
}

}  // namespace loopbench::harness
