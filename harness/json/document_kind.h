// The top level of each kind of file: its keys, and what to say to a file of another kind.
//
// Internal to harness/config (see json_document.h).
#pragma once

#include <iterator>
#include <utility>
#include <vector>

#include "harness/json/fields.h"
#include "harness/json/file_kind.h"
#include "harness/json/json_reader.h"
#include "harness/text/file_format.h"

namespace loopbench::harness {

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
