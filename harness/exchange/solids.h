// Mass properties of solids of uniform density: shapes of MJCF and SDF, and triangle meshes.
#pragma once

#include <array>

#include "harness/exchange/import_draft.h"

namespace loopbench::harness {

struct Solid {
  double volume = 0.0;                                ///< [m^3]; area [m^2] of a shell
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();   ///< of mass [m]
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< per mass, about the centre [m^2]
};

Solid BoxOf(const Eigen::Vector3d& half_sizes);
Solid EllipsoidOf(const Eigen::Vector3d& semi_axes);
/// Return shapes about z; `half`: half the length of the cylinder.
Solid CylinderOf(double radius, double half);
Solid CapsuleOf(double radius, double half);

struct TriangleMesh {
  std::vector<Eigen::Vector3d> points;        ///< [m]
  std::vector<std::array<int, 3>> triangles;  ///< counter-clockwise, seen from outside
};

/// Reads a file: STL (binary or text) or Wavefront OBJ, by its ending; an OBJ file may have points
/// alone. Throws ConfigError for others, for faults with the line, and for files above 64 MiB.
TriangleMesh ReadMesh(const std::filesystem::path& path);

/// Returns the number of edges without just one triangle on each side; 0 for a closed mesh.
std::size_t NumOpenEdges(const TriangleMesh& mesh);

/// Returns the convex hull of points in O(points times triangles); no triangles for a plane.
TriangleMesh ConvexHullOf(const std::vector<Eigen::Vector3d>& points);
inline constexpr std::size_t kMostHullPoints = 10000;  ///< some seconds

/// Rules for the mass of a mesh.
enum class MeshRule {
  kEnclosed,  ///< of the enclosed volume
  kPyramids,  ///< of the pyramids from the surface's centroid, even where they are outside
  kShell,     ///< of the surface
};
/// Returns no volume for an empty mesh, and a negative one if triangles point inwards.
Solid SolidOf(const TriangleMesh& mesh, MeshRule rule);

struct PlacedSolid {
  double mass = 0.0;  ///< [kg]
  Solid solid;
  Placement X;  ///< its frame in the body
};
/// Returns mass, centre of mass and inertia of a body; all 0 without mass.
BodyDescription SumOf(const std::vector<PlacedSolid>& parts);

}  // namespace loopbench::harness
