// Masses of MuJoCo's shapes.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "harness/exchange/import_mjcf.h"

namespace loopbench::harness {

namespace {

using std::numbers::pi;

constexpr double kDensity = 1000.0;  // [kg/m^3], MuJoCo's default
/// Shapes of less [m^3] have no mass that is given, and masses of less [kg] do not count: mjEPS in
/// MuJoCo's src/user/user_objects.cc.
constexpr double kLeast = 1e-14;

/// Volume [m^3], and moments of inertia per mass [m^2] about its own axes; z is its axis.
struct Shape {
  double volume = 0.0;
  Eigen::Vector3d moments = Eigen::Vector3d::Zero();
};

Shape BoxOf(const Eigen::Vector3d& half) {
  const Eigen::Vector3d s = half.cwiseAbs2();
  return {8.0 * half.prod(), Eigen::Vector3d(s.y() + s.z(), s.x() + s.z(), s.x() + s.y()) / 3.0};
}

Shape EllipsoidOf(const Eigen::Vector3d& radii) {
  const Eigen::Vector3d s = radii.cwiseAbs2();
  return {4.0 / 3.0 * pi * radii.prod(),
          Eigen::Vector3d(s.y() + s.z(), s.x() + s.z(), s.x() + s.y()) / 5.0};
}

Shape CylinderOf(double radius, double half) {
  const double across = radius * radius / 4.0 + half * half / 3.0;
  return {2.0 * pi * radius * radius * half, {across, across, radius * radius / 2.0}};
}

/// A cylinder and two half balls, whose centres of mass are 3/8 of the radius beyond its ends.
Shape CapsuleOf(double radius, double half) {
  const Shape middle = CylinderOf(radius, half);
  const double ends = 4.0 / 3.0 * pi * radius * radius * radius;
  const double volume = middle.volume + ends;
  const double about_axis = 0.4 * radius * radius;
  const double across = about_axis + half * half + 0.75 * radius * half;
  const Eigen::Vector3d of_ends(across, across, about_axis);
  return {volume, (middle.volume * middle.moments + ends * of_ends) / volume};
}

/// How many numbers `size` has for each type, and how many with `fromto`.
struct SizeOf {
  std::size_t own, along;
};
const std::vector<std::string>& Types() {
  static const std::vector<std::string> types = {
      "sphere", "capsule", "cylinder", "box", "ellipsoid", "plane", "hfield", "mesh", "sdf"};
  return types;
}
constexpr SizeOf kSizes[] = {{1, 1}, {2, 1}, {2, 1}, {3, 1}, {3, 1}};

/// The geom's frame and its sizes; `fromto` gives the place, the axis and the half length.
std::vector<double> PlaceAndSize(const MjcfModel& model, const MjcfElement& geom, std::size_t type,
                                 Placement* X) {
  const auto size = geom.Attribute("size");
  const auto along = geom.Attribute("fromto");
  *X = model.PlacementOf(geom);
  if (!size) geom.own().Fail("no \"size\"", "the sizes of the shape");
  if (!along || type == 0) {
    std::vector<double> sizes = size->Numbers(kSizes[type].own, 3);
    sizes.resize(3);
    return sizes;
  }
  std::vector<double> sizes = size->Numbers(kSizes[type].along, 3);
  const std::vector<double> ends = along->Numbers(6, 6);
  const Eigen::Vector3d from(ends[0], ends[1], ends[2]), to(ends[3], ends[4], ends[5]);
  const double length = (to - from).norm();
  if (!(length > 0.0)) along->Fail("two different points");
  X->p = 0.5 * (from + to);
  // z along the line, from the second end to the first as MuJoCo has it: the shapes are symmetric
  X->q = TurnOfZ(to - from);
  if (type == 1 || type == 2) return {sizes[0], 0.5 * length, 0.0};
  return {sizes[0], sizes[0], 0.5 * length};
}

Shape ShapeOf(std::size_t type, const std::vector<double>& size) {
  if (type == 0) return EllipsoidOf(Eigen::Vector3d::Constant(size[0]));
  if (type == 1) return CapsuleOf(size[0], size[1]);
  if (type == 2) return CylinderOf(size[0], size[1]);
  const Eigen::Vector3d sizes(size[0], size[1], size[2]);
  return type == 3 ? BoxOf(sizes) : EllipsoidOf(sizes);
}

/// False for one that has no mass.
bool ReadGeom(const MjcfModel& model, const MjcfGeom& geom, bool drops_meshes,
              BodyDescription* read, Placement* X) {
  const MjcfElement& element = geom.element;
  const auto given = element.Attribute("type");
  const auto mesh = element.Attribute("mesh");
  const std::size_t type = given ? given->Choice(Types()) : 0;
  const auto mass = element.Attribute("mass");
  const double kg = mass ? mass->Number(kNotNegative) : -1.0;
  const double density = element.Number("density", kDensity, kNotNegative);
  const double group = element.Number("group", 0.0);
  if (group < model.settings.first_group || group > model.settings.last_group) return false;
  if (kg == 0.0 || (kg < 0.0 && density == 0.0)) return false;
  if (mesh || Types()[type] == "mesh" || Types()[type] == "sdf") {
    if (drops_meshes) return false;
    element.own().Fail("the mass of a mesh, whose file is not read",
                       "an <inertial> in the body, or another shape");
  }
  if (type >= std::size(kSizes)) return false;  // planes and height fields have no mass
  if (const auto shell = element.Attribute("shellinertia"); shell && shell->Bool()) {
    shell->Fail("false: the inertia of shells is not known here");
  }
  const std::vector<double> size = PlaceAndSize(model, element, type, X);
  const std::size_t numbers = type == 0 ? 1 : type <= 2 ? 2 : 3;
  for (std::size_t i = 0; i < numbers; ++i) {
    if (!(size[i] > 0.0)) element.own().Fail("a size that is not > 0", "sizes > 0");
  }
  const Shape shape = ShapeOf(type, size);
  if (kg > 0.0 && !(shape.volume > kLeast)) {
    model.draft->Note(element.own(), "mass",
                      fmt::format("dropped, as in MuJoCo: its shape has {:.2g} m^3, not more than "
                                  "{:.0e}",
                                  shape.volume, kLeast),
                      true);
    return false;
  }
  read->mass = kg > 0.0 ? kg : density * shape.volume;
  if (!(read->mass > kLeast)) return false;
  read->inertia = (read->mass * shape.moments).asDiagonal();
  return true;
}

}  // namespace

MassProperties MassOfGeoms(const MjcfModel& model, const std::vector<MjcfGeom>& geoms,
                           bool drops_meshes) {
  std::vector<std::pair<BodyDescription, Placement>> all;
  MassProperties sum;
  for (const MjcfGeom& geom : geoms) {
    BodyDescription part;
    Placement X;
    if (!ReadGeom(model, geom, drops_meshes, &part, &X)) continue;
    X = geom.X * X;
    sum.mass += part.mass;
    sum.com += part.mass * X.p;
    all.emplace_back(part, X);
  }
  if (!(sum.mass > 0.0)) return {};
  sum.com /= sum.mass;
  for (const auto& [part, X] : all) {
    const Eigen::Vector3d r = X.p - sum.com;
    sum.inertia += InTurnedAxes(X.q, part.inertia) +
                   part.mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
  }
  return sum;
}

}  // namespace loopbench::harness
