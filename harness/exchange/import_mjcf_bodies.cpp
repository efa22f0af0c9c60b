// <worldbody>: bodies, their masses and their sites.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "harness/exchange/import_mjcf.h"
#include "mechanism/algebra/symmetric_eigen.h"

namespace loopbench::harness {

namespace {

/// A child of a body, its enclosing frame, and its default class.
struct Placed {
  XmlElement element;
  Placement X;
  std::string childclass;
};

/// Contents of a body, without intermediate <frame> elements.
struct Contents {
  std::vector<Placed> bodies, geoms, sites, joints;
};

std::string ClassWithin(const MjcfModel& model, const XmlElement& element,
                        const std::string& around) {
  const auto given = element.Attribute("childclass");
  if (!given) return around;
  model.defaults.CheckClass(*given);
  return given->text();
}

/// Collects contents in file order, inside and outside of frames; this is the order of qpos.
void Gather(const MjcfModel& model, const XmlElement& element, const Placement& X,
            const std::string& childclass, Contents* contents) {
  const std::map<std::string, std::vector<Placed>*> lists = {{"body", &contents->bodies},
                                                             {"geom", &contents->geoms},
                                                             {"site", &contents->sites},
                                                             {"joint", &contents->joints},
                                                             {"freejoint", &contents->joints}};
  for (const XmlElement& child :
       element.ChildrenOf({"body", "geom", "site", "joint", "freejoint", "frame"})) {
    if (const auto list = lists.find(child.tag()); list != lists.end()) {
      list->second->push_back({child, X, childclass});
      continue;
    }
    child.Attribute("name");
    const Placement within = X * model.PlacementOf({child, {}});
    Gather(model, child, within, ClassWithin(model, child, childclass), contents);
  }
}

void ReadSites(const std::vector<Placed>& sites, int body, MjcfModel* model) {
  BodyDescription& described = model->draft->description.bodies[static_cast<std::size_t>(body)];
  for (const Placed& site : sites) {
    const MjcfElement element = model->defaults.Of(site.element, site.childclass);
    const auto given = site.element.Attribute("name");
    const Eigen::Vector3d at = site.X.At(model->PlacementOf(element).p);
    if (!given) continue;
    const std::string name = given->Name();
    if (!model->sites.emplace(name, BodyPoint{body, at}).second) {
      given->Fail("a name that no other site has");
    }
    described.points.emplace(name, at);
  }
}

/// Reads <inertial>: about its own axes, rotated into body axes.
void ReadInertial(const XmlElement& element, int body, MjcfModel* model) {
  const Placement X = model->PlacementOf({element, {}});
  const double mass = element.Required("mass", "a number [kg]").Number(kNotNegative);
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  const auto full = element.Attribute("fullinertia");
  const auto diagonal = element.Attribute("diaginertia");
  if (full && diagonal) full->Fail("either fullinertia or diaginertia");
  if (full) {
    const std::vector<double> I = full->Numbers(6, 6);
    inertia = SymmetricMatrix(I[0], I[1], I[2], I[3], I[4], I[5]);
  } else if (diagonal) {
    inertia.diagonal() = diagonal->Vector();
  }  // otherwise a point mass, as in MuJoCo
  BodyDescription& described = model->draft->description.bodies[static_cast<std::size_t>(body)];
  described.mass = mass;
  described.com = X.p;
  described.inertia = InTurnedAxes(X.q, inertia);
}

/// Reads masses. `is_fixed`: fixed to the ground, where masses matter only for a total mass.
void ReadMasses(const XmlElement& element, const Contents& contents, int body, bool is_fixed,
                MjcfModel* model) {
  const auto inertial = element.Child("inertial");
  const MjcfSettings& settings = model->settings;
  std::vector<MjcfGeom> geoms;
  for (const Placed& geom : contents.geoms) {
    geoms.push_back({model->defaults.Of(geom.element, geom.childclass), geom.X});
  }
  const bool wants_geoms = settings.inertia == MjcfSettings::kFromGeoms ||
                           (settings.inertia == MjcfSettings::kAuto && !inertial);
  MassProperties of_geoms;
  if (wants_geoms) {
    of_geoms = MassOfGeoms(*model, geoms, is_fixed && settings.total_mass <= 0.0);
  }
  const bool from_geoms = of_geoms.mass > 0.0;  // as in MuJoCo: otherwise <inertial> remains
  if (from_geoms) {
    BodyDescription& described = model->draft->description.bodies[static_cast<std::size_t>(body)];
    described.mass = of_geoms.mass;
    described.com = of_geoms.com;
    described.inertia = of_geoms.inertia;
    if (inertial) {
      model->draft->Note(*inertial, "dropped: inertiafromgeom asks for the geoms' masses");
      inertial->Ignore();
    }
  } else if (inertial) {
    ReadInertial(*inertial, body, model);
  }
  for (const MjcfGeom& geom : geoms) {
    geom.element.own().Ignore();
    for (const XmlElement& layer : geom.element.Layers()) layer.Ignore();
    if (!settings.has_contact) continue;
    model->draft->Note(geom.element.own(), from_geoms
                                               ? "no shape here, only its mass: there is no contact"
                                               : "dropped: there is no contact");
  }
}

/// Reads a body. `is_fixed`: the parent is the ground or is fixed to it.
void ReadBody(const Placed& placed, int parent, bool is_fixed, MjcfModel* model) {
  const XmlElement& element = placed.element;
  ImportDraft* draft = model->draft;
  const std::string childclass = ClassWithin(*model, element, placed.childclass);
  const auto name = element.Attribute("name");
  const int body = draft->AddBody(element, name ? name->Name() : "");
  const Placement X_PB = placed.X * model->PlacementOf({element, {}});
  draft->at_rest[static_cast<std::size_t>(body)] =
      draft->at_rest[static_cast<std::size_t>(parent)] * X_PB;
  Contents contents;
  Gather(*model, element, {}, childclass, &contents);
  is_fixed = is_fixed && contents.joints.empty();
  ReadMasses(element, contents, body, is_fixed, model);
  ReadSites(contents.sites, body, model);
  if (const auto lift = element.Attribute("gravcomp")) {
    const double share = lift->Number();
    if (share != 0.0 && model->settings.has_passive()) draft->AddLift(body, share);
  }
  if (const auto mocap = element.Attribute("mocap")) {
    if (mocap->Bool()) draft->Note(element, "mocap", "stays where the file draws it", true);
  }
  std::vector<MjcfJoint> joints;
  for (const Placed& joint : contents.joints) {
    joints.push_back(ReadMjcfJoint(*model, joint.element, joint.X, joint.childclass));
  }
  AddMjcfChain(model, element, parent, body, X_PB, joints);
  for (const Placed& child : contents.bodies) ReadBody(child, body, is_fixed, model);
}

/// Enforces A + B >= C as MuJoCo's compiler: replaces all three moments by their mean.
void Balance(Eigen::Matrix3d* inertia) {
  const Eigen::Vector3d moments = SymmetricEigenvalues(*inertia);
  if (moments[0] + moments[1] < moments[2]) {
    *inertia = moments.mean() * Eigen::Matrix3d::Identity();
  }
}

void BoundBelow(double least, Eigen::Matrix3d* inertia) {
  MatrixX<double> A = *inertia, U(3, 3);
  VectorX<double> moments(3);
  SymmetricEigen<double>(A, U, moments);
  if (moments[0] >= least) return;
  const Eigen::Matrix3d axes = U;
  const Eigen::Vector3d bounded = moments.cwiseMax(least);
  *inertia = axes * bounded.asDiagonal() * axes.transpose();
}

}  // namespace

void ReadMjcfWorld(const XmlElement& world, MjcfModel* model) {
  Contents contents;
  Gather(*model, world, {}, ClassWithin(*model, world, ""), &contents);
  for (const Placed& geom : contents.geoms) {
    for (const XmlElement& layer : model->defaults.Of(geom.element, geom.childclass).Layers()) {
      layer.Ignore();
    }
    if (model->settings.has_contact) {
      model->draft->Note(geom.element, "dropped: there is no contact");
    }
  }
  for (const Placed& joint : contents.joints) {
    joint.element.Fail("a joint of the world", "joints in bodies");
  }
  ReadSites(contents.sites, kGround, model);
  for (const Placed& body : contents.bodies) ReadBody(body, kGround, true, model);
}

void AdjustMasses(MjcfModel* model) {
  const MjcfSettings& settings = model->settings;
  auto& bodies = model->draft->description.bodies;
  double total = 0.0;
  for (std::size_t i = 1; i < bodies.size(); ++i) {
    BodyDescription& body = bodies[i];
    body.mass = std::max(body.mass, settings.least_mass);
    if (settings.least_inertia > 0.0) BoundBelow(settings.least_inertia, &body.inertia);
    if (settings.balances_inertia) Balance(&body.inertia);
    total += body.mass;
  }
  if (settings.total_mass > 0.0 && total > 0.0) {
    const double factor = settings.total_mass / total;
    for (std::size_t i = 1; i < bodies.size(); ++i) {
      bodies[i].mass *= factor;
      bodies[i].inertia *= factor;
    }
  }
}

// Masses of MuJoCo shapes.

namespace {

using std::numbers::pi;

constexpr double kDensity = 1000.0;  // [kg/m^3], MuJoCo's default
/// Smaller volumes [m^3] ignore a given mass, and smaller masses [kg] are ignored: mjEPS in
/// MuJoCo's src/user/user_objects.cc.
constexpr double kLeast = 1e-14;

/// Volume [m^3], and moments of inertia per mass [m^2] about its own axes; z is its symmetry axis.
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

/// Returns a cylinder with two hemispheres; their centres of mass are 3/8 radius beyond its ends.
Shape CapsuleOf(double radius, double half) {
  const Shape middle = CylinderOf(radius, half);
  const double ends = 4.0 / 3.0 * pi * radius * radius * radius;
  const double volume = middle.volume + ends;
  const double about_axis = 0.4 * radius * radius;
  const double across = about_axis + half * half + 0.75 * radius * half;
  const Eigen::Vector3d of_ends(across, across, about_axis);
  return {volume, (middle.volume * middle.moments + ends * of_ends) / volume};
}

/// Number of values of `size` for each type, without and with `fromto`.
struct SizeOf {
  std::size_t own, along;
};
const std::vector<std::string>& Types() {
  static const std::vector<std::string> types = {
      "sphere", "capsule", "cylinder", "box", "ellipsoid", "plane", "hfield", "mesh", "sdf"};
  return types;
}
constexpr SizeOf kSizes[] = {{1, 1}, {2, 1}, {2, 1}, {3, 1}, {3, 1}};

/// Returns the sizes of a geom and its frame; `fromto` gives position, axis and half length.
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
  // z along the line, from the second end to the first as in MuJoCo: shapes are symmetric
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

/// Reads a geom; returns false if it has no mass.
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
