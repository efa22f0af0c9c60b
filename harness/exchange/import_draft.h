// A mechanism while it is imported, in whatever format: what the readers of the formats fill, and
// what is done with it afterwards.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/exchange/export_names.h"
#include "harness/exchange/import.h"
#include "harness/exchange/import_placement.h"
#include "harness/exchange/xml_file.h"

namespace loopbench::harness {

/// Why what nobody read has no place in a mechanism, by attribute ("@armature") or tag
/// ("visual"). Without a reason nothing is noted: it says nothing about the motion.
struct DroppedReason {
  std::string_view what, reason;
  bool changes_motion = false;
};

class ImportDraft {
 public:
  ImportDraft(const XmlFile& file, const ImportOptions& options);

  MechanismDescription description;
  std::vector<Placement> at_rest;  ///< of bodies in ground axes where all coordinates are 0

  /// A body of that name, or of the next free number where it is "". Refuses one that is taken.
  /// Mass 0 until it is set.
  int AddBody(const XmlElement& element, const std::string& name);
  /// The index of a body that must be there; `also` are further names of Ground.
  int BodyNamed(const XmlValue& value, const std::set<std::string>& also = {}) const;
  int BodyNamed(const std::string& name, const XmlElement& user) const;
  int LineOf(int body) const { return lines_[static_cast<std::size_t>(body)]; }

  /// A name that no joint has.
  std::string NewJointName(const XmlElement& element, const std::string& name);
  /// For the joint that is added next, which the file does not name: it is called `stem`, or nearly
  /// so where the file has a joint of that name. "" until all joints are read.
  std::string NameLater(const std::string& stem);
  /// From X_PF on `from` to X_QM on `to`. The joint stays where it is until the next one is added.
  JointDescription& AddJoint(const std::string& name, JointType type, int from,
                             const Placement& X_PF, int to, const Placement& X_QM);
  int last_joint() const { return static_cast<int>(description.joints.size()) - 1; }

  /// The body's mass stands in a file that is not read: if the body moves, `value` is rejected.
  void LeaveMass(int body, const XmlValue& value) { without_mass_.emplace_back(body, value); }
  /// As many times its weight, upwards: what a body without gravity feels.
  void AddLift(int body, double share);

  /// What the format takes where the file says nothing [m/s^2], along -z.
  void AssumeGravity(const XmlElement& element, double gravity);

  /// The numbers of a value by their `kinds`: 'a' an angle [rad], 'd' the 3 of a direction, 'q' the
  /// 4 of a quaternion, 'r' with its scalar last, 'n' others. Rounded ones are exact, and noted.
  std::vector<double> Numbers(const XmlValue& value, std::string_view kinds);
  /// 3 of them.
  Eigen::Vector3d Vector(const XmlValue& value, std::string_view kinds);

  void Note(const XmlElement& element, std::string reason, bool changes_motion = false);
  void Note(const XmlElement& element, const std::string& attribute, std::string reason,
            bool changes_motion = false);
  /// A note for all that was not read.
  void NoteUnread(std::span<const DroppedReason> reasons);

  /// Sidecar, floating parts, bodies that are fixed together, plane; then it is a mechanism.
  Imported Finish(const std::string& format);

 private:
  void NameJoints();
  void HoldFloatingParts();
  void CheckUnreadMasses() const;
  /// Merges bodies that are none by themselves with those that welds fix them to; with `whole`, all
  /// bodies that are fixed together with one of them.
  void MergeFixed(bool whole);
  /// Refuses masses and inertias of bodies that move, with all that was merged.
  void CheckMasses() const;
  void MakeBallsPins(const Eigen::Vector3d& n);
  void GoToPlane();

  const XmlFile& file_;
  const ImportOptions& options_;
  std::vector<XmlElement> elements_;  ///< of bodies; the root element for Ground
  std::vector<int> lines_;
  std::map<std::string, int> bodies_;
  exchange::UniqueNames joints_;
  std::vector<std::pair<std::size_t, std::string>> stems_;  ///< of joints without names
  std::vector<ImportNote> notes_;
  std::size_t rounded_ = 0, rounded_note_ = 0;  ///< values that were rounded; the note of the first
  std::vector<std::pair<int, double>> lifts_;
  std::vector<std::pair<int, XmlValue>> without_mass_;
  std::optional<XmlElement> assumed_gravity_;  ///< who would have had to say it
};

/// Of length 1; refuses one that is zero, which `value` says.
Eigen::Quaterniond UnitQuaternion(const XmlValue& value, const Eigen::Quaterniond& q);

/// The readers of the formats; each fills the draft from the root element.
void ReadMjcf(const XmlElement& root, ImportDraft* draft);
void ReadUrdf(const XmlElement& root, const ImportOptions& options, ImportDraft* draft);
void ReadSdf(const XmlElement& root, ImportDraft* draft);

}  // namespace loopbench::harness
