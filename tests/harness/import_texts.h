// Descriptions of other programs as text: what an importer makes of them, and what it says.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/exchange/import.h"
#include "mechanism/description/joint_frames.h"

namespace loopbench::harness {

/// The message of a refusal, "" for none.
inline std::string Refusal(const std::string& text, const ImportOptions& options = {}) {
  try {
    ImportText(text, "file.xml", options);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

/// Expects a refusal with all these words.
inline void ExpectRefusal(const std::string& text, const std::vector<std::string>& words,
                          const ImportOptions& options = {}) {
  const std::string message = Refusal(text, options);
  EXPECT_FALSE(message.empty()) << text;
  for (const std::string& word : words) {
    EXPECT_NE(message.find(word), std::string::npos) << "no <" << word << "> in " << message;
  }
}

/// Whether a note speaks of the element with this reason.
inline bool HasNote(const Imported& imported, const std::string& element,
                    const std::string& reason) {
  return std::ranges::any_of(imported.notes, [&](const ImportNote& note) {
    return note.element.find(element) != std::string::npos &&
           note.reason.find(reason) != std::string::npos && note.line > 0;
  });
}

inline void ExpectNote(const Imported& imported, const std::string& element,
                       const std::string& reason) {
  EXPECT_TRUE(HasNote(imported, element, reason)) << element << ": " << reason;
}

template <class Force>
std::vector<Force> ForcesOf(const Imported& imported) {
  std::vector<Force> forces;
  for (const ForceDescription& force : imported.description.forces) {
    if (const auto* one = std::get_if<Force>(&force)) forces.push_back(*one);
  }
  return forces;
}

}  // namespace loopbench::harness
