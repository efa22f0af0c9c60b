// Fields of an experiment's document by JSON Pointer, for sweeps and --set.
//
// A pointer may go through the path of a scene's mechanism: the file is then taken into the
// document. "*" as an index goes through all elements of an array. Keys that the file leaves out
// are made, since they have defaults; what the reader does not know it will refuse. Internal to
// harness/config.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/config/experiment_sections.h"

namespace loopbench::harness {

/// Why a pointer names no field: in the words of a message, or a finished text.
struct FieldFault {
  std::string found, expected, suggestion;
  std::string text;      ///< of a mechanism file that cannot be read; the others are empty then
  bool of_file = false;  ///< of a mechanism file: who reads the scene will complain as well
};

/// The fields a pointer stands for, as pointers without "*".
struct FieldTargets {
  std::vector<std::string> pointers;
  std::vector<std::string> made;  ///< for each the outermost part that the file does not have
  std::optional<FieldFault> fault;
};

class ExperimentFields {
 public:
  /// `document` and `origins` change as files are taken in and values set.
  ExperimentFields(Json& document, Origins& origins, MechanismFiles& files)
      : document_(document), origins_(origins), files_(files) {}

  /// Takes in the files on the way. The document is otherwise as before.
  FieldTargets Find(const std::string& pointer);

  /// Sets one field that Find() gave.
  void Set(const std::string& pointer, const Json& value);

 private:
  void Walk(Json& node, const std::vector<std::string>& tokens, std::size_t depth,
            const std::string& pointer, FieldTargets* found);
  bool TakeIn(Json& node, const std::string& pointer, FieldTargets* found);

  Json& document_;
  Origins& origins_;
  MechanismFiles& files_;
};

/// The tokens of a JSON Pointer; nothing when it is none (no leading "/", "~" without 0 or 1).
std::optional<std::vector<std::string>> PointerTokens(const std::string& pointer);

}  // namespace loopbench::harness
