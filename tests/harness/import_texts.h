// Descriptions of other programs as text, their imports, and messages of importers. Texts
// and expected words may have ' in place of ".
#pragma once

#include "harness/base/text.h"
#include "harness/exchange/import.h"
#include "mechanism/description/joint_frames.h"
#include "tests/harness/places.h"

namespace loopbench::harness {

inline Imported ImportOf(const std::string& text, const ImportOptions& options = {}) {
  return ImportText(text, "file.xml", options);
}

/// The message of a refusal, "" for none.
inline std::string Refusal(const std::string& text, const ImportOptions& options = {}) {
  return MessageOf([&] { ImportOf(text, options); });
}

/// Whether a text contains these words, as they are or with " for '.
inline bool Says(const std::string& text, std::string words) {
  if (text.find(words) != std::string::npos) return true;
  std::ranges::replace(words, '\'', '"');
  return text.find(words) != std::string::npos;
}
inline void ExpectSaid(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    EXPECT_TRUE(Says(text, word)) << "no <" << word << "> in\n" << text;
  }
}

/// Expects a refusal with all these words.
inline void ExpectRefusal(const std::string& text, const std::vector<std::string>& words,
                          const ImportOptions& options = {}) {
  const std::string message = Refusal(text, options);
  EXPECT_FALSE(message.empty()) << text;
  ExpectSaid(message, words);
}

/// Whether a note speaks of the element with this reason.
inline bool HasNote(const Imported& imported, const std::string& element,
                    const std::string& reason) {
  return std::ranges::any_of(imported.notes, [&](const ImportNote& note) {
    return Says(note.element, element) && Says(note.reason, reason) && note.line > 0;
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

inline const JointDescription& JointNamed(const Imported& imported, const std::string& name) {
  return *std::ranges::find(imported.description.joints, name, &JointDescription::name);
}

inline void ExpectNear(const Eigen::Vector3d& given, const Eigen::Vector3d& expected,
                       double tolerance) {
  EXPECT_LE((given - expected).norm(), tolerance) << given.transpose();
}

/// Expects the only coupling: coordinates with their factors, and the offset.
inline void ExpectCoupling(const Imported& imported, const std::string& name,
                           const std::vector<std::pair<std::string, double>>& parts,
                           double offset) {
  ASSERT_EQ(imported.description.couplings.size(), 1u);
  const CouplingDescription& coupling = imported.description.couplings[0];
  EXPECT_EQ(coupling.name, name);
  EXPECT_EQ(coupling.offset, offset);
  ASSERT_EQ(coupling.parts.size(), parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    EXPECT_EQ(imported.description.joints[coupling.parts[i].joint].name, parts[i].first);
    EXPECT_EQ(coupling.parts[i].ratio, parts[i].second);
  }
}

/// A joint of SDF.
inline std::string SdfJoint(const std::string& name, const std::string& type,
                            const std::string& parent, const std::string& child,
                            const std::string& inside = "<axis/>") {
  return "<joint name='" + name + "' type='" + type + "'><parent>" + parent + "</parent><child>" +
         child + "</child>" + inside + "</joint>\n";
}

/// A folder "model" with a main file and others.
class ModelFolder : public testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) const {
    WriteFileAtomically(model_ / name, text);
  }
  Imported Read(const std::string& name = "main.xml") const {
    return ImportMechanism(model_ / name);
  }
  std::string Message() const {
    return MessageOf([&] { Read(); });
  }
  void ExpectMessage(const std::vector<std::string>& words) const { ExpectSaid(Message(), words); }

  const TemporaryFolder folder_{"loopbench-import"};
  const std::filesystem::path model_ = folder_.path() / "model";
};

// Models of MuJoCo of one body and of two.
namespace import_mjcf_texts {

inline constexpr double kEps = 1e-15;  // some units of rounding for lengths and angles of order one

inline const char* const kInertial = R"(<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>)";

/// A body with these joints, and what stands before and behind the world.
inline std::string Model(const std::string& joints, const std::string& before = "",
                         const std::string& after = "", const std::string& attributes = "") {
  return "<mujoco>" + before + "<worldbody><body name='b' " + attributes + ">" + kInertial +
         joints + "</body></worldbody>" + after + "</mujoco>";
}

inline Imported Read(const std::string& joints, const std::string& before = "",
                     const std::string& after = "", const std::string& attributes = "") {
  return ImportOf(Model(joints, before, after, attributes));
}

/// Two bodies on hinges "j" and "k", and sites.
inline const char* const kTwoBodies = R"(<worldbody>
  <site name="s0" pos="0 0 3"/>
  <body name="a" pos="1 0 0"><joint name="j" axis="0 1 0"/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><site name="s1" pos="0 0 1"/></body>
  <body name="b" pos="0 2 0" euler="0 0 90"><joint name="k" axis="0 1 0"/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><site name="s2" pos="1 0 0"/></body>
</worldbody>)";

inline Imported Two(const std::string& rest) {
  return ImportOf("<mujoco>" + std::string(kTwoBodies) + rest + "</mujoco>");
}

}  // namespace import_mjcf_texts
}  // namespace loopbench::harness
