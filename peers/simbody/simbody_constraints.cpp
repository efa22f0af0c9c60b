#include "peers/simbody/simbody_constraints.h"

namespace loopbench::peers {
namespace {

using namespace SimTK;

/// One joint's two sides, and the conditions that joints are made of.
struct Closure {
  MobilizedBody &P, &Q;
  Transform F, M;

  /// Axis `a` of F stays perpendicular to axis `b` of M.
  void Perpendicular(const UnitVec3& a, const UnitVec3& b) {
    Constraint::ConstantAngle(P, a, Q, b, Pi / 2);
  }
  /// z of F and z of M stay parallel.
  void ParallelZ() {
    Perpendicular(F.z(), M.x());
    Perpendicular(F.z(), M.y());
  }
  void SamePoint() { Constraint::Ball(P, F.p(), Q, M.p()); }
  /// Mo stays on the line through Fo along an axis of F.
  void OnLine(const UnitVec3& along) { Constraint::PointOnLine(P, along, F.p(), Q, M.p()); }
  /// Mo stays in the plane through Fo across an axis of F.
  void InPlane(const UnitVec3& normal) {
    Constraint::PointInPlane(P, normal, dot(normal, F.p()), Q, M.p());
  }
  void SameOrientation() { Constraint::ConstantOrientation(P, F.R(), Q, M.R()); }
};

/// Within z = 0, which the tree keeps: along z every point is free to be where it is.
bool CloseInPlane(const std::string& kind, Closure& side) {
  if (kind == "revolute") {
    side.OnLine(side.F.z());
  } else if (kind == "pin-in-slot") {
    side.InPlane(side.F.y());
  } else if (kind == "prismatic") {
    side.InPlane(side.F.y());
    side.Perpendicular(side.F.x(), side.M.y());
  } else if (kind == "weld") {
    side.OnLine(side.F.z());
    side.Perpendicular(side.F.x(), side.M.y());
  } else {
    return false;
  }
  return true;
}

bool CloseInSpace(const std::string& kind, Closure& side) {
  if (kind == "revolute") {
    side.SamePoint();
    side.ParallelZ();
  } else if (kind == "prismatic") {
    side.OnLine(side.F.x());
    side.SameOrientation();
  } else if (kind == "weld") {
    Constraint::Weld(side.P, side.F, side.Q, side.M);
  } else if (kind == "pin-in-slot") {
    side.OnLine(side.F.x());
    side.ParallelZ();
  } else if (kind == "cylindrical") {
    side.OnLine(side.F.z());
    side.ParallelZ();
  } else if (kind == "spherical") {
    side.SamePoint();
  } else if (kind == "planar") {
    side.InPlane(side.F.z());
    side.ParallelZ();
  } else if (kind == "universal") {
    side.SamePoint();
    side.Perpendicular(side.F.x(), side.M.y());
  } else {
    return false;
  }
  return true;
}

/// Rotations about x and y of F, by z of M, which a free turn about z leaves; about z where there
/// is none.
void CloseAlong(const std::vector<int>& components, Closure& side) {
  for (const int component : components) {
    if (component == 0) side.Perpendicular(side.F.y(), side.M.z());
    if (component == 1) side.Perpendicular(side.F.x(), side.M.z());
    if (component == 2) side.Perpendicular(side.F.x(), side.M.y());
    if (component == 3) side.InPlane(side.F.x());
    if (component == 4) side.InPlane(side.F.y());
    if (component == 5) side.InPlane(side.F.z());
  }
}

}  // namespace

void AddConstraint(const Joint& joint, bool planar, MobilizedBody& P, MobilizedBody& Q) {
  if (joint.kind == "free") return;
  Closure side{P, Q, ToTransform(joint.F), ToTransform(joint.M)};
  if (joint.kind == "rod") {
    Constraint::Rod(P, side.F.p(), Q, side.M.p(), joint.parameter);
    return;
  }
  if (!planar && !joint.imposed.empty()) {
    CloseAlong(joint.imposed, side);
    return;
  }
  const bool closed = planar ? CloseInPlane(joint.kind, side) : CloseInSpace(joint.kind, side);
  if (!closed) {
    throw NotThere("joint \"" + joint.name + "\": " + joint.kind + ", which closes a loop");
  }
}

}  // namespace loopbench::peers
