// Models of MuJoCo as text, of one body and of two, and what an importer makes of them.
#pragma once

#include <string>

#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_mjcf_texts {

inline constexpr double kEps = 1e-15;  // some units of rounding for lengths and angles of order one

inline const char* const kInertial = R"(<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>)";

/// A body with these joints, and what stands before and behind the world.
inline std::string Model(const std::string& joints, const std::string& before = "",
                         const std::string& after = "", const std::string& attributes = "") {
  return "<mujoco>" + before + "<worldbody><body name=\"b\" " + attributes + ">" + kInertial +
         joints + "</body></worldbody>" + after + "</mujoco>";
}

inline Imported Read(const std::string& joints, const std::string& before = "",
                     const std::string& after = "", const std::string& attributes = "") {
  return ImportText(Model(joints, before, after, attributes), "file.xml");
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
  return ImportText("<mujoco>" + std::string(kTwoBodies) + rest + "</mujoco>", "file.xml");
}

}  // namespace loopbench::harness::import_mjcf_texts
