// Outlines of bodies: the convex hull of the points where others are attached.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace loopbench::harness {

/// Faces of the convex hull as lists of indices into `points`: none for a single place, one of two
/// corners where all are in line, one polygon where all are in a plane, else triangles. Points
/// nearer than `tolerance` [m] are one. Above 24 points in space: the polygons of no volume are not
/// sought, and there are no faces.
std::vector<std::vector<int>> HullFaces(const std::vector<Eigen::Vector3d>& points,
                                        double tolerance);

}  // namespace loopbench::harness
