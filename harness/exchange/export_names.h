// Names and inertias for other programs.
#pragma once

#include <Eigen/Core>
#include <map>
#include <set>
#include <string_view>

#include "harness/exchange/model.h"

namespace loopbench::exchange {

/// Tolerance of principal moments of inertia, relative to the largest: round-off.
inline constexpr double kMomentRoundOff = 0x1p-46;  // 64 units of round-off

// Numbers of a model as vectors and matrices of Eigen.

inline Vec ToVec(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }
inline Eigen::Vector3d ToEigen(const Vec& v) { return {v[0], v[1], v[2]}; }
inline Matrix ToMatrix(const Eigen::Matrix3d& A) {
  return {A(0, 0), A(0, 1), A(0, 2), A(1, 0), A(1, 1), A(1, 2), A(2, 0), A(2, 1), A(2, 2)};
}
inline Eigen::Matrix3d ToEigen(const Matrix& A) {
  return Eigen::Matrix3d{{A[0], A[1], A[2]}, {A[3], A[4], A[5]}, {A[6], A[7], A[8]}};
}

// User names in exported documents and programs: unchanged if the language allows it, never code.

/// Returns the text for an XML attribute: escaped by EscapeTerminal() except tabs and line ends.
std::string XmlText(std::string_view text);

/// Returns such a text escaped for use between the quotation marks of an attribute.
std::string EscapeXmlAttribute(std::string_view text);

/// Returns a comment line for XML or C++ `//`; its text cannot end it or go on in the next line.
std::string EscapeComment(std::string_view text);

/// Returns comment lines of a long text, wrapped at spaces, each after `begin`.
std::string CommentLines(const std::string& begin, std::string_view text);

/// Returns all notes; notes with a loss follow a heading of their own.
std::string CommentOfNotes(const std::string& begin, const std::vector<Note>& notes);

/// Returns a C++ string literal in ASCII. Escapes question marks too: two begin a trigraph.
std::string QuoteCpp(std::string_view text);

/// Returns the shortest text that reads back as this number, always with a point or an exponent.
/// Subnormal numbers, which stream readers reject, become zero.
std::string NumberText(double value);

/// Returns the text with each @WORD@ replaced by its value.
std::string Fill(std::string text, const std::map<std::string, std::string>& words);

/// Returns the text of templates/NAME.in, which the build embeds: "model.h".
std::string_view Template(std::string_view name);
/// Returns that text with each @WORD@ replaced by its value.
inline std::string Filled(std::string_view name, const std::map<std::string, std::string>& words) {
  return Fill(std::string(Template(name)), words);
}

/// Names that are unique within a document.
class UniqueNames {
 public:
  explicit UniqueNames(std::set<std::string> taken = {}) : taken_(std::move(taken)) {}

  /// False if it is taken already.
  bool Add(const std::string& name) { return taken_.insert(name).second; }
  /// Returns `wanted`; if taken, with suffix "_2", "_3" ..; "unnamed" for "".
  std::string Take(const std::string& wanted);

 private:
  std::set<std::string> taken_;
  std::map<std::string, int> next_;  ///< next suffix of a repeated name
};

/// Returns, for a message: joint "elbow": revolute.
std::string ShownKind(const Joint& joint);

/// Note on planar mechanisms.
inline constexpr const char* kPlaneNote =
    "The plane is z = 0 of space. Moments of inertia about x and y do not affect the motion; they "
    "are set to those about z.";

// Inertia properties for other programs: principal moments and axes.

struct PrincipalInertia {
  Eigen::Vector3d moments;                             ///< [kg m^2]
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< in body axes, right-handed
};

/// Returns principal moments and axes; for a planar body the moment about z for all three, since
/// the others have no effect. Corrects round-off violations of the triangle inequality.
PrincipalInertia PrincipalInertiaOf(const Body& body, bool planar);

/// Returns "", or: body "rod": moments of inertia 1, 1 and 3 kg m^2, which no body has.
std::string FaultOfInertia(const Body& body, bool planar);

}  // namespace loopbench::exchange
