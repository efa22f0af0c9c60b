#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "mechanism/start/closure.h"

namespace loopbench {

namespace {

constexpr std::size_t kMaxNames = 4;
/// Smaller residuals, relative to the largest, are left by any finished iteration.
constexpr double kSmallest = 1e-3;

std::string Short(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

/// "a, b and c", and how many more there are.
std::string Listed(const std::vector<std::string>& names) {
  const std::size_t shown = std::min(names.size(), kMaxNames), left = names.size() - shown;
  std::string text;
  for (std::size_t i = 0; i < shown; ++i) {
    const bool last = i + 1 == shown && left == 0;
    text += (i == 0 ? "" : last ? " and " : ", ") + names[i];
  }
  return left == 0 ? text : text + " and " + std::to_string(left) + " more";
}

/// The largest residual of one joint, or of a coupling.
struct OfJoint {
  int joint = 0;
  int coupling = -1;
  double scaled = 0.0, value = 0.0;  ///< in units, in SI
  bool length = false;
  bool rod = false;
};

template <class Space>
class Conflict {
 public:
  Conflict(const MechanismDescription& description, const Kinematics<Space, double>& kinematics,
           const UnsatisfiedConstraints& unmet)
      : description_(description),
        mechanism_(kinematics.mechanism()),
        kinematics_(kinematics),
        unmet_(unmet) {}

  std::string Describe() {
    for (int index : mechanism_.constraints()) AddConstraint(index);
    std::vector<OfJoint> couplings;
    for (int c = 0; c < static_cast<int>(mechanism_.couplings().size()); ++c) {
      const int first = mechanism_.couplings()[c].parts.front().joint;
      OfJoint coupling{.joint = first, .coupling = c};
      Add(mechanism_.num_rows() + c, kinematics_.joints()[first].basis[0], coupling);
      coupling.value /= std::abs(mechanism_.couplings()[c].parts.front().ratio);
      couplings.push_back(coupling);
    }
    int row = mechanism_.num_equations();
    for (const auto& [index, component] : unmet_.extra) {
      Add(row++, kinematics_.joints()[index].H(component),
          *std::ranges::find(found_, index, &OfJoint::joint));
    }
    found_.insert(found_.end(), couplings.begin(), couplings.end());
    double largest = 0.0;
    for (const OfJoint& one : found_) largest = std::max(largest, one.scaled);
    std::erase_if(found_, [&](const OfJoint& one) { return one.scaled < kSmallest * largest; });
    std::ranges::stable_sort(found_, [](const OfJoint& a, const OfJoint& b) {
      return a.rod != b.rod ? a.rod : a.scaled > b.scaled;
    });
    return Sentence() + Given() + Hint();
  }

 private:
  std::string Hint() const {
    if (!(unmet_.accuracy < kHintFactor * description_.accuracy)) return "";
    char hint[64];
    std::snprintf(hint, sizeof hint, "; %s with an \"accuracy\" of %.1e",
                  unmet_.speeds ? "they fit" : "it closes", 1.05 * unmet_.accuracy);
    return hint;
  }

  void Add(int row, const Direction<Space, double>& direction, OfJoint& joint) {
    const double scaled = std::abs(unmet_.rows[row]);
    if (scaled < joint.scaled) return;
    joint.scaled = scaled;
    joint.value = scaled * unmet_.units[row];
    joint.length = !direction.linear.isZero();
  }

  void AddConstraint(int index) {
    const Joint<Space, double>& joint = mechanism_.joints()[index];
    const JointType type = description_.joints[joint.description].type;
    found_.push_back({.joint = index, .rod = type == JointType::kRod});
    for (int r = 0; r < joint.num_constraints(); ++r) {
      Add(joint.row + r, kinematics_.joints()[index].D(r), found_.back());
    }
  }

  std::string Sentence() const {
    std::vector<std::string> names, residuals;
    for (const OfJoint& one : found_) {
      const JointDescription& joint =
          description_.joints[mechanism_.joints()[one.joint].description];
      std::string name = (one.rod ? "rod \"" : "joint \"") + joint.name + '"';
      if (one.coupling >= 0) name = "coupling \"" + mechanism_.couplings()[one.coupling].name + '"';
      if (one.rod) name += " (length " + Short(joint.parameter) + " m)";
      names.push_back(name);
      residuals.push_back(Short(one.value) + (one.length ? " m" : " rad") +
                          (unmet_.speeds ? "/s" : ""));
    }
    const bool one = names.size() == 1;
    return std::string(one ? "the loop closed by " : "the loops closed by ") + Listed(names) +
           (unmet_.speeds ? (one ? " has no speeds that fit" : " have no speeds that fit together")
                          : (one ? " does not close" : " do not close together")) +
           (one ? ": residual " : ": residuals ") + Listed(residuals);
  }

  /// Lists the fixed and prescribed joints of the loops, which may need a change.
  std::string Given() const {
    std::set<int> joints;  // of the description, in its order
    for (const OfJoint& one : found_) {
      if (one.coupling >= 0) {
        for (const auto& [index, ratio] : mechanism_.couplings()[one.coupling].parts) {
          joints.insert(index);
        }
        continue;
      }
      const Joint<Space, double>& joint = mechanism_.joints()[one.joint];
      joints.insert(joint.description);
      const auto ways = WaysOfLoop(mechanism_, one.joint);
      for (const std::vector<TreeStep>& way : {ways.first, ways.second}) {
        for (const TreeStep& step : way) {
          const int described = mechanism_.joints()[step.joint].description;
          if (described >= 0) joints.insert(described);
        }
      }
    }
    std::vector<std::string> prescribed, held, given;
    const InitialDescription& initial = description_.initial;
    for (const int j : joints) {
      const std::string name = '"' + description_.joints[j].name + '"';
      if (!description_.joints[j].motions.empty()) prescribed.push_back(name);
      if (initial.IsHeld(j)) held.push_back(name);
      if (std::ranges::find(initial.speeds, j, &JointValues::joint) != initial.speeds.end()) {
        given.push_back(name);
      }
    }
    std::string text;
    if (!prescribed.empty()) text += "; prescribed in it: " + Listed(prescribed);
    if (!unmet_.speeds && !held.empty()) text += "; held in it: " + Listed(held);
    if (unmet_.speeds && !given.empty()) text += "; speeds given in it: " + Listed(given);
    return text;
  }

  const MechanismDescription& description_;
  const Mechanism<Space, double>& mechanism_;
  const Kinematics<Space, double>& kinematics_;
  const UnsatisfiedConstraints& unmet_;
  std::vector<OfJoint> found_;
};

}  // namespace

template <class Space>
std::string DescribeConflict(const MechanismDescription& description,
                             const Kinematics<Space, double>& kinematics,
                             const UnsatisfiedConstraints& unmet) {
  return Conflict<Space>(description, kinematics, unmet).Describe();
}

template std::string DescribeConflict(const MechanismDescription&,
                                      const Kinematics<Planar, double>&,
                                      const UnsatisfiedConstraints&);
template std::string DescribeConflict(const MechanismDescription&,
                                      const Kinematics<Spatial, double>&,
                                      const UnsatisfiedConstraints&);

}  // namespace loopbench
