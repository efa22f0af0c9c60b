// A mechanism as a C++ program of Simbody.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "harness/exchange/model.h"

namespace loopbench::exchange {

// What is the same in all programs for Simbody; internal to export_simbody.cpp.

/// From the comment on top to the declaration of `Mechanism`, whose constructor and SetStart()
/// follow.
std::string SimbodyHead(const std::string& name, const std::vector<Note>& notes);

/// What prints, integrates and reads arguments. It stands behind kJoints, kBodies and kPoints.
std::string SimbodyTail();

// A Model as Simbody's mobilizers, constraints and forces: one list, from which the peer builds a
// System and export_simbody.h writes a program that builds the same one. C++17, as model.h.
//
// Body frames are at centres of mass. Names are those of Simbody's classes, arguments stand in the
// order of their constructors.

struct SimbodyMobilizer {
  std::string type;                    ///< "Pin": MobilizedBody::Pin
  std::size_t joint = 0;               ///< of Model::tree
  int parent = 0, child = 0;           ///< bodies of the model
  Frame on_parent, on_child;           ///< inboard and outboard frame
  bool reverse = false;                ///< MobilizedBody::Reverse
  double pitch = 0.0;                  ///< of a Screw [m/rad]
  double sign = 1.0;                   ///< coordinates and speeds of ours = sign * Simbody's
  double mass = 0.0;                   ///< of the child [kg]
  std::array<double, 6> inertia = {};  ///< xx, yy, zz, xy, xz, yz [kg m^2]
};

enum class SimbodyConstraintType {
  kBall,                 ///< points F.p and M.p together
  kPointOnLine,          ///< M.p on the line through F.p along an axis of F
  kPointInPlane,         ///< M.p in the plane through F.p across an axis of F
  kConstantAngle,        ///< an axis of F perpendicular to one of M
  kConstantOrientation,  ///< axes of F and M parallel
  kWeld,
  kRod,  ///< F.p and M.p at a distance
};

struct SimbodyConstraint {
  SimbodyConstraintType type = SimbodyConstraintType::kBall;
  std::size_t joint = 0;             ///< of Model::cut
  int axis_on_F = 0, axis_on_M = 0;  ///< x, y, z
};

enum class SimbodyForceType {
  kMobilityConstantForce,  ///< first mobilizer: effort
  kMobilityLinearSpring,   ///< stiffness, rest
  kMobilityLinearDamper,   ///< damping
  kConstantForce,          ///< a vector in ground axes at a point of the first body
  kTwoPointLinearSpring,   ///< stiffness, free length
  kTwoPointLinearDamper,   ///< damping
  kTwoPointConstantForce,  ///< positive ones push apart
};

struct SimbodyForce {
  SimbodyForceType type = SimbodyForceType::kConstantForce;
  int first = 0, second = 0;          ///< bodies of the model
  Vec at_first = {}, at_second = {};  ///< points, or the vector of a force in `at_second`
  std::array<double, 2> numbers = {};
};

struct SimbodyParts {
  std::vector<SimbodyMobilizer> mobilizers;  ///< in the order of Model::tree
  std::vector<SimbodyConstraint> constraints;
  std::vector<SimbodyForce> forces;  ///< without gravity
};

/// Throws NotThere for what Simbody does not have here: Model::missing, helical joints that close a
/// loop, forces in axes of a body, moments of inertia that no body has.
SimbodyParts MakeSimbodyParts(const Model& model);

// A Model as a C++17 program of its own that builds it in Simbody 3.7.

struct SimbodyProgramText {
  std::string program;  ///< one .cpp file
  std::vector<Note> notes;
};

/// Without arguments the program prints coordinates, speeds and accelerations of all joints and the
/// places of all bodies and named points at Model::q and Model::u, as JSON; with a time [s] and an
/// accuracy the same after it has integrated to there. Users' names stand in it as string literals
/// and in comments, in ASCII or escaped. Throws NotThere for what Simbody does not have here
/// (export_simbody.h).
SimbodyProgramText WriteSimbodyProgram(const Model& model);

}  // namespace loopbench::exchange
