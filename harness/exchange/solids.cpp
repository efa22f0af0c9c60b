#include "harness/exchange/solids.h"

#include <cstring>
#include <tuple>

#include "harness/base/text.h"

namespace loopbench::harness {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using std::numbers::pi;

Solid FromMoments(double volume, const Vector3d& moments) {
  return {volume, Vector3d::Zero(), moments.asDiagonal()};
}

Vector3d SumsOfOthers(const Vector3d& v) { return {v.y() + v.z(), v.x() + v.z(), v.x() + v.y()}; }

/// A triangle of a hull with its plane, normal . r = height.
struct HullFace {
  std::array<int, 3> corners;
  Vector3d normal;
  double height;

  HullFace(const std::vector<Vector3d>& points, int a, int b, int c)
      : corners{a, b, c},
        normal((points[b] - points[a]).cross(points[c] - points[a]).normalized()),
        height(normal.dot(points[a])) {}
};

/// Returns four points that span the most volume, chosen one after the other; the last one lies
/// below the triangle of the first three. Empty if they lie in a plane.
std::vector<int> SpanningPoints(const std::vector<Vector3d>& points, double negligible) {
  std::vector<int> chosen;
  const auto add_farthest = [&](const auto& distance_of) {
    const auto farthest = std::ranges::max_element(points, {}, distance_of);
    if (!(distance_of(*farthest) > negligible)) return false;
    chosen.push_back(static_cast<int>(farthest - points.begin()));
    return true;
  };
  const auto at = [&](std::size_t i) -> const Vector3d& { return points[chosen[i]]; };
  chosen.push_back(0);
  if (!add_farthest([&](const Vector3d& p) { return (p - at(0)).norm(); })) return {};
  const Vector3d along = (at(1) - at(0)).normalized();
  if (!add_farthest([&](const Vector3d& p) { return along.cross(p - at(0)).norm(); })) return {};
  const Vector3d normal = along.cross(at(2) - at(0)).normalized();
  if (!add_farthest([&](const Vector3d& p) { return std::abs(normal.dot(p - at(0))); })) return {};
  if (normal.dot(at(3) - at(0)) > 0.0) std::swap(chosen[1], chosen[2]);
  return chosen;
}

/// Fails at a line of a file, or without a line.
[[noreturn]] void Fail(const std::filesystem::path& path, std::size_t line, std::string_view found,
                       std::string_view expected) {
  xml::FailIn(path.string(), static_cast<std::ptrdiff_t>(line), found, expected);
}

std::string ReadBytes(const std::filesystem::path& path) {
  constexpr std::uintmax_t kMost = 64 << 20;
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error || !std::filesystem::is_regular_file(path)) Fail(path, 0, "no such file", "a mesh");
  if (size > kMost) Fail(path, 0, fmt::format("{} bytes", size), "at most 64 MiB");
  return ReadFile(path);
}

/// Returns a mesh from the corners of its triangles, three for each; equal points become one.
TriangleMesh MeshOf(const std::vector<Vector3d>& corners) {
  TriangleMesh mesh;
  std::map<std::tuple<double, double, double>, int> known;
  std::array<int, 3> triangle = {};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector3d& p = corners[i];
    const auto [at, is_new] =
        known.try_emplace({p.x(), p.y(), p.z()}, static_cast<int>(mesh.points.size()));
    if (is_new) mesh.points.push_back(p);
    triangle[i % 3] = at->second;
    if (i % 3 == 2) mesh.triangles.push_back(triangle);
  }
  return mesh;
}

/// 80 bytes, the number of triangles, and for each the normal, three corners and two bytes.
TriangleMesh ReadBinaryStl(const std::filesystem::path& path, std::string_view bytes) {
  constexpr std::size_t kHeader = 84, kTriangle = 50;
  std::uint32_t count = 0;
  if (bytes.size() >= kHeader) std::memcpy(&count, bytes.data() + kHeader - 4, 4);
  if (bytes.size() != kHeader + kTriangle * count) {
    Fail(path, 0, fmt::format("{} bytes", bytes.size()),
         fmt::format("{} for {} triangles", kHeader + kTriangle * count, count));
  }
  std::vector<Vector3d> corners;
  for (std::size_t i = 0; i < count; ++i) {
    std::array<float, 9> values;
    std::memcpy(values.data(), bytes.data() + kHeader + kTriangle * i + 12, sizeof values);
    for (const float value : values) {
      if (!std::isfinite(value)) {
        Fail(path, 0, fmt::format("a corner that is not finite in triangle {}", i), "numbers");
      }
    }
    for (std::size_t k = 0; k < 9; k += 3) {
      corners.emplace_back(values[k], values[k + 1], values[k + 2]);
    }
  }
  return MeshOf(corners);
}

/// Calls `read` with the words and the number of each line.
template <class Read>
void ForEachLine(std::string_view text, const Read& read) {
  for (std::size_t line = 1; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::vector<std::string_view> words = xml::Words(text.substr(0, end));
    if (!words.empty()) read(words, line);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

Vector3d PointOf(const std::filesystem::path& path, std::size_t line,
                 const std::vector<std::string_view>& words) {
  Vector3d point;
  for (std::size_t k = 0; k < 3; ++k) {
    if (words.size() <= k + 1 || !xml::ReadNumber(words[k + 1], &point[k]) ||
        !std::isfinite(point[k])) {
      Fail(path, line, "a point without three numbers", "\"x y z\"");
    }
  }
  return point;
}

TriangleMesh ReadTextStl(const std::filesystem::path& path, std::string_view text) {
  std::vector<Vector3d> corners;
  ForEachLine(text, [&](const auto& words, std::size_t line) {
    if (words[0] == "vertex") corners.push_back(PointOf(path, line, words));
    if (words[0] == "endloop" && corners.size() % 3 != 0) {
      Fail(path, line, "a facet that is no triangle", "three points");
    }
  });
  return MeshOf(corners);
}

/// Points "v x y z" and polygons "f i j k ..." of point numbers from 1, or from -1 backwards, each
/// with further numbers after a slash. Polygons are fans of triangles from their first corner.
TriangleMesh ReadObj(const std::filesystem::path& path, std::string_view text) {
  std::vector<Vector3d> points, all;
  ForEachLine(text, [&](const auto& words, std::size_t line) {
    if (words[0] == "v") points.push_back(PointOf(path, line, words));
    if (words[0] != "f") return;
    const int count = static_cast<int>(points.size());
    std::vector<int> corners;
    for (std::size_t k = 1; k < words.size(); ++k) {
      int number = 0;
      const bool is_number = xml::ReadNumber(words[k].substr(0, words[k].find('/')), &number);
      if (!is_number || number == 0 || number > count || number < -count) {
        Fail(path, line, fmt::format("the corner \"{:.20}\"", words[k]),
             fmt::format("numbers of points, 1 to {} above this line", count));
      }
      corners.push_back(number > 0 ? number - 1 : count + number);
    }
    if (corners.size() < 3) Fail(path, line, "a face with fewer than 3 corners", "3 or more");
    for (std::size_t k = 2; k < corners.size(); ++k) {
      for (const int corner : {corners[0], corners[k - 1], corners[k]})
        all.push_back(points[corner]);
    }
  });
  TriangleMesh read = MeshOf(all);
  if (read.triangles.empty()) read.points = points;
  return read;
}

}  // namespace

Solid BoxOf(const Vector3d& half_sizes) {
  return FromMoments(8.0 * half_sizes.prod(), SumsOfOthers(half_sizes.cwiseAbs2()) / 3.0);
}

Solid EllipsoidOf(const Vector3d& semi_axes) {
  return FromMoments(4.0 / 3.0 * pi * semi_axes.prod(), SumsOfOthers(semi_axes.cwiseAbs2()) / 5.0);
}

Solid CylinderOf(double radius, double half) {
  const double across = radius * radius / 4.0 + half * half / 3.0;
  return FromMoments(2.0 * pi * radius * radius * half, {across, across, radius * radius / 2.0});
}

/// A cylinder with two hemispheres; their centres of mass are 3/8 radius beyond its ends.
Solid CapsuleOf(double radius, double half) {
  const Solid middle = CylinderOf(radius, half);
  const double ends = 4.0 / 3.0 * pi * radius * radius * radius;
  const double volume = middle.volume + ends;
  const double about_axis = 0.4 * radius * radius;
  const double across = about_axis + half * half + 0.75 * radius * half;
  const Vector3d of_ends(across, across, about_axis);
  return FromMoments(volume, (middle.volume * middle.inertia.diagonal() + ends * of_ends) / volume);
}

BodyDescription SumOf(const std::vector<PlacedSolid>& parts) {
  BodyDescription sum;
  const auto centre = [](const PlacedSolid& part) -> Vector3d {
    return part.X.p + part.X.q * part.solid.centre;
  };
  for (const PlacedSolid& part : parts) {
    sum.mass += part.mass;
    sum.com += part.mass * centre(part);
  }
  if (!(sum.mass > 0.0)) return {};
  sum.com /= sum.mass;
  for (const PlacedSolid& part : parts) {
    const Vector3d r = centre(part) - sum.com;
    sum.inertia += InTurnedAxes(part.X.q, part.mass * part.solid.inertia) +
                   part.mass * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
  }
  return sum;
}

// Meshes.

std::size_t NumOpenEdges(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> sides;  // triangles on one side less those on the other
  for (const auto& [a, b, c] : mesh.triangles) {
    for (const auto& [from, to] : {std::pair{a, b}, {b, c}, {c, a}}) {
      sides[std::minmax(from, to)] += from < to ? 1 : -1;
    }
  }
  return static_cast<std::size_t>(
      std::ranges::count_if(sides, [](const auto& side) { return side.second != 0; }));
}

/// Adds one point after the other: triangles that see it, or lie in a plane with it, are replaced
/// by those from their outline to the point. An edge in line with the point is within that outline.
TriangleMesh ConvexHullOf(const std::vector<Vector3d>& points) {
  TriangleMesh hull{points, {}};
  if (points.empty()) return hull;
  double extent = 0.0;
  for (const Vector3d& p : points) extent = std::max(extent, (p - points[0]).norm());
  const double negligible = 1e-12 * extent;  // of coordinates with some thousand eps
  const std::vector<int> base = SpanningPoints(points, negligible);
  if (base.empty()) return hull;
  const auto [a, b, c, d] = std::tuple{base[0], base[1], base[2], base[3]};
  std::vector<HullFace> faces = {
      {points, a, b, c}, {points, a, d, b}, {points, b, d, c}, {points, c, d, a}};
  for (int p = 0; p < static_cast<int>(points.size()); ++p) {
    const auto height = [&](const HullFace& face) {
      return face.normal.dot(points[p]) - face.height;
    };
    if (std::ranges::none_of(
            faces, [&](double h) { return h > negligible; }, height))
      continue;
    const auto seen = std::ranges::partition(
        faces, [&](double h) { return h < -negligible; }, height);
    std::set<std::pair<int, int>> outline;
    for (const HullFace& face : seen) {
      for (int i = 0; i < 3; ++i) {
        const std::pair edge{face.corners[i], face.corners[(i + 1) % 3]};
        if (outline.erase({edge.second, edge.first}) == 0) outline.insert(edge);
      }
    }
    faces.erase(seen.begin(), seen.end());
    for (const auto& [from, to] : outline) faces.emplace_back(points, from, to, p);
  }
  for (const HullFace& face : faces) hull.triangles.push_back(face.corners);
  return hull;
}

/// Sums pyramids from an apex over the triangles, first about the centroid of the surface, then
/// about the centre of mass, as in MuJoCo: kPyramids depends on the apex.
Solid SolidOf(const TriangleMesh& mesh, MeshRule rule) {
  /// Corners of a triangle from an origin.
  struct Corners {
    Vector3d a, b, c;
    double Area() const { return 0.5 * (b - a).cross(c - a).norm(); }
    Vector3d Middle() const { return (a + b + c) / 3.0; }
  };
  const auto corners = [&](const std::array<int, 3>& triangle, const Vector3d& origin) {
    return Corners{mesh.points[triangle[0]] - origin, mesh.points[triangle[1]] - origin,
                   mesh.points[triangle[2]] - origin};
  };
  const auto weight = [&](const Corners& at) {
    if (rule == MeshRule::kShell) return at.Area();
    const double volume = at.a.dot(at.b.cross(at.c)) / 6.0;
    return rule == MeshRule::kPyramids ? std::abs(volume) : volume;
  };
  const auto middle_of = [&](const Vector3d& origin, double share, const auto& weight_of) {
    Vector3d sum = Vector3d::Zero();
    double total = 0.0;
    for (const auto& triangle : mesh.triangles) {
      const Corners at = corners(triangle, origin);
      sum += weight_of(at) * share * at.Middle();
      total += weight_of(at);
    }
    return total != 0.0 ? Vector3d(origin + sum / total) : origin;
  };
  if (mesh.points.empty()) return {};
  const Vector3d centroid =
      middle_of(mesh.points[0], 1.0, [](const Corners& at) { return at.Area(); });
  Solid solid;
  solid.centre = rule == MeshRule::kShell ? centroid : middle_of(centroid, 0.75, weight);
  // integral of r r^T over a pyramid of volume V: V/20 (aa^T + bb^T + cc^T + ss^T), s = a + b + c;
  // over a triangle A/12 (...)
  const double share = rule == MeshRule::kShell ? 12.0 : 20.0;
  Matrix3d products = Matrix3d::Zero();
  for (const auto& triangle : mesh.triangles) {
    const Corners at = corners(triangle, solid.centre);
    const Vector3d s = at.a + at.b + at.c;
    solid.volume += weight(at);
    products += weight(at) / share *
                (at.a * at.a.transpose() + at.b * at.b.transpose() + at.c * at.c.transpose() +
                 s * s.transpose());
  }
  if (solid.volume != 0.0) {
    solid.inertia = (products.trace() * Matrix3d::Identity() - products) / solid.volume;
  }
  return solid;
}

TriangleMesh ReadMesh(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending != ".stl" && ending != ".obj") {
    Fail(path, 0, fmt::format("a mesh of type \"{}\"", ending), ".stl or .obj");
  }
  const std::string bytes = ReadBytes(path);
  const bool is_text = bytes.starts_with("solid") && bytes.find('\0') == std::string::npos;
  const TriangleMesh mesh = ending == ".obj" ? ReadObj(path, bytes)
                            : is_text        ? ReadTextStl(path, bytes)
                                             : ReadBinaryStl(path, bytes);
  if (mesh.points.empty()) Fail(path, 0, "no triangles", "a closed surface");
  return mesh;
}

}  // namespace loopbench::harness
