// The writer of MJCF documents; internal to export_mjcf*.cpp.
#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "harness/exchange/export_mjcf.h"
#include "harness/exchange/export_mjcf_joints.h"
#include "harness/exchange/export_names.h"

namespace loopbench::exchange {

/// ` name="1.0 2.0"`.
template <class Range>
std::string Attribute(const char* name, const Range& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + NumberText(value);
  return fmt::format(" {}=\"{}\"", name, text);
}
inline std::string Attribute(const char* name, double value) {
  return Attribute(name, std::array<double, 1>{value});
}
/// The same of a name.
inline std::string Named(const char* attribute, const std::string& name) {
  return fmt::format(" {}=\"{}\"", attribute, EscapeXmlAttribute(name));
}
/// Of an actuator whose force is a constant, whatever is said to it.
inline std::string Constant(double force) {
  return R"( gaintype="fixed" gainprm="0.0" biastype="affine")" +
         Attribute("biasprm", std::array{force, 0.0, 0.0});
}
inline Vec ToVec(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

class MjcfWriter {
 public:
  MjcfWriter(const Model& model, const MjcfOptions& options);

  Mjcf Write();

 private:
  static std::size_t At(int index) { return static_cast<std::size_t>(index); }

  void Say(const std::string& text) { made_.notes.push_back({false, text}); }
  /// `name`, which stands for the user's `given`: says so where it is another one.
  std::string Renamed(const char* what, const std::string& given, std::string name);

  void NameBodies();
  void AddPoints();
  /// The name of a new site.
  std::string AddSite(int body, const Eigen::Vector3d& at, const std::string& wanted);

  // bodies and their joints (export_mjcf.cpp)
  void AddBody(std::size_t index, int depth, std::string& text);
  std::string Inertial(int index) const;
  void AddJoint(std::size_t index, const MjcfChain& chain, const std::string& indent,
                std::string& text);
  /// Springs and dampers along a tree joint as attributes, constants as an actuator of `name`.
  std::string AddEfforts(std::size_t index, const std::string& name);
  void AddCoordinate(const Joint& joint, const MjcfChain& chain, const MjcfPart& part);
  void SayParts(const Joint& joint, const std::vector<std::string>& names);

  // what holds or acts between bodies (export_mjcf_closures.cpp)
  /// Points that the joint holds together: one for a pivot, more along its axes for orientations.
  void AddClosures(const Joint& joint);
  void AddClosure(const Joint& joint, const Eigen::Vector3d& at, const std::string& name);
  void AddTendon(const std::string& name, int from, const Eigen::Vector3d& at_from, int to,
                 const Eigen::Vector3d& at_to, const std::string& attributes);
  void AddSpringDamper(std::size_t index);
  void AddPointForce(std::size_t index);
  void AddNotes();

  const Model& model_;
  const MjcfOptions options_;
  std::vector<std::vector<std::size_t>> children_;        ///< tree joints below each body
  std::vector<std::vector<std::string>> sites_, shapes_;  ///< by body
  std::vector<std::string> body_names_;
  UniqueNames site_names_, joint_names_, closure_names_;
  std::string tendons_, equalities_, actuators_;
  std::vector<double> qpos_, qvel_;
  Mjcf made_;
};

/// Everything of the model that MJCF does not have.
std::vector<std::string> MissingInMjcf(const Model& model);

}  // namespace loopbench::exchange
