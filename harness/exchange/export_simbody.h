// A Model as Simbody's mobilizers, constraints and forces. The peer builds a System from this list,
// and WriteSimbodyProgram() writes a program that builds the same System. C++17, as model.h.
#pragma once

#include "harness/exchange/model.h"

namespace loopbench::exchange {

// Body frames are at centres of mass. Names and orders of arguments are those of Simbody's classes.

struct SimbodyMobilizer {
  std::string type;                    ///< "Pin": MobilizedBody::Pin
  std::size_t joint = 0;               ///< index into Model::tree
  bool is_flywheel = false;            ///< the joint's rotor, see SimbodyParts
  int parent = 0, child = 0;           ///< bodies of the model, then flywheels
  Frame on_parent, on_child;           ///< inboard and outboard frame
  bool reverse = false;                ///< MobilizedBody::Reverse
  double pitch = 0.0;                  ///< pitch of a Screw [m/rad]
  double sign = 1.0;                   ///< Model's coordinates and speeds = sign * Simbody's
  double mass = 0.0;                   ///< mass of the child [kg]
  std::array<double, 6> inertia = {};  ///< xx, yy, zz, xy, xz, yz [kg m^2]
};

enum class SimbodyConstraintType {
  kBall,                 ///< points F.p and M.p coincide
  kPointOnLine,          ///< M.p on the line through F.p along an axis of F
  kPointInPlane,         ///< M.p in the plane through F.p across an axis of F
  kConstantAngle,        ///< an axis of F perpendicular to one of M
  kConstantOrientation,  ///< axes of F and M parallel
  kWeld,
  kRod,  ///< F.p and M.p at a distance
};

struct SimbodyConstraint {
  SimbodyConstraintType type = SimbodyConstraintType::kBall;
  std::size_t joint = 0;             ///< index into Model::cut
  int axis_on_F = 0, axis_on_M = 0;  ///< x, y, z
};

/// The sum of factor times first coordinate over mobilizers, plus `constant`, is zero.
struct SimbodyCoupler {
  std::vector<std::pair<int, double>> terms;  ///< children of the mobilizers, factors
  double constant = 0.0;
};

enum class SimbodyForceType {
  kMobilityConstantForce,  ///< first mobilizer: effort
  kMobilityLinearSpring,   ///< stiffness, rest
  kMobilityLinearDamper,   ///< damping
  kConstantForce,          ///< force vector in ground axes at a point of the first body
  kTwoPointLinearSpring,   ///< stiffness, free length
  kTwoPointLinearDamper,   ///< damping
  kTwoPointConstantForce,  ///< positive values push apart
};

struct SimbodyForce {
  SimbodyForceType type = SimbodyForceType::kConstantForce;
  int first = 0, second = 0;          ///< bodies of the model
  Vec at_first = {}, at_second = {};  ///< points, or the vector of a force in `at_second`
  std::array<double, 2> numbers = {};
};

/// Simbody has no inertia of a coordinate. A rotor is therefore a flywheel on a pin of Ground, with
/// its centre of mass on the pin, whose angle a coupler keeps equal to the joint's coordinate.
struct SimbodyParts {
  std::vector<SimbodyMobilizer> mobilizers;  ///< in the order of Model::tree, then flywheels
  std::vector<SimbodyConstraint> constraints;
  std::vector<SimbodyCoupler> couplers;  ///< in the order of Model::couplings, then of flywheels
  std::vector<SimbodyForce> forces;      ///< without gravity
};

/// Throws Unsupported for unsupported parts: Model::missing, helical cut joints, forces in body
/// axes, inertias that no body can have.
SimbodyParts MakeSimbodyParts(const Model& model);

/// Returns a standalone C++17 program for Simbody 3.7, one .cpp file. Without arguments the program
/// prints the following as JSON at Model::q and Model::u: coordinates, speeds and accelerations of
/// all joints, positions of all bodies and named points. With a time [s] and an accuracy it prints
/// the same after integrating to that time. User names appear as string literals and comments, in
/// ASCII or escaped. Throws Unsupported for unsupported parts (see above).
ExportedFile WriteSimbodyProgram(const Model& model);

}  // namespace loopbench::exchange
