// <worldbody>: bodies, their masses and their sites.
#include <fmt/format.h>

#include "harness/exchange/import_mjcf.h"
#include "mechanism/algebra/symmetric_eigen.h"

namespace loopbench::harness {

namespace {

/// A child of a body, the frame around it, and the class that counts there.
struct Placed {
  XmlElement element;
  Placement X;
  std::string childclass;
};

/// What a body holds, frames (<frame>) dissolved.
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

/// In the order of the file, within frames and beside them: it is that of qpos.
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

/// <inertial>: about its own axes, turned into those of the body.
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
  }  // else a point, as MuJoCo has it
  BodyDescription& described = model->draft->description.bodies[static_cast<std::size_t>(body)];
  described.mass = mass;
  described.com = X.p;
  described.inertia = InTurnedAxes(X.q, inertia);
}

/// `is_fixed`: to the ground, where masses move nothing unless they count in a total.
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
  const bool from_geoms = of_geoms.mass > 0.0;  // as in MuJoCo: else <inertial> stays
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

/// `is_fixed`: the parent is fixed to the ground, or is it.
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

/// As MuJoCo's compiler: A + B >= C by taking the mean of the three.
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

}  // namespace loopbench::harness
