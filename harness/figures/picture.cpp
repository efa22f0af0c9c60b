#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "harness/figures/view.h"
#include "harness/judge/analysis.h"
#include "mechanism/loops/excursion.h"
#include "mechanism/simplify/compile.h"
#include "mechanism/simplify/structure.h"

namespace loopbench::harness {
namespace {

using Eigen::Vector3d;

std::string VectorText(const Vector3d& v, SpaceKind space) {
  return space == SpaceKind::kPlanar ? fmt::format("({:.6g}, {:.6g})", v.x(), v.y())
                                     : fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x(), v.y(), v.z());
}

std::string ForceText(const MechanismDescription& description, ForceDescription force) {
  const ForceParts parts = PartsOf(force);
  std::vector<std::string> words;
  bool is_length = true;
  if (parts.joint != nullptr) {
    const JointDescription& joint = description.joints[*parts.joint];
    words.push_back("at joint " + joint.name);
    is_length = ValueWords(joint.type, description.space, false).at(0).is_length();
  }
  for (const BodyPoint* point : parts.points) {
    words.push_back("at " + description.bodies[point->body].name + " " +
                    VectorText(point->at, description.space));
  }
  if (parts.force != nullptr) {
    words.push_back(fmt::format("{} N in {} axes", VectorText(*parts.force, description.space),
                                *parts.in_body_axes ? "body" : "ground"));
  }
  for (const ForceNumber& number : parts.numbers) {
    if (*number.value == 0.0) continue;
    words.push_back(
        fmt::format("{} {:.6g} {}", number.key, *number.value, number.quantity.Unit(is_length)));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

/// Adds data of a mechanism that do not depend on the position: names and numbers.
void AddItems(const MechanismDescription& description, Picture* picture) {
  const bool detailed = description.bodies.size() <= kMaxDetailed;
  for (const BodyDescription& body : description.bodies) {
    picture->centres.push_back({.body = static_cast<int>(picture->items.size()), .at = body.com});
    PictureItem& item = picture->items.emplace_back(PictureItem{ItemKind::kBody, body.name});
    if (!detailed || picture->items.size() == 1) continue;
    item.detail = fmt::format("body, {:.6g} kg, centre of mass {}", body.mass,
                              VectorText(body.com, description.space));
  }
  picture->items.front().detail = "ground";
  for (const JointDescription& joint : description.joints) {
    PictureItem& item = picture->items.emplace_back(PictureItem{ItemKind::kJoint, joint.name});
    item.detail = fmt::format("{} from {} to {}", ToString(joint.type),
                              description.bodies[joint.from.body].name,
                              description.bodies[joint.to.body].name);
    if (!joint.motions.empty()) item.detail += ", with a prescribed motion";
  }
  for (ForceDescription force : description.forces) {
    const ForceParts parts = PartsOf(force);
    picture->items.push_back(
        {ItemKind::kForce, std::string(parts.name), ForceText(description, force)});
  }
}

/// Marks parts that the compile step removes or merges, from the images of bodies and joints.
void MarkGone(const MechanismDescription& description, Picture* picture) {
  const Compiled compiled = Compile(description);
  picture->notes = compiled.report;
  for (std::size_t b = 1; b < compiled.bodies.size(); ++b) {
    const BodyImage& image = compiled.bodies[b];
    PictureItem& item = picture->items[b];
    if (image.part < 0 || image.body == kGround) {
      item.gone = "does not move: part of the ground";
      continue;
    }
    const std::string& host = compiled.parts[image.part].description.bodies[image.body].name;
    if (host != item.name) item.gone = "moves as one with " + host;
  }
  for (std::size_t j = 0; j < compiled.joints.size(); ++j) {
    if (compiled.joints[j].part >= 0) continue;
    picture->items[picture->ItemOfJoint(static_cast<int>(j))].gone =
        "nothing moves in it: its bodies are one";
  }
}

/// Returns the opening of a cut joint in ground axes: rotation [rad] and shift [m].
template <class Space>
Direction<Space, double> OpennessOf(const Kinematics<Space, double>& kinematics, int joint) {
  const JointState<Space, double>& state = kinematics.joints()[joint];
  return state.Sum(state.Along(kinematics.ConstraintMismatch(joint), state.rows()), state.rows());
}

/// Chooses the symbol size from the link lengths, bounded by the picture size.
void Measure(const MechanismDescription& description, Picture* picture) {
  const auto points = Attachments(description);
  Eigen::AlignedBox3d box;
  std::vector<double> links;
  for (std::size_t b = 0; b < points.size(); ++b) {
    Eigen::AlignedBox3d own;
    for (const Vector3d& at : points[b]) {
      const Vector3d p = PicturePlace{.body = static_cast<int>(b), .at = at}.In(picture->start);
      box.extend(p);
      own.extend(p);
    }
    if (b != kGround && !own.isEmpty() && own.diagonal().norm() > 0.0) {
      links.push_back(own.diagonal().norm());
    }
  }
  picture->extent = box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
  // a mechanism of one point has no size: any value will do
  if (!(picture->extent > 0.0)) picture->extent = 1.0;
  double link = picture->extent;
  if (!links.empty()) {
    const auto middle = links.begin() + static_cast<std::ptrdiff_t>(links.size() / 2);
    std::nth_element(links.begin(), middle, links.end());
    link = *middle;
  }
  picture->symbol = std::min(0.016 * picture->extent, 0.08 * link);
  // links much shorter than the whole: pins of a picture seen from a distance
  picture->symbol = std::max(picture->symbol, 1e-5 * picture->extent);
}

std::string FreedomText(const Structure& structure) {
  std::string text = fmt::format("{} by counting", structure.counted_freedom);
  if (!structure.analysed) return text;
  text += fmt::format(", {} by rank", structure.freedom());
  if (structure.freedom_at_start() != structure.freedom()) {
    text += fmt::format("; {} to first order at the start, a singular position",
                        structure.freedom_at_start());
  }
  return text;
}

template <class Space>
class Maker {
 public:
  Maker(const MechanismDescription& description, Picture* picture)
      : description_(description),
        picture_(picture),
        mechanism_(description, Coordinates::kJoint),
        kinematics_(mechanism_) {}

  void Make() {
    const bool analysed = mechanism_.num_equations() == 0 || mechanism_.num_u() <= kMaxFollowed;
    Structure structure;
    if (analysed && mechanism_.num_u() <= kMaxAnalysedSpeeds) {
      structure = AnalyseStructure(description_);
      picture_->freedom = FreedomText(structure);
      MarkGone(description_, picture_);
    } else {
      structure.start = Assemble<Space>(description_, mechanism_);
      picture_->notes.push_back(fmt::format(
          "{} speeds: rank, redundant constraints and what a run leaves out are looked for up to "
          "{} of them; loopbench explain has more patience",
          mechanism_.num_u(), mechanism_.num_equations() == 0 ? kMaxAnalysedSpeeds : kMaxFollowed));
    }
    const Start<double>& start = structure.start;
    picture_->assembled = start.outcome != Outcome::kInconsistentStart;
    picture_->message = start.message;
    if (picture_->assembled && !start.message.empty()) picture_->notes.push_back(start.message);
    kinematics_.UpdatePosition(GuessedPositions(description_, mechanism_));
    picture_->given = PosesOf(description_, kinematics_);
    AddLoops(structure);
    picture_->start = picture_->given;
    if (picture_->assembled) {
      kinematics_.UpdatePosition(start.q);
      picture_->start = PosesOf(description_, kinematics_);
      for (const Warning& warning : FindGuessWarnings(description_, start.q)) {
        picture_->notes.push_back(warning.text);
      }
      for (PictureLoop& loop : picture_->loops) {
        loop.left = OpennessOf(kinematics_, loop.cut_joint).linear.norm();
      }
    }
    Measure(description_, picture_);
    AddShapes(description_, picture_);
    if (!picture_->assembled) return;
    std::string left_out;
    picture_->motions = FindMotions(description_, mechanism_, start.q, &left_out);
    if (!left_out.empty()) picture_->notes.push_back(left_out);
    if (picture_->motions.size() == kMaxMotions) {
      picture_->notes.push_back(fmt::format("motions: the first {}", kMaxMotions));
    }
  }

 private:
  /// Adds loops; kinematics must be at the given poses.
  void AddLoops(const Structure& structure) {
    const auto add = [&](int joint) -> PictureLoop& {
      const JointDescription& cut = description_.joints[joint];
      PictureLoop& loop = picture_->loops.emplace_back();
      loop.cut_joint = joint;
      const Direction<Space, double> open = OpennessOf(kinematics_, joint);
      loop.turn = open.angular.norm();
      loop.gap = open.linear.norm();
      loop.to = loop.from = {.body = cut.to.body, .at = cut.to.position};
      for (int i = 0; i < Space::kLin; ++i) loop.from.offset[i] = -open.linear[i];
      return loop;
    };
    if (structure.loops.empty()) {
      for (const int joint : mechanism_.constraints()) add(joint);
    }
    for (const LoopPath& path : structure.loops) {
      PictureLoop& loop = add(path.cut_joint);
      loop.bodies = path.bodies;
      loop.joints = path.joints;
      for (const RedundantDirection& one : structure.redundant) {
        if (one.joint != path.cut_joint) continue;
        loop.redundant.push_back(one.name + (one.released ? "" : " (at the start)"));
      }
      picture_->items[picture_->ItemOfJoint(path.cut_joint)].redundant = loop.redundant;
    }
  }

  const MechanismDescription& description_;
  Picture* picture_;
  Mechanism<Space, double> mechanism_;
  Kinematics<Space, double> kinematics_;
};

}  // namespace

Picture MakePicture(const MechanismDescription& description, const std::string& file) {
  Picture picture;
  picture.name = description.name;
  picture.file = file;
  picture.planar = description.space == SpaceKind::kPlanar;
  picture.gravity = description.gravity;
  picture.bodies = description.bodies.size();
  picture.joints = description.joints.size();
  if (!picture.planar) {
    const double g = description.gravity.norm();
    picture.up = g > 0.0 ? Vector3d(-description.gravity / g) : Vector3d::UnitZ();
  }
  AddItems(description, &picture);
  for (int b = 1; b < std::ssize(description.bodies); ++b) {
    const BodyDescription& body = description.bodies[b];
    for (const auto& [name, at] : body.points) {
      if (picture.points.size() == kMaxPoints) break;
      picture.points.push_back({body.name + ":" + name, {.body = b, .at = at}});
    }
  }
  if (picture.planar) {
    Maker<Planar>(description, &picture).Make();
  } else {
    Maker<Spatial>(description, &picture).Make();
  }
  return picture;
}

const std::vector<std::string>& ViewNames() {
  static const std::vector<std::string> names = {"oblique", "front", "side", "top"};
  return names;
}

Eigen::Matrix3d ViewNamed(const Picture& picture, const std::string& name) {
  if (picture.planar) return Eigen::Matrix3d::Identity();
  // azimuth and elevation of the viewer [degrees] about `up`
  double azimuth = -62.0, elevation = 22.0;
  if (name == "front") azimuth = -90.0, elevation = 0.0;
  if (name == "side") azimuth = 0.0, elevation = 0.0;
  if (name == "top") azimuth = -90.0, elevation = 89.999;  // right stays defined
  const Vector3d& up = picture.up;
  const Vector3d axis = std::abs(up.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d a = (axis - axis.dot(up) * up).normalized(), b = up.cross(a);
  constexpr double kDegree = std::numbers::pi / 180.0;
  const Vector3d level = std::cos(azimuth * kDegree) * a + std::sin(azimuth * kDegree) * b;
  const Vector3d viewer =
      std::cos(elevation * kDegree) * level + std::sin(elevation * kDegree) * up;
  Eigen::Matrix3d R;
  R.row(0) = up.cross(viewer).normalized();
  R.row(2) = viewer;
  R.row(1) = viewer.cross(Vector3d(R.row(0)));
  return R;
}

Camera FitTo(const Picture& picture, const std::vector<const Poses*>& poses,
             const Eigen::Matrix3d& R, double width, double margin, double* height) {
  Eigen::AlignedBox3d box;
  for (const PictureShape& shape : picture.shapes) {
    for (const PicturePlace& place : shape.places) {
      for (const Poses* one : poses) box.extend(R * place.In(*one));
    }
  }
  if (box.isEmpty()) box.extend(Vector3d::Zero());
  // half of a pin and of a bar
  const double around = 2.0 * picture.symbol;
  const Vector3d size = box.sizes() + Vector3d::Constant(2.0 * around);
  constexpr double kLowest = 90.0, kHighest = 560.0;
  const double across = width - 2.0 * margin;
  Camera camera{.R = R, .centre = R.transpose() * box.center()};
  camera.scale = std::min(across / size.x(), (kHighest - 2.0 * margin) / size.y());
  *height = std::max(kLowest, camera.scale * size.y() + 2.0 * margin);
  camera.middle_x = 0.5 * width;
  camera.middle_y = 0.5 * *height;
  return camera;
}

}  // namespace loopbench::harness
