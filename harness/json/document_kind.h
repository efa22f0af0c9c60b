// The top level of each kind of file: its keys, and what to say to a file of another kind.
//
// Internal to harness/config (see json_document.h).
#pragma once

#include "harness/json/file_kind.h"
#include "harness/json/json_reader.h"

namespace loopbench::harness {

/// True when `root` is an object that may be of this kind. Reports all else: no object, a document
/// that another kind knows more keys of ("found a mechanism (it has "bodies"), expected an
/// experiment"), else every key that is not known, and a "$schema" that is no string. Every kind
/// may have that one: editors find the schema of a file by it, and nothing else reads it.
bool ExpectDocument(const JsonNode& root, FileKind kind);

}  // namespace loopbench::harness
