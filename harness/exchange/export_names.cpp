#include "harness/exchange/export_names.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "harness/base/text.h"
#include "mechanism/algebra/symmetric_eigen.h"

namespace loopbench::exchange {
namespace {

/// Applies `other` to text between tabs and line ends, and `of_break` to these.
template <class Other, class OfBreak>
std::string Between(std::string_view text, const Other& other, const OfBreak& of_break) {
  std::string made;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of("\t\n\r"), text.size());
    made += other(text.substr(0, end));
    if (end < text.size()) made += of_break(text[end]);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return made;
}

void Replace(std::string& text, std::string_view what, std::string_view by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) {
    text.replace(at, what.size(), by);
  }
}

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Returns the largest moment minus the sum of the others.
double Excess(const Vector3d& moments) { return 2.0 * moments.maxCoeff() - moments.sum(); }

double RoundOff(const Vector3d& moments) { return kMomentRoundOff * moments.maxCoeff(); }

}  // namespace

std::string XmlText(std::string_view text) {
  return Between(text, harness::EscapeTerminal, [](char c) { return std::string(1, c); });
}

std::string EscapeXmlAttribute(std::string_view text) {
  return Between(text, harness::EscapeXml, [](char c) { return fmt::format("&#{};", int{c}); });
}

std::string EscapeComment(std::string_view text) {
  std::string line = harness::EscapeTerminal(text);
  Replace(line, "--", "- -");
  Replace(line, "*/", "* /");
  Replace(line, "??", "? ?");
  if (line.ends_with('\\') || line.ends_with('-')) line += '.';
  return line;
}

std::string CommentLines(const std::string& begin, std::string_view text) {
  constexpr std::size_t kWidth = 96;
  const std::string line = EscapeComment(text);
  std::string made;
  for (std::size_t from = 0; from < line.size();) {
    std::size_t end = line.size();
    if (end - from > kWidth) {
      end = line.rfind(' ', from + kWidth);
      if (end == std::string::npos || end <= from)
        end = std::min(line.find(' ', from), line.size());
    }
    // a backslash at the end of a line would continue the comment
    std::string part = line.substr(from, end - from);
    if (part.ends_with('\\')) part += '.';
    made += (from == 0 ? begin : begin + "  ") + part + "\n";
    from = end + 1;
  }
  return made;
}

std::string CommentOfNotes(const std::string& begin, const std::vector<Note>& notes) {
  std::string said, lost;
  for (const Note& note : notes) (note.loss ? lost : said) += CommentLines(begin, "* " + note.text);
  const auto section = [&](const char* heading, const std::string& lines) {
    return lines.empty() ? "" : begin + heading + "\n" + lines;
  };
  return section("Said in other words, with the same motion:", said) +
         section("With a loss:", lost);
}

std::string QuoteCpp(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\' || c == '?') {
      quoted += '\\';
      quoted += c;
    } else if (byte < 0x20 || byte > 0x7e) {
      quoted += fmt::format("\\{:03o}", byte);
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

std::string NumberText(double value) {
  if (std::abs(value) < std::numeric_limits<double>::min()) return "0.0";
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string Fill(std::string text, const std::map<std::string, std::string>& words) {
  for (const auto& [word, value] : words) {
    const std::string mark = "@" + word + "@";
    for (std::size_t at = text.find(mark); at != std::string::npos;
         at = text.find(mark, at + value.size())) {
      text.replace(at, mark.size(), value);
    }
  }
  return text;
}

std::string UniqueNames::Take(const std::string& wanted) {
  const std::string name = wanted.empty() ? "unnamed" : wanted;
  if (Add(name)) return name;
  int& number = next_.try_emplace(name, 2).first->second;
  std::string free;
  do {
    free = fmt::format("{}_{}", name, number++);
  } while (!Add(free));
  return free;
}

std::string ShownKind(const Joint& joint) {
  return fmt::format("joint \"{}\": {}", joint.name, joint.kind);
}

PrincipalInertia PrincipalInertiaOf(const Body& body, bool planar) {
  const Matrix3d I = ToEigen(body.inertia);
  PrincipalInertia made;
  if (planar) {
    made.moments.setConstant(I(2, 2));
    return made;
  }
  made.moments = I.diagonal();
  if (!I.isDiagonal(0.0)) {
    MatrixX<double> A = I, U(3, 3);
    VectorX<double> lambda(3);
    SymmetricEigen<double>(A, U, lambda);
    made.moments = lambda;
    made.axes = U;
    if (made.axes.determinant() < 0.0) made.axes.col(0) *= -1.0;
  }
  const double excess = Excess(made.moments);
  if (excess > 0.0 && excess <= RoundOff(made.moments)) {
    Eigen::Index largest = 0;
    made.moments.maxCoeff(&largest);
    made.moments[(largest + 1) % 3] += 2.0 * excess;
  }
  return made;
}

std::string FaultOfInertia(const Body& body, bool planar) {
  const Vector3d moments = PrincipalInertiaOf(body, planar).moments;
  if (Excess(moments) <= RoundOff(moments)) return "";
  return fmt::format(
      "body \"{}\": principal moments of inertia {:.6g}, {:.6g} and {:.6g} kg m^2, "
      "which no body has: the largest is above the sum of the others",
      body.name, moments[0], moments[1], moments[2]);
}

}  // namespace loopbench::exchange
