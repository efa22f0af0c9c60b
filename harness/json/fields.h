// Lists of fields: what an object of a file may hold, said once for all who ask.
//
//   const Fields<Limits>& LimitsFields() {
//     static const Fields<Limits> fields(
//         "limits", "When a case is given up.",
//         {{"cpu_s", Number(&Limits::cpu_s, kPositive), "CPU time of one run [s]."},
//          {"steps", Integer(&Limits::steps, 1, kMaxSteps), "Accepted steps."}});
//     return fields;
//   }
//
// A row is the key, what its value may be and where it goes, and a sentence with the unit; a key
// that must be there has in addition the words for the message that it is not. Defaults are those
// of the struct. From the rows come the reader, the refusal of other keys with the nearest
// spelling, the JSON schema (configs/schema/), the tables of docs/fields.md, and, where every row
// can say its value, the writer of such an object.
#pragma once

#include <concepts>
#include <functional>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "harness/json/file_kind.h"
#include "harness/json/json_reader.h"
#include "harness/json/schema.h"
#include "harness/text/files.h"

namespace loopbench::harness {

/// What the value of a key may be, and where it goes in a T.
template <class T>
struct FieldValue {
  using Read = std::function<void(const JsonNode&, T&)>;
  using Show = std::function<Json(const T&)>;

  Json schema;
  Read read;  ///< null: read elsewhere
  Show show;  ///< as a file says it; null where there is no one way
  /// As a file that is written says it: null where the key is left out. Without one it is `show`,
  /// left out where the value is the default and may be.
  Show write;

  FieldValue(Json what, Read reader = nullptr, Show shown = nullptr,  // NOLINT: a schema is one
             Show written = nullptr)
      : schema(std::move(what)),
        read(std::move(reader)),
        show(std::move(shown)),
        write(std::move(written)) {}
  /// A member of a base is one of the derived struct, which may carry what reading needs besides.
  template <class Base>
  requires(std::derived_from<T, Base> && !std::same_as<T, Base>)
      FieldValue(const FieldValue<Base>& other)  // NOLINT: as a T is a Base
      : schema(other.schema), read(other.read), show(other.show), write(other.write) {}
};

/// One row. Without a name it is a rule about the whole object: `schema` says it, `read` gets the
/// object, after the rows before it.
template <class T>
struct Field {
  std::string name;
  FieldValue<T> value;
  std::string sentence = "";
  std::string missing = "";  ///< what is expected where the key must be and is not there
  /// Whether the rows after it cannot be judged.
  bool (*ends)(const T&) = nullptr;
};

template <class T>
class Fields {
 public:
  /// `name` is that of the object in schemas and tables.
  Fields(std::string name, std::string sentence, std::vector<Field<T>> rows)
      : name_(std::move(name)), sentence_(std::move(sentence)), rows_(std::move(rows)) {
    for (const Field<T>& row : rows_) {
      if (!row.name.empty()) keys_.Add(row.name);
    }
  }

  /// Reads all rows into `result`; false, and nothing read, when `node` is no object. Reports
  /// unknown keys first.
  bool Read(const JsonNode& node, T* result) const {
    if (!node.ExpectObject(keys_)) return false;
    ReadRows(node, result);
    return true;
  }

  /// The same for an object whose keys are known.
  void ReadRows(const JsonNode& node, T* result) const {
    for (const Field<T>& row : rows_) {
      if (row.name.empty()) {
        if (row.value.read) row.value.read(node, *result);
        continue;
      }
      const auto member =
          row.missing.empty() ? node.Optional(row.name) : node.Required(row.name, row.missing);
      if (member && row.value.read) row.value.read(*member, *result);
      if (row.ends && row.ends(*result)) return;
    }
  }

  /// Each plain value of `object` under its key, in the order of the rows.
  template <class Put>
  void Show(const T& object, Put put) const {
    for (const Field<T>& row : rows_) {
      if (row.value.show) put(row.name, row.value.show(object));
    }
  }

  /// The object as a file may say it, by all rows that can: Read() of it gives the same.
  Json Write(const T& object) const {
    const T standard{};
    Json written = Json::object();
    for (const Field<T>& row : rows_) {
      const auto& say = row.value.write ? row.value.write : row.value.show;
      if (row.name.empty() || !say) continue;
      Json value = say(object);
      const bool may_lack = !row.value.write && row.missing.empty();
      if (value.is_null() || (may_lack && value == say(standard))) continue;
      written[row.name] = std::move(value);
    }
    return written;
  }

  /// The object by itself, and as others refer to it.
  Json OwnSchema() const {
    const T standard{};
    std::vector<FieldSchema> fields;
    for (const Field<T>& row : rows_) {
      fields.push_back({row.name, row.value.schema, row.sentence, !row.missing.empty(),
                        row.value.show ? row.value.show(standard) : Json()});
    }
    return ObjectSchema(sentence_, fields);
  }
  Json Schema() const { return Named(name_, OwnSchema()); }

 private:
  std::string name_, sentence_;
  std::vector<Field<T>> rows_;
  NameList keys_;
};

/// A value with a reader of its own, a function of the node and of a T, and perhaps a writer.
template <class T>
FieldValue<T> By(Json schema, void (*read)(const JsonNode&, T&),
                 Json (*write)(const T&) = nullptr) {
  return {std::move(schema), read, nullptr, write};
}

/// The word that says of which kind an object is: read by who chose these fields for it.
template <class T>
FieldValue<T> Constant(const std::string& word) {
  return {ChoiceSchema({word}), nullptr, nullptr, [word](const T&) { return Json(word); }};
}

template <class T>
FieldValue<T> Number(double T::*member, Range range = {}) {
  return {NumberSchema(range),
          [=](const JsonNode& node, T& owner) { owner.*member = node.Number(range); },
          [=](const T& owner) {
            // beyond the range it stands for what no file can say
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

/// One of some names; `what` names the thing. The member is the name, or an enum or bool with the
/// name's index as its value.
template <class T, class Chosen>
FieldValue<T> Choice(Chosen T::*member, const NameList& names, std::string what) {
  return {ChoiceSchema(names.all()),
          [=](const JsonNode& node, T& owner) {
            const auto index = node.Choice(names, what);
            if (!index) return;
            if constexpr (std::same_as<Chosen, std::string>) {
              owner.*member = names.all()[static_cast<std::size_t>(*index)];
            } else {
              owner.*member = static_cast<Chosen>(*index);
            }
          },
          [=](const T& owner) {
            if constexpr (std::same_as<Chosen, std::string>) {
              return (owner.*member).empty() ? Json() : Json(owner.*member);
            } else {
              return Json(names.all()[static_cast<std::size_t>(owner.*member)]);
            }
          }};
}

/// One or several different names of enum values, which are the indices of the names.
template <class T, class Enum>
FieldValue<T> Choices(std::vector<Enum> T::*member, const NameList& names, std::string what) {
  return {OneOrMoreSchema(ChoiceSchema(names.all()), true),
          [=](const JsonNode& node, T& owner) {
            (owner.*member).clear();
            for (const std::size_t index : node.Choices(names, what)) {
              (owner.*member).push_back(static_cast<Enum>(index));
            }
          },
          [=](const T& owner) {
            const bool one = (owner.*member).size() == 1;
            return one ? Json(names.all()[static_cast<std::size_t>((owner.*member)[0])]) : Json();
          }};
}

/// One, several or a range.
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

template <class T, class Part>
FieldValue<T> Object(Part T::*member, const Fields<Part>& fields) {
  return {fields.Schema(), [member, &fields](const JsonNode& node, T& owner) {
            fields.Read(node, &(owner.*member));
          }};
}

/// An object whose fields go to the same struct.
template <class T>
FieldValue<T> Section(const Fields<T>& fields) {
  return {fields.Schema(), [&fields](const JsonNode& node, T& owner) { fields.Read(node, &owner); },
          nullptr,
          [&fields](const T& owner) {
            Json section = fields.Write(owner);
            return section.empty() ? Json() : section;
          }};
}

/// An array of objects; `what` names them.
template <class T, class Part>
FieldValue<T> ObjectList(std::vector<Part> T::*member, const Fields<Part>& fields,
                         std::string what) {
  return {ArraySchema(fields.Schema()), [=, &fields](const JsonNode& node, T& owner) {
            for (const JsonNode& element : node.Elements(what)) {
              fields.Read(element, &(owner.*member).emplace_back());
            }
          }};
}

// The top level of each kind of file: its keys, and what to say to a file of another kind.
//
// Internal to harness/config (see json_document.h).

/// True when `root` is an object that may be of this kind. Reports all else: no object, a document
/// that another kind knows more keys of ("found a mechanism (it has "bodies"), expected an
/// experiment"), another format, else every key that is not known, and a "$schema" that is no
/// string. Every kind may have that one: editors find the schema of a file by it, and nothing else
/// reads it.
bool ExpectDocument(const JsonNode& root, FileKind kind);

/// The rows of what every kind may have, before its own.
template <class T>
std::vector<Field<T>> DocumentRows(std::vector<Field<T>> own) {
  std::vector<Field<T>> rows = {
      {"$schema", TextSchema(), "Address of this schema, for editors."},
      {"format", IntegerSchema(kFileFormat, kFileFormat),
       "Of the file; a version of Loopbench that reads another refuses it by name."}};
  rows.insert(rows.end(), std::make_move_iterator(own.begin()), std::make_move_iterator(own.end()));
  return rows;
}

}  // namespace loopbench::harness
