// Names and bodies as other programs take them.
#pragma once

#include <Eigen/Core>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/exchange/model.h"

namespace loopbench::exchange {

// Names of users in documents and programs for others: the same text where the language has it, and
// never an instruction.

/// The text as an attribute of XML may have it: what EscapeTerminal() shows is shown, but for tabs
/// and line ends, which stay.
std::string XmlText(std::string_view text);

/// Such a text between the quotation marks of an attribute.
std::string EscapeXmlAttribute(std::string_view text);

/// A line of a comment, of XML or behind `//` of C++: nothing in it ends the comment or goes on in
/// the next line.
std::string EscapeComment(std::string_view text);

/// Such lines of a text that may be long, broken at spaces, each behind `begin`.
std::string CommentLines(const std::string& begin, std::string_view text);

/// All notes, those with a loss behind a heading of their own.
std::string CommentOfNotes(const std::string& begin, const std::vector<Note>& notes);

/// A string literal of C++ with its quotation marks, in ASCII. The question mark is escaped too:
/// two of them begin a trigraph.
std::string QuoteCpp(std::string_view text);

/// The shortest text that reads back as this number, always with a point or an exponent. Numbers
/// below the smallest normal one, which readers of streams refuse, are zero.
std::string NumberText(double value);

/// Names that a document has once each.
class UniqueNames {
 public:
  explicit UniqueNames(std::set<std::string> taken = {}) : taken_(std::move(taken)) {}

  /// False if it is taken already.
  bool Add(const std::string& name) { return taken_.insert(name).second; }
  /// `wanted`, or that with "_2", "_3" .. behind it where it is taken; "unnamed" for "".
  std::string Take(const std::string& wanted);

 private:
  std::set<std::string> taken_;
  std::map<std::string, int> next_;  ///< number of a name that was wanted before
};

// What programs ask of a body's inertia, and its principal axes.

struct PrincipalInertia {
  Eigen::Vector3d moments;                             ///< [kg m^2]
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< in body axes, right-handed
};

/// Of a planar body the moment about z for all three: of the others the motion says nothing. What
/// rounding takes from the triangle inequality is given back.
PrincipalInertia PrincipalInertiaOf(const Body& body, bool planar);

/// "" or: body "rod": moments of inertia 1, 1 and 3 kg m^2, which no body has.
std::string FaultOfInertia(const Body& body, bool planar);

}  // namespace loopbench::exchange
