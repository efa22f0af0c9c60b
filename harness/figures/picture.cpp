#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "harness/figures/view.h"
#include "harness/judge/analysis.h"
#include "mechanism/algebra/decompositions.h"
#include "mechanism/algebra/factors.h"
#include "mechanism/algebra/singular_values.h"
#include "mechanism/loops/excursion.h"
#include "mechanism/loops/scaled_loops.h"
#include "mechanism/simplify/compile.h"
#include "mechanism/simplify/structure.h"

namespace loopbench::harness {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Number of tree speeds above which no loop motion is followed and nothing is analysed.
constexpr int kMaxFollowed = 240;
constexpr std::size_t kMaxPoints = 50, kMaxMotions = 12;  ///< named points with paths; motions

/// Returns the poses of the bodies of a mechanism that was compiled from `description` unchanged.
template <class Space>
Poses PosesOf(const MechanismDescription& description,
              const Kinematics<Space, double>& kinematics) {
  Poses poses(description.bodies.size());
  for (std::size_t b = 0; b < poses.size(); ++b) {
    const Pose<Space, double>& X = kinematics.poses()[b];
    for (int i = 0; i < Space::kLin; ++i) {
      poses[b].p[i] = X.p[i];
      for (int j = 0; j < Space::kLin; ++j) poses[b].R(i, j) = X.R(i, j);
    }
    if (b == kGround) continue;
    Eigen::Vector3d com = description.bodies[b].com;
    if (Space::kLin == 2) com.z() = 0.0;
    poses[b].p -= poses[b].R * com;
  }
  return poses;
}

// Motions: each degree of freedom swings to and fro with all loops closed in every frame.
// Prescribed motions run once.
//
// In the chosen basis of admissible speeds each motion moves one joint by one unit and stops the
// leading joints of the others; it is named after its joint. It is followed in small steps along
// the projection of its last direction, each with a position projection onto the loops. If even the
// first step fails (speeds of a singular configuration without a finite motion), bodies move along
// the speed itself by a small angle.

/// Limit of the largest coordinate along a swing, in rad or lengths of the mechanism; and number of
/// frames to either side.
constexpr double kSwing = 0.7;
constexpr int kFramesAside = 14, kFramesOfPass = 49;
constexpr double kSmall = 0.05;  ///< amplitude of a motion without a finite path

template <class Space>
class Follower {
 public:
  Follower(const Mechanism<Space, double>& mechanism, const VectorX<double>& q)
      : mechanism_(mechanism), kinematics_(mechanism), q_(q), units_(mechanism.num_u()) {
    kinematics_.UpdatePosition(q_);
    kinematics_.AcceptStep();
    kinematics_.CountTurns();
    units_.setOnes();
    for (const TreeStep& step : mechanism.tree()) {
      const JointState<Space, double>& state = kinematics_.joints()[step.joint];
      const int offset = mechanism.joints()[step.joint].u_offset;
      for (int i = 0; i < state.num_u; ++i) {
        if (state.H(i).angular.isZero()) units_[offset + i] = mechanism.length();
      }
    }
  }

  const VectorX<double>& q() const { return q_; }
  const VectorXd& units() const { return units_; }
  const Kinematics<Space, double>& kinematics() const { return kinematics_; }

  void Place(const VectorX<double>& q) {
    q_ = q;
    kinematics_.UpdatePosition(q_);
  }

  /// Sets the time of the prescribed motions, from the present coordinates; returns true if closed.
  bool SetTime(double t) {
    kinematics_.SetTime(t);
    kinematics_.UpdatePosition(q_);
    return Close();
  }

  void Shift(const VectorXd& u) { Place(Moved(u, q_)); }

  /// Moves along the projection of `u` onto the constraints, which becomes the new direction.
  /// Returns true if the loops close at a different position.
  bool Step(double distance, VectorXd* u) {
    if (mechanism_.num_equations() == 0) {
      Shift(*u * (distance / Size(*u)));
      return true;
    }
    const VectorX<double> before = q_;
    const DirectionRows here = RowsOfDirections(kinematics_);
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver;
    solver.setThreshold(kRankRatio);
    solver.compute(here.rows);
    VectorXd y = here.mass.matrixU() * *u;
    y -= solver.solve(VectorXd(here.rows * y));
    *u = here.mass.matrixU().solve(y);
    *u *= distance / Size(*u);
    Shift(*u);
    // a step that returns to its start leads nowhere
    const bool moved = Close() && (q_ - before).norm() > 0.3 * (Moved(*u, before) - before).norm();
    if (moved) {
      kinematics_.AcceptStep();
    } else {
      Place(before);
    }
    return moved;
  }

 private:
  double Size(const VectorXd& u) const {
    return u.cwiseQuotient(units_).template lpNorm<Eigen::Infinity>();
  }
  VectorX<double> Moved(const VectorXd& u, const VectorX<double>& from) const {
    VectorX<double> rate(from.size());
    mechanism_.Rates(from, u, rate);
    VectorX<double> moved = from + rate;
    mechanism_.Normalise(moved);
    return moved;
  }

  /// Runs Newton's method to the nearest closed position.
  bool Close() {
    constexpr int kMaxIterations = 12;
    const double goal = 1e-10 * mechanism_.length();
    for (int i = 0; i < kMaxIterations; ++i) {
      const DirectionRows here = RowsOfDirections(kinematics_);
      if (!here.mismatch.allFinite()) return false;
      if (here.mismatch.size() == 0 || here.mismatch.norm() < goal) return true;
      Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver;
      solver.setThreshold(1e-9);
      solver.compute(here.rows);
      const VectorXd back =
          here.mass.matrixU().solve(VectorXd(solver.solve(VectorXd(-here.mismatch))));
      if (!(Size(back) < 1.0)) return false;
      Shift(back);
    }
    return false;
  }

  const Mechanism<Space, double>& mechanism_;
  Kinematics<Space, double> kinematics_;
  VectorX<double> q_;
  VectorXd units_;
};

struct MotionStart {
  int speed = 0;  ///< its leading speed: 1 here, 0 in the other directions
  VectorXd u;
};

/// Returns weights by speed: 1 for joints with one speed, less for others.
template <class Space>
VectorXd Clearness(const Mechanism<Space, double>& mechanism) {
  VectorXd clearness(mechanism.num_u());
  for (const TreeStep& step : mechanism.tree()) {
    const Joint<Space, double>& joint = mechanism.joints()[static_cast<std::size_t>(step.joint)];
    if (joint.num_u() > 0) {
      clearness.segment(joint.u_offset, joint.num_u()).setConstant(joint.num_u() == 1 ? 1.0 : 0.1);
    }
  }
  return clearness;
}

/// Returns the first `most` admissible directions, each with its leading speed.
template <class Space>
std::vector<MotionStart> MotionStarts(const Follower<Space>& start, std::size_t most) {
  const Mechanism<Space, double>& mechanism = start.kinematics().mechanism();
  const Eigen::Index n = mechanism.num_u();
  std::vector<MotionStart> all;
  if (mechanism.num_equations() == 0) {
    for (int i = 0; i < n && all.size() < most; ++i) all.push_back({i, VectorXd::Unit(n, i)});
    return all;
  }
  const MatrixXd permitted = ScaleLoops(start.kinematics()).to_u;
  const Eigen::Index count = permitted.cols();
  if (count == 0) return all;
  const MatrixXd scaled = start.units().cwiseInverse().asDiagonal() * permitted;
  // use the user's independent speeds if they are independent, else the most independent ones
  std::vector<int> chosen = mechanism.independent();
  MatrixXd own(count, count);
  const auto take = [&] {
    for (Eigen::Index i = 0; i < count; ++i) own.row(i) = scaled.row(chosen[i]);
  };
  constexpr double kIndependent = 1e-2;
  bool good = static_cast<Eigen::Index>(chosen.size()) == count;
  if (good) {
    take();
    SingularValues<double> values;
    values.ComputeValues(own);
    good = values.sigma()[count - 1] > kIndependent * values.sigma()[0];
  }
  if (!good) {
    // prefer the name of a pin to one of the three speeds of a ball
    const MatrixXd clear = scaled.transpose() * Clearness(mechanism).asDiagonal();
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(clear);
    const auto& order = qr.colsPermutation().indices();
    chosen.assign(order.data(), order.data() + count);
    std::ranges::sort(chosen);
    take();
  }
  const MatrixXd basis = permitted * Eigen::PartialPivLU<MatrixXd>(own).inverse();
  for (Eigen::Index i = 0; i < count && all.size() < most; ++i) {
    all.push_back({chosen[static_cast<std::size_t>(i)], basis.col(i)});
  }
  return all;
}

template <class Space>
PictureMotion Swing(const MechanismDescription& description, Follower<Space>* follower,
                    const MotionStart& beginning, int frames) {
  const Mechanism<Space, double>& mechanism = follower->kinematics().mechanism();
  const VectorX<double> start = follower->q();
  const Poses at_start = PosesOf(description, follower->kinematics());
  const auto step = std::ranges::find_if(mechanism.tree(), [&](const TreeStep& one) {
    const Joint<Space, double>& joint = mechanism.joints()[one.joint];
    return joint.u_offset <= beginning.speed && beginning.speed < joint.u_offset + joint.num_u();
  });
  const int column = beginning.speed - mechanism.joints()[step->joint].u_offset;
  const bool is_length = follower->kinematics().joints()[step->joint].H(column).angular.isZero();
  PictureMotion motion;
  motion.name = mechanism.speed_names()[static_cast<std::size_t>(beginning.speed)];
  const JointDescription& joint = description.joints[step->joint];
  const auto words = ValueWords(joint.type, description.space, true);
  if (words.size() > 1 && joint.motions.empty()) {
    motion.name = fmt::format("{}.{}", joint.name, words[column].name);
  }
  double reach[2] = {0.0, 0.0};
  std::vector<Poses> sides[2];
  for (const int side : {0, 1}) {
    follower->Place(start);
    VectorXd u = side == 0 ? VectorXd(-beginning.u) : beginning.u;
    while (static_cast<int>(sides[side].size()) < frames && follower->Step(kSwing / frames, &u)) {
      reach[side] += u[beginning.speed];
      sides[side].push_back(PosesOf(description, follower->kinematics()));
    }
  }
  follower->Place(start);
  const bool whole = std::ssize(sides[0]) == frames && std::ssize(sides[1]) == frames;
  motion.text =
      fmt::format("{:+.3g} to {:+.3g} {}{}; loops closed again in every frame", reach[0], reach[1],
                  is_length ? "m" : "rad", whole ? "" : ", where it cannot be followed further");
  if (sides[0].empty() && sides[1].empty()) {
    const double size =
        beginning.u.cwiseQuotient(follower->units()).template lpNorm<Eigen::Infinity>();
    for (const int side : {0, 1}) {
      follower->Shift(beginning.u * ((side == 0 ? -kSmall : kSmall) / size));
      sides[side].push_back(PosesOf(description, follower->kinematics()));
      follower->Place(start);
    }
    motion.text = fmt::format(
        "to first order only, by {:g} rad or lengths: no position that closes the "
        "loops follows",
        kSmall);
  }
  motion.frames.assign(sides[0].rbegin(), sides[0].rend());
  motion.start = static_cast<int>(motion.frames.size());
  motion.frames.push_back(at_start);
  motion.frames.insert(motion.frames.end(), sides[1].begin(), sides[1].end());
  return motion;
}

/// Returns a time that shows a prescribed motion: a period, a whole table, a turn or a length.
double TimeToShow(const TimeFunctionDescription& function, double unit) {
  constexpr double kTurn = 2 * std::numbers::pi;
  if (const auto* harmonic = std::get_if<Harmonic>(&function)) {
    return harmonic->omega != 0.0 ? kTurn / std::abs(harmonic->omega) : 0.0;
  }
  if (const auto* table = std::get_if<TimeTable>(&function)) return table->times.back();
  const Polynomial& polynomial = std::get<Polynomial>(function);
  const auto& c = polynomial.coefficients;
  if (c.size() > 1 && c[1] != 0.0) return kTurn * unit / std::abs(c[1]);
  return c.size() > 2 && c[2] != 0.0 ? std::sqrt(kTurn * unit / std::abs(c[2])) : 0.0;
}

template <class Space>
PictureMotion Pass(const MechanismDescription& description, const VectorX<double>& q,
                   Follower<Space>* follower, int frames) {
  double horizon = 0.0;
  for (const JointDescription& joint : description.joints) {
    const auto words = ValueWords(joint.type, description.space, false);
    for (const PrescribedMotion& motion : joint.motions) {
      const bool length = words.at(static_cast<std::size_t>(motion.coordinate)).is_length();
      const double unit = length ? follower->kinematics().mechanism().length() / 8 : 1.0;
      horizon = std::max(horizon, TimeToShow(motion.value, unit));
    }
  }
  PictureMotion motion{.name = "prescribed motions", .returns = false};
  double t = 0.0;
  for (int i = 0; i < frames; ++i) {
    t = horizon * i / (frames - 1);
    if (!follower->SetTime(t)) break;
    motion.frames.push_back(PosesOf(description, follower->kinematics()));
  }
  const bool whole = std::ssize(motion.frames) == frames;
  motion.text = fmt::format("t = 0 to {:.3g} s, all else as the loops carry it{}", t,
                            whole ? "" : "; they close no further");
  follower->Place(q);
  follower->SetTime(0.0);
  follower->Place(q);
  return motion;
}

/// Finds at most kMaxMotions motions from the closed position q in joint coordinates; none for
/// loops with more than kMaxFollowed speeds. `left_out` gives the reason.
template <class Space>
std::vector<PictureMotion> FindMotions(const MechanismDescription& description,
                                       const Mechanism<Space, double>& mechanism,
                                       const VectorX<double>& q, std::string* left_out) {
  std::vector<PictureMotion> motions;
  if (mechanism.num_equations() > 0 && mechanism.num_u() > kMaxFollowed) {
    *left_out = fmt::format("motions: the loops have {} speeds, followed are up to {}",
                            mechanism.num_u(), kMaxFollowed);
    return motions;
  }
  Follower<Space> follower(mechanism, q);
  // reduce frames rather than motions
  const auto bodies = description.bodies.size();
  const std::size_t fit = kMaxFrames / bodies;
  const auto frames_of = [&](std::size_t count, int wanted) {
    return std::min(wanted, static_cast<int>(fit / count));
  };
  if (!mechanism.drives().empty() && fit >= 2) {
    motions.push_back(Pass(description, q, &follower, frames_of(2, kFramesOfPass)));
  }
  constexpr int kFewest = 3;
  const std::size_t most =
      std::clamp<std::size_t>(fit / (2 * (2 * kFewest + 1)), fit >= 7 ? 1 : 0, kMaxMotions);
  if (most == 0) {
    *left_out = fmt::format("motions: {} bodies have no room in the {} places of all frames",
                            bodies - 1, kMaxFrames);
    return motions;
  }
  const std::vector<MotionStart> beginnings = MotionStarts(follower, most);
  for (const MotionStart& beginning : beginnings) {
    const int aside =
        std::clamp(frames_of(4 * beginnings.size(), kFramesAside), kFewest, kFramesAside);
    motions.push_back(Swing(description, &follower, beginning, aside));
  }
  return motions;
}

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
  if (!(picture->extent > 0.0)) picture->extent = 1.0;  // one point has no size
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
      for (const std::string& warning : FindGuessWarnings(description_, start.q)) {
        picture_->notes.push_back(warning);
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
        if (one.coupling >= 0 || one.joint != path.cut_joint) continue;
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

}  // namespace loopbench::harness
